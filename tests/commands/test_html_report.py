import os
import re
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_diagnoser, make_windows, save_diagnoser
from skarxlag.commands import html_style, main, recording_task
from skarxlag.commands.html_report import _accuracy
from skarxlag.commands.models import load_model
from skarxlag.commands.names import below_common_folder
from skarxlag.commands.spectrum_view import SpectrumView
from skarxlag.kernels.spectra import cepstrum
from skarxlag.verdicts import window_verdicts

WINDOW, RATE = 400, 8_000.0


def signal(condition, seed, n_windows=30):
    noise = np.random.default_rng(seed).normal(size=n_windows * WINDOW)
    return lfilter([1.0], {"good": [1.0], "worn": [1.0, -0.9]}[condition], noise)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plant")
    X = np.concatenate([make_windows(signal(c, 0), WINDOW) for c in ("good", "worn")])
    diagnoser = make_diagnoser(healthy="good").fit(X, np.repeat(["good", "worn"], 30))
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
    (folder / "table.csv").write_text("\n".join([*lines, f"lost.npy,worn,300,{RATE},x"]))
    return folder


class Document(HTMLParser):
    """Texts, attributes that load something, and whether all elements are closed."""

    def __init__(self, content):
        super().__init__()
        self.texts, self.loads, self.open = [], [], []
        self.feed(content)

    def handle_starttag(self, tag, attributes):
        self.loads += [value for name, value in attributes if name in ("src", "href")]
        if tag not in ("meta", "rect", "path", "polyline"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture(scope="module")
def report(plant):
    output = plant / "report.html"
    arguments = ["diagnose", plant / "m.skops", "--table", plant / "table.csv", "-o", output, "-q"]
    assert main([str(each) for each in arguments]) == 1
    return output.read_text()


def test_the_report_is_one_file_that_asks_for_nothing(report):
    document = Document(report)
    assert not document.open
    assert all(load.startswith("#r") for load in document.loads)
    assert "http" not in report and "<script" not in report and "@import" not in report
    assert 'name="viewport"' in report and "@media print" in report


def test_the_report_says_what_the_table_says_and_what_came_of_it(report):
    text = " ".join(" ".join(Document(report).texts).split())
    assert "Diagnosis of 5 recordings" in text
    assert "2 good" in text and "1 worn" in text and "1 no signal" in text and "1 failed" in text
    # The dead sensor has no verdict, and <b> is good although worn is stated.
    assert "2 of 3 verdicts (66.7 %) are the stated condition" in text
    assert "hall: north & south" in text and "<b>.npy" in text
    assert "6 of 30 windows carry no signal (constant: 6)" in text
    assert "lost.npy: no such file" in text
    assert "12 s" not in text and "1.5 s" in text and "4 kHz" in text


def test_the_timeline_shows_each_window(report):
    section = re.search(r'<section id="r1">.*?</section>', report, re.S).group()
    bars = re.findall(r'y="([\d.]+)" width="[\d.]+" height="([\d.]+)" class="(\w+)"', section)
    verdicts = [kind for y, _, kind in bars if y == "4.0"]
    assert len(verdicts) == 30 and verdicts[:6] == ["quiet"] * 6
    assert set(verdicts[6:]) == {"k1"}
    assert sum(y == "98.0" for y, _, _ in bars) == 6
    assert section.count("<polyline") == 3


def luminance(colour):
    """Relative luminance as the guidelines for accessible web content define it."""
    digits = "".join(2 * c for c in colour[1:]) if len(colour) == 4 else colour[1:]
    values = np.array([int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4)])
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def contrast(colour, ground):
    bright, dim = sorted([luminance(colour), luminance(ground)], reverse=True)
    return (bright + 0.05) / (dim + 0.05)


@pytest.mark.parametrize("dark", [False, True])
def test_what_is_drawn_stands_out_from_the_page(dark):
    # From the sheet, not from the constants that it is made of.
    light, _, rest = html_style.STYLE.partition("@media screen and (prefers-color-scheme: dark) {")
    sheet = rest.partition("\n}\n")[0] if dark else light
    page, line, hit, text, small = re.search(
        r"--page: (\S+); --line: (\S+); --hit: (\S+); --text: (\S+); --small: (\S+);", sheet
    ).groups()
    assert (luminance(page) < luminance(text)) == dark
    colours = dict(re.findall(r"\.(\w+) { --c: (\S+); }", sheet))
    assert len(colours) == 14
    assert min(contrast(colour, page) for colour in colours.values()) >= 3
    assert min(contrast(text, page), contrast(text, hit), contrast(small, page)) >= 4.5
    assert contrast(line, page) > 1.3


