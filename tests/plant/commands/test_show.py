"""Pages of ``skarxlag show``: views of recordings without a diagnosis."""

import re

import numpy as np
import pytest

from tests.plant.commands.pages import Document, captions, pictures

RATE = 12_000
#: Order of the inner race of a bearing 6205.
INNER = 5.415
WITH_BEARING = "Envelope spectrum and lines of bearing 6205"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Recordings: of a fault of the inner race at 900 rpm, healthy, and odd ones."""
    folder = tmp_path_factory.mktemp("recordings")
    rng = np.random.default_rng(0)
    noise = rng.normal(size=4 * RATE)
    faulty = noise.copy()
    faulty[(np.arange(1, 320) * RATE * 60 / (900 * INNER)).astype(int)] += 10
    signals = {
        "inner": faulty,
        "healthy": noise,
        "<i>odd": noise,
        "constant": np.full(5000, 3.0),
        "short": noise[:12],
        "huge": 1e300 * noise,
        "tiny": 1e-300 * noise,
    }
    for name, signal in signals.items():
        np.savez(folder / f"{name}.npz", signal=signal, fs=RATE)
    np.save(folder / "unstated.npy", noise)
    np.savez(folder / "nan.npz", signal=np.append(noise, np.nan), fs=RATE)
    (folder / "accelerometer.csv").write_text(
        "time;a\ns;m/s^2\n"
        + "".join(
            f"{n / RATE:.7f};{np.sin(2 * np.pi * 50 * n / RATE):.6f}\n"
            for n in range(RATE)
        )
    )
    return folder


@pytest.fixture
def page_of(run, folder, tmp_path):
    """Return the page of some recordings, and the exit status."""

    def show(*names, options=()):
        output = tmp_path / "page.html"
        paths = [folder / name for name in names]
        code, _, err = run("show", *paths, *options, "-o", output)
        assert output.is_file(), err
        return output.read_text(), code

    return show


def test_the_command_of_the_guide_draws_three_views(run, folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments = ("--bearing", "6205", "--rpm", 900)
    code, out, _ = run("show", folder / "inner.npz", *arguments)
    assert code == 0 and out == "Written: inner.html\n"
    page = (tmp_path / "inner.html").read_text()
    assert captions(page) == ["Signal", WITH_BEARING, "Spectrum"]
    assert all(load.startswith("data:") for load in Document(page).loads)
    assert "4 s at 12000 Hz; 900 rpm" in page and "<h1>" in page
    assert not re.search("http|<script|@import", page)
    assert run("show", folder / "inner.npz", *arguments)[0] == 2


def test_lines_of_the_bearing_and_the_shaft_are_marked(page_of):
    page, _ = page_of("inner.npz", options=("--bearing", "6205", "--rpm", 900))
    assert re.search(r"mpacts at 5\.4[12] orders \(BPFI\), the inner race", page)
    drawn = pictures(page)[WITH_BEARING]
    assert all(text in drawn for text in ("BPFO", "BPFI", "2x shaft"))
    page, _ = page_of("inner.npz", options=("--rpm", 900))
    drawn = pictures(page)["Envelope spectrum"]
    assert "Order of the shaft" in drawn and "2x shaft" in drawn


def test_a_picture_is_drawn_about_the_mean(page_of):
    assert "less the mean of 3." in page_of("constant.npz")[0]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("inner.npz", "The speed is not known (--rpm)."),
        ("unstated.npy", "Time (samples)"),
        ("constant.npz", "Spectra: the signal is constant."),
        ("short.npz", "Spectra: 12 samples are too few."),
        ("huge.npz", "4 s at 12000 Hz"),
        ("tiny.npz", "4 s at 12000 Hz"),
        ("<i>odd.npz", "&lt;i&gt;odd.npz"),
    ],
)
def test_odd_recordings_are_drawn_as_far_as_they_go(page_of, name, text):
    page, code = page_of(name)
    assert code == 0 and text in (page + pictures(page)["Signal"])
    assert "<i>odd" not in page
    paths = re.findall(' d="(.*?)"', "".join(pictures(page).values()))
    assert not re.search(r"nan|inf\b", "".join(paths))


def test_a_sampling_rate_that_is_missing_is_asked_for(page_of):
    page, _ = page_of("unstated.npy", options=("--rpm", 900))
    assert "the sampling rate is not known; state it with --sampling-rate" in page


def test_the_velocity_is_stated_if_the_unit_is(page_of):
    """1 m/s^2 at 50 Hz are 2.25 mm/s RMS."""
    page, _ = page_of("accelerometer.csv")
    assert "velocity 2.25 mm/s RMS from 10 to 1000 Hz" in page
    drawn = pictures(page)
    assert "Signal (m/s^2)" in drawn["Signal"]
    assert "Power density (dB re 1 (m/s^2)²/Hz)" in drawn["Spectrum"]
    page, _ = page_of("healthy.npz")
    assert "velocity" not in page
    assert "Power density (dB)" in pictures(page)["Spectrum"]


def test_a_recording_that_cannot_be_read_does_not_hide_the_others(page_of, run, folder):
    page, code = page_of("nan.npz", "healthy.npz", "lost.npz")
    assert code == 1 and page.count("<section>") == 3
    assert captions(page).count("Spectrum") == 1
    assert "no such file" in page and "NaN" in page
    output = folder / "no.html"
    code, out, _ = run("show", folder / "lost.npz", "-o", output)
    assert code == 1 and out == "" and not output.exists()
