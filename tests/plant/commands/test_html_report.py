import re
import sys

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import (
    __version__,
    make_diagnoser,
    make_windows,
    save_diagnoser,
)
from skarxlag.plant.commands import main, results
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.pages import report
from skarxlag.plant.pages.report import stated_conditions
from skarxlag.plant.readers.listing import list_files
from tests.plant.commands.pages import Document, captions, pictures, text_of

WINDOW, RATE = 400, 8_000.0


def signal(condition, seed, n_windows=30):
    noise = np.random.default_rng(seed).normal(size=n_windows * WINDOW)
    return lfilter([1.0], {"good": [1.0], "worn": [1.0, -0.9]}[condition], noise)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plant")
    conditions = ("good", "worn")
    X = [make_windows(signal(condition, 0, 99), WINDOW) for condition in conditions]
    diagnoser = make_diagnoser(healthy="good")
    diagnoser.fit(np.concatenate(X), np.repeat(conditions, 99))
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


def diagnosed(plant, *recordings):
    """The report of some recordings, or of the table."""
    output = plant / "report.html"
    chosen = recordings or ("--table", plant / "table.csv")
    arguments = ["diagnose", plant / "m.skops", *chosen, "-o", output, "-q"]
    main([str(argument) for argument in arguments])
    return output.read_text()


@pytest.fixture(scope="module")
def report_page(plant):
    return diagnosed(plant)


def test_the_report_is_one_file_that_asks_for_nothing(report_page):
    loads = Document(report_page).loads
    assert all(load.startswith(("#r", "data:image/svg+xml;base64,")) for load in loads)
    assert not any(part in report_page for part in ("http", "<script", "@import"))
    assert 'name="viewport"' in report_page and "@media print" in report_page


def test_the_report_says_what_the_table_says_and_what_came_of_it(report_page):
    text = text_of(report_page)
    assert "Diagnosis of 5 recordings" in text
    assert "1 worn 1 no signal 1 no verdict 2 good" in text
    # The dead sensor has no verdict, and <b> is good although worn is stated.
    assert "2 of 4 verdicts agree with the stated condition" in text
    assert "hall: north & south" in text and "<b>.npy" in text
    assert "6 of 30 windows carry no signal (constant: 6)." in text
    assert (
        "lost.npy no verdict: no such file" in text and "Without a verdict: 1." in text
    )
    assert "Healthy: good" in text and f"skarxlag {__version__}" in text
    assert re.search(r"\d{4}-\d\d-\d\d, skarxlag", text) and "300 rpm" in text


def sections(page):
    """Sections of a page by the name of their recording."""
    parts = re.findall(r"<section.*?</section>", page, re.S)
    return {re.search("<h3>(.*?)</h3>", part)[1]: part for part in parts}


def test_recordings_are_ranked_by_severity(report_page):
    overview = report_page.partition("<h2>Details")[0]
    order = ["worn.npy", "dead.npy", "lost.npy", "good.npy", "&lt;b&gt;.npy"]
    names = re.findall(r'<td class="name">(?:<a href="#r\d">)?([^<]*\.npy)', overview)
    assert names == list(sections(report_page)) == order


def test_figures_show_what_the_verdict_rests_on(report_page):
    shown = sections(report_page)
    assert captions(shown["worn.npy"]) == [
        "Signal", "Windows over time", "Envelope spectrum", "Spectrum of low frequencies",
        "Spectrum",
    ]  # fmt: skip
    # A sensor without a signal has no spectrum, and a lost file no signal.
    assert captions(shown["dead.npy"]) == ["Signal", "Windows over time"]
    assert "Spectra: the signal is constant." in shown["dead.npy"]
    assert captions(shown["lost.npy"]) == []
    for text in (
        "autoregressive model of the recording itself",
        "worn: 24 of 30 windows",
        "no signal: 6 of 30 windows",
        "stated healthy: 1 recording at 300 rpm",
        "Highest peaks: ",
    ):
        assert text in shown["worn.npy"]
    drawn = pictures(shown["worn.npy"])
    assert "2x shaft" in drawn["Envelope spectrum"]
    for line in ("1x shaft", "3x shaft", "50 Hz mains"):
        assert line in drawn["Spectrum of low frequencies"]


def test_a_bearing_marks_the_lines_of_its_faults(plant):
    page = diagnosed(plant, plant / "worn.npy", "--rpm", "300", "--bearing", "6205")
    drawn = pictures(page)["Envelope spectrum and lines of bearing 6205"]
    assert all(name in drawn for name in ("BPFO", "BPFI", "2 BSF", "1x shaft"))


