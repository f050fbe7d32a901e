import re
import sys

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import (
    __version__,
    make_diagnoser,
    make_windows,
    save_diagnoser,
)
from skarxlag.plant.commands import main
from skarxlag.plant.pages import report
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
    arguments = ["diagnose", plant / "m.skops", *chosen, "-o", output, "-q", "--force"]
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
    assert "hall: north & south" in text and "<b>.npy" in text
    assert "6 of 30 windows carry no signal (constant: 6)." in text
    assert "lost.npy no verdict: no such file" in text
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
    expected = ["Signal", "Envelope spectrum", "Spectrum"]
    assert captions(shown["worn.npy"]) == expected
    # A sensor without a signal has no spectrum, and a lost file no signal.
    assert captions(shown["dead.npy"]) == ["Signal"]
    assert "Spectra: the signal is constant." in shown["dead.npy"]
    assert captions(shown["lost.npy"]) == []
    assert "2x shaft" in pictures(shown["worn.npy"])["Envelope spectrum"]


def test_a_long_recording_makes_no_longer_page(plant):
    """Curves have at most 600 points; a recording takes some 300 kB."""
    np.save(plant / "long.npy", np.tile(signal("worn", 4), 30))
    page = diagnosed(plant, plant / "long.npy", "--rpm", "300", "--bearing", "6205")
    assert len(page.encode()) < 500_000


def test_the_most_severe_recordings_are_drawn(plant, monkeypatch):
    monkeypatch.setattr(report, "MOST_DRAWN", 1)
    page = diagnosed(plant)
    assert [len(captions(part)) for part in sections(page).values()] == [3, 0, 0]
    assert "Figures of the first 1 recordings only." in page


def test_a_report_needs_jinja2(run, plant, monkeypatch):
    monkeypatch.setitem(sys.modules, "jinja2", None)
    output = plant / "no.html"
    code, _, err = run("diagnose", plant / "m.skops", plant / "good.npy", "-o", output)
    assert code == 1
    assert "a report needs jinja2: pip install 'skarxlag[io]'" in err
    # It is missed before anything is read.
    assert "good.npy" not in err