def test_every_class_of_the_charts_has_a_colour(report):
    drawn = set(re.findall(r'<(?:rect|polyline)[^>]* class="(\w+)"', report))
    drawn |= set(re.findall(r'<span class="mark (\w+)"', report))
    assert {"k0", "k1", "quiet", "ink", "sure", "soft"} <= drawn
    assert drawn <= set(re.findall(r"\.(\w+) { --c:", report))
    assert not re.search(r'(fill|stroke)="#', report)


def test_a_common_folder_is_told_once(plant, capsys):
    paths = [plant / "good.npy", plant / "worn.npy"]
    for output in ("named.html", "named.csv"):
        arguments = ["diagnose", plant / "m.skops", *paths, "-o", plant / output, "-q"]
        assert main([str(each) for each in arguments]) == 0
    shown = capsys.readouterr().out
    assert f"Recordings below {plant}{os.sep}\n" in shown and "\ngood.npy " in shown
    page = (plant / "named.html").read_text()
    assert page.count(f"{plant}{os.sep}") == 1 + page.count(str(plant / "m.skops"))
    assert ">good.npy</h3>" in page and '">worn.npy</a>' in page
    assert pd.read_csv(plant / "named.csv")["recording"].tolist() == [str(each) for each in paths]


@pytest.mark.parametrize(
    ("names", "folder"),
    [
        ([], ""),
        (["runs/a.npy"], ""),
        (["runs/a.npy", "a.npy"], ""),
        (["./a.npy", "./b.npy"], ""),
        (["runs/a.npy", "runs/a.npy"], "runs/"),
        (["runs/1/a.npy", "runs/10/a.npy"], "runs/"),
        (["r/x/a", "r/x/y/a"], "r/x/"),
        (["C:\\data\\a.npy", "C:\\data\\b.npy"], "C:\\data\\"),
        (["s3://b/a", "s3://c/a"], "s3://"),
    ],
)
def test_the_common_folder_is_of_whole_parts(names, folder):
    found, rest = below_common_folder(iter(names))
    assert found == folder and [folder + name for name in rest] == names


def test_the_spectrum_lies_on_the_reference_of_its_condition(plant):
    model = load_model(plant / "m.skops")
    X = make_windows(signal("worn", 9), WINDOW)
    view = SpectrumView(model)
    verdicts = window_verdicts(model.diagnoser, X, model.conditions)
    view.add(X[:10], np.arange(10))
    rest = np.delete(np.arange(30), np.r_[:10, 13])
    view.add(X[rest], rest)
    drawn = view.drawn(verdicts, model.conditions)
    assert list(drawn["references"]) == ["worn", "good"] and drawn["place"] != 13
    curves = np.array([drawn["window"], *drawn["references"].values()])
    distances = np.abs(curves[0] - curves[1:]).mean(axis=1)
    assert distances[0] < distances[1] / 2
    # The reference is the mean over the training windows, which the innovations' spectrum is.
    training = make_windows(signal("worn", 0), WINDOW)
    mean = cepstrum(model.diagnoser[:2].transform(training)[:, 0]).mean(axis=0)
    orders = np.arange(1, len(mean) + 1)[:, np.newaxis]
    expected = 10 / np.log(10) * mean @ np.cos(orders * 2 * np.pi * np.array(drawn["frequency"]))
    np.testing.assert_allclose(curves[1], expected, atol=0.006)


def test_the_first_windows_that_carry_a_signal_are_drawn_in_their_places(plant, monkeypatch):
    class OneBlockAfterAnother:
        name, rpm = "worn", None

        def blocks(self, n_samples):
            yield from ((part, RATE) for part in np.split(np.load(plant / "worn.npy"), 10))

    seen = {}
    monkeypatch.setattr(
        SpectrumView, "add", lambda self, X, at: seen.update(zip(at, X, strict=True))
    )
    monkeypatch.setattr(recording_task, "_MOST_DRAWN", 8)
    recording_task.cancelled.clear()
    recording_task.diagnose_recording(
        OneBlockAfterAnother(), load_model(plant / "m.skops"), draw=True
    )
    # Six windows are constant, and the next eight are taken.
    windows = make_windows(np.load(plant / "worn.npy"), WINDOW)
    assert list(seen) == list(range(6, 14))
    np.testing.assert_array_equal(list(seen.values()), windows[6:14])


def test_conditions_stand_in_the_order_of_the_model():
    rows = pd.DataFrame(
        {"condition": ["ball", "normal", "unheard"], "verdict": ["normal", "normal", "ball"]}
    )
    texts = Document(_accuracy(rows, ["normal", "inner", "ball", "no signal"])).texts
    names = [text for text in texts if text in ("normal", "ball", "unheard")]
    assert names == ["normal", "ball", "normal", "ball", "unheard"]