def test_each_figure_has_a_text_for_those_who_cannot_see_it(report_page):
    texts = re.findall(r'<img src="[^"]+" alt="([^"]+)"', report_page)
    assert len(texts) == report_page.count("<figure>") > 0
    assert all(text.endswith(".") for text in texts)


def test_a_long_recording_makes_no_longer_page(plant):
    """Curves have at most 600 points; a recording takes some 300 kB."""
    np.save(plant / "long.npy", np.tile(signal("worn", 4), 200))
    page = diagnosed(plant, plant / "long.npy", "--rpm", "300", "--bearing", "6205")
    assert len(page.encode()) < 500_000


def test_the_most_severe_recordings_are_drawn(plant, monkeypatch):
    monkeypatch.setattr(report, "MOST_DRAWN", 1)
    page = diagnosed(plant)
    assert [len(captions(part)) for part in sections(page).values()] == [5, 0, 0]
    assert "Figures of the first 1 recordings only." in page


def test_a_report_needs_jinja2(run, plant, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    output = plant / "no.html"
    code, _, err = run("diagnose", plant / "m.skops", plant / "good.npy", "-o", output)
    assert code == 1
    assert "a report needs jinja2: pip install 'skarxlag[io]'" in err
    # It is missed before anything is read.
    assert "good.npy" not in err


def page_of_many(plant, monkeypatch, name, n):
    """The report of n recordings that all have the diagnosis of one."""
    monkeypatch.setattr(report, "MOST_DRAWN", 0)
    model, recordings = SavedModel(plant / "m.skops"), list_files(plant / f"{name}.npy")
    found = [diagnose_file(recordings[0], model.load)] * n
    rows = results.recording_rows(recordings * n, found, model)
    return report.html_report(model, recordings * n, found, rows)


def test_many_recordings_are_a_short_page(plant, monkeypatch):
    """60 healthy recordings have a line each, and no section."""
    page = page_of_many(plant, monkeypatch, "good", 60)
    assert page.count("<tr>") == 61 and "<section" not in page


def test_tables_are_short_so_that_a_browser_skips_those_off_the_screen(
    plant, monkeypatch
):
    page = page_of_many(plant, monkeypatch, "dead", 230)
    tables = re.findall(r'<div class="scroll part".*?</table>', page, re.S)
    assert [table.count('<td class="name">') for table in tables] == [100, 100, 30]
    assert [table.count("<th>recording") for table in tables] == [1, 1, 1]
    names = [f"r{n}" for n in range(1, 231)]
    assert re.findall('href="#(.*?)"', page) == names
    assert re.findall('section id="(.*?)"', page) == names
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
def test_what_is_written_stands_out_from_the_page(report_page, dark):
    light, _, rest = report_page.partition(
        "@media screen and (prefers-color-scheme: dark) {"
    )
    sheet = rest.partition("\n*")[0] if dark else light
    colours = dict(re.findall(r"--(\w+): (#\w+);", sheet))
    page, line = colours.pop("page"), colours.pop("line")
    assert {"text", "small", "fault", "unclear", "healthy", "signal"} <= set(colours)
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
    found = stated_conditions(rows, ["normal", "inner", "ball"])
    assert found.columns.tolist() == ["normal", "ball"] and found.to_numpy().sum() == 3
    assert found.index.tolist() == ["normal", "ball", "unheard"]


def test_without_healthy_recordings_a_spectrum_is_drawn_alone(plant):
    alone = diagnosed(plant, plant / "worn.npy")
    assert "healthy: " not in "".join(sections(alone).values())
    together = diagnosed(plant, plant / "worn.npy", plant / "good.npy")
    shown = [*sections(together).values()]
    assert "healthy by verdict: 1 recording" in shown[0]
    # The only healthy recording is not compared with itself.
    assert "healthy by verdict" not in shown[1]


def test_a_file_of_several_channels_is_drawn_by_that_of_the_model(run, plant):
    """The model stores the name of its channel, so users need not state it again."""
    noise = signal("good", 8)
    for name in ("one", "two"):
        np.savez(plant / f"{name}.npz", acc=noise, current=noise[::-1], fs=RATE)
    (plant / "named.csv").write_text("path,condition,channel\none.npz,good,acc\n")
    model = plant / "named.skops"
    fit = ("fit", plant / "named.csv", "-o", model, "--window-length", WINDOW, "-q")
    assert run(*fit)[0] == 0
    output = plant / "named.html"
    assert run("diagnose", model, plant / "two.npz", "-o", output, "-q")[0] == 0
    assert captions(output.read_text())[0] == "Signal"
