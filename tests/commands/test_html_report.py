import re
import sys
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import __version__, make_diagnoser, make_windows, save_diagnoser
from skarxlag.commands import main, results
from skarxlag.commands.diagnosis import diagnose_file
from skarxlag.commands.models import SavedModel
from skarxlag.commands.results import _accuracy
from skarxlag.recordings.listing import list_files

WINDOW, RATE = 400, 8_000.0


def signal(condition, seed, n_windows=30):
    noise = np.random.default_rng(seed).normal(size=n_windows * WINDOW)
    return lfilter([1.0], {"good": [1.0], "worn": [1.0, -0.9]}[condition], noise)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plant")
    X = np.concatenate(
        [make_windows(signal(c, 0, 200), WINDOW) for c in ("good", "worn")]
    )
    diagnoser = make_diagnoser(healthy="good").fit(X, np.repeat(["good", "worn"], 200))
    save_diagnoser(diagnoser, folder / "m.skops", sampling_rate=RATE)
    partly = signal("worn", 2)
    partly[: 6 * WINDOW] = 0.0
    recordings = {
        "good": signal("good", 1), "worn": partly, "<b>": signal("good", 3), "dead": 0 * partly
    }  # fmt: skip
    lines = ["path,condition,rpm,sampling_rate,hall"]
    for name, values in recordings.items():
        np.save(folder / f"{name}.npy", values)
        condition = "worn" if name in ("worn", "<b>") else "good"
        lines.append(f"{name}.npy,{condition},300,{RATE},north & south")
    (folder / "table.csv").write_text(
        "\n".join([*lines, f"lost.npy,worn,300,{RATE},x"])
    )
    return folder


class Document(HTMLParser):
    """Texts, attributes that load something, and whether all elements are closed."""

    def __init__(self, content):
        super().__init__()
        self.texts, self.loads, self.open = [], [], []
        self.feed(content)

    def handle_starttag(self, tag, attributes):
        self.loads += [value for name, value in attributes if name in ("src", "href")]
        if tag not in ("meta", "br", "img"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


def diagnosed(plant, *recordings):
    """The report of some recordings, or of the table."""
    output = plant / "report.html"
    what = recordings or ("--table", plant / "table.csv")
    main(
        [
            str(each)
            for each in ["diagnose", plant / "m.skops", *what, "-o", output, "-q"]
        ]
    )
    return output.read_text()


@pytest.fixture(scope="module")
def report(plant):
    return diagnosed(plant)


def test_the_report_is_one_file_that_asks_for_nothing(report):
    document = Document(report)
    assert not document.open
    assert all(
        load.startswith(("#r", "data:image/svg+xml;base64,")) for load in document.loads
    )
    assert "http" not in report and "<script" not in report and "@import" not in report
    assert 'name="viewport"' in report and "@media print" in report


def test_the_report_says_what_the_table_says_and_what_came_of_it(report):
    text = " ".join(" ".join(Document(report).texts).split())
    assert "Diagnosis of 5 recordings" in text
    assert "2 good" in text and "1 worn" in text and "1 no signal" in text
    # The dead sensor has no verdict, and <b> is good although worn is stated.
    assert "2 of 4 verdicts agree with the stated condition" in text
    assert "hall: north & south" in text and "<b>.npy" in text
    assert "6 of 30 windows carry no signal (constant: 6)." in text
    assert (
        "lost.npy no verdict: no such file" in text and "Without a verdict: 1." in text
    )
    assert "Healthy condition: good." in text and f"skarxlag {__version__}" in text
    assert re.search(r"\d{4}-\d\d-\d\d, skarxlag", text) and "300 rpm" in text


def images(page):
    """Figures of a page as text, by the recording to which they belong."""
    found = {}
    for section in re.findall(r"<section.*?</section>", page, re.S):
        name = re.search("<h3>(.*?)</h3>", section)[1]
        codes = re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', section)
        found[name] = [b64decode(code).decode() for code in codes]
    return found


def test_recordings_that_are_not_healthy_have_details_and_figures(report):
    drawn = images(report)
    assert list(drawn) == ["worn.npy", "dead.npy", "lost.npy"]
    timeline, signal = drawn["worn.npy"]
    assert (
        ">Time (s)<" in timeline and ">worn<" in timeline and ">no signal<" in timeline
    )
    assert ">Time (ms)<" in signal
    # All windows of a dead sensor are alike.
    assert drawn["dead.npy"] == drawn["lost.npy"] == []
    overview = report.partition("<h2>Recordings that are not healthy")[0]
    assert re.findall(r'<td class="name">(?:<a href="#r\d">)?([^<]*\.npy)', overview) == [
        "worn.npy", "dead.npy", "lost.npy", "good.npy", "&lt;b&gt;.npy"
    ]  # fmt: skip


def test_the_worst_recordings_are_drawn(plant, monkeypatch):
    monkeypatch.setattr(results, "MOST_DRAWN", 1)
    page = diagnosed(plant)
    assert [len(each) for each in images(page).values()] == [2, 0, 0]
    assert "Figures of the first 1 recordings only." in page


def test_a_report_without_matplotlib_has_no_figures(plant, monkeypatch):
    monkeypatch.setattr(results, "why_no_figures", lambda: "No figures: nothing draws.")
    page = diagnosed(plant)
    assert "No figures: nothing draws." in page and not any(images(page).values())


def test_a_report_needs_jinja2(plant, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    arguments = [
        "diagnose",
        plant / "m.skops",
        plant / "good.npy",
        "-o",
        plant / "no.html",
    ]
    assert main([str(each) for each in arguments]) == 1
    err = capsys.readouterr().err
    assert "a report needs jinja2: pip install 'skarxlag[io]'" in err
    # It is missed before anything is read.
    assert "good.npy" not in err


def page_of_many(plant, monkeypatch, name, n):
    """The report of n recordings that all have the diagnosis of one."""
    monkeypatch.setattr(results, "why_no_figures", lambda: "none")
    model, recordings = SavedModel(plant / "m.skops"), list_files(plant / f"{name}.npy")
    found = [diagnose_file(recordings[0], model.load)] * n
    rows = results.recording_rows(recordings * n, found, "good")
    return results.html_report(model, recordings * n, found, rows)


def test_many_recordings_are_a_short_page(plant, monkeypatch):
    """60 healthy recordings have a line each, and no section."""
    page = page_of_many(plant, monkeypatch, "good", 60)
    assert page.count("<tr>") == 61 and "<section" not in page


def test_tables_are_short_so_that_a_browser_skips_those_off_the_screen(
    plant, monkeypatch
):
    page = page_of_many(plant, monkeypatch, "dead", 230)
    tables = re.findall(r'<div class="scroll part"><table>.*?</table>', page, re.S)
    assert [table.count('<td class="name">') for table in tables] == [100, 100, 30]
    assert [table.count("<th>recording") for table in tables] == [1, 1, 1]
    names = [f"r{n}" for n in range(1, 231)]
    assert (
        re.findall('href="#(.*?)"', page)
        == re.findall('section id="(.*?)"', page)
        == names
    )
    assert "content-visibility: auto" in page


def luminance(colour):
    """Relative luminance as the guidelines for accessible web content define it."""
    digits = "".join(2 * c for c in colour[1:]) if len(colour) == 4 else colour[1:]
    values = np.array([int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)])
    linear = np.where(
        values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4
    )
    return linear @ [0.2126, 0.7152, 0.0722]


def contrast(colour, ground):
    bright, dim = sorted([luminance(colour), luminance(ground)], reverse=True)
    return (bright + 0.05) / (dim + 0.05)


@pytest.mark.parametrize("dark", [False, True])
def test_what_is_written_stands_out_from_the_page(report, dark):
    light, _, rest = report.partition(
        "@media screen and (prefers-color-scheme: dark) {"
    )
    sheet = rest.partition("\n*")[0] if dark else light
    colours = dict(re.findall(r"--(\w+): (#\w+);", sheet))
    page, line = colours.pop("page"), colours.pop("line")
    assert set(colours) == {"text", "small", "fault", "unclear", "healthy"}
    assert (luminance(page) < luminance(colours["text"])) == dark
    assert min(contrast(colour, page) for colour in colours.values()) >= 4.5
    assert contrast(line, page) > 1.3


def test_conditions_stand_in_the_order_of_the_model():
    rows = pd.DataFrame(
        {
            "condition": ["ball", "normal", "unheard", "ball"],
            "verdict": ["normal", "normal", "ball", "no verdict: speed 1 rpm"],
            "error": ["", "", "", "speed 1 rpm"],
        }
    )
    found = _accuracy(rows, ["normal", "inner", "ball"])
    assert found.columns.tolist() == ["normal", "ball"] and found.to_numpy().sum() == 3
    assert found.index.tolist() == ["normal", "ball", "unheard"]
