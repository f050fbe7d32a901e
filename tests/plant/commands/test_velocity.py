"""RMS of the velocity, from a function and in results."""

import json

import numpy as np
import pytest

from skarxlag.plant.commands.velocity import velocity_rms

RATE = 4000
TIME = np.arange(2 * RATE) / RATE


def tones(*frequencies):
    """Sum of sines with the amplitude 1."""
    return sum(np.sin(2 * np.pi * frequency * TIME) for frequency in frequencies)


@pytest.mark.parametrize(
    ("unit", "frequencies", "expected"),
    [
        ("mm/s", (50,), np.sqrt(1 / 2)),
        ("m/s", (50, 80), 1000.0),
        ("mm/s2", (50,), np.sqrt(1 / 2) / (100 * np.pi)),
        ("m/s2", (50,), 1000 * np.sqrt(1 / 2) / (100 * np.pi)),
        ("g", (200,), 9806.65 * np.sqrt(1 / 2) / (400 * np.pi)),
        # Frequencies outside the band of the standard do not count.
        ("mm/s", (5, 50, 1500), np.sqrt(1 / 2)),
    ],
)
def test_tones_have_the_velocity_of_their_integral(unit, frequencies, expected):
    signal = 3.0 + tones(*frequencies)
    assert velocity_rms(signal, RATE, unit) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("n_samples", "rate", "unit"),
    [
        (8000, 4000, "V"),
        (8000, 4000, None),
        (8000, None, "g"),
        (8000, 1999, "g"),
        (1999, 4000, "g"),
    ],
)
def test_what_is_not_known_has_no_velocity(n_samples, rate, unit):
    assert velocity_rms(np.ones(n_samples), rate, unit) is None


@pytest.fixture
def recordings(tmp_path):
    """Write recordings of which two state a unit, and return their folder."""
    rng = np.random.default_rng(0)
    for name, unit in (("good", "m/s^2"), ("other", "m/s2"), ("plain", "")):
        signal = tones(50) + 0.1 * rng.normal(size=len(TIME))
        rows = (f"{t:.7f};{y:.6f}\n" for t, y in zip(TIME, signal, strict=True))
        (tmp_path / f"{name}.csv").write_text(f"time;x\ns;{unit}\n" + "".join(rows))
    return tmp_path


def test_velocity_needs_the_unit_of_the_file_and_no_model(run, recordings, tmp_path):
    output = tmp_path / "out.json"
    files = [recordings / "good.csv", recordings / "plain.csv"]
    bearing = ("--bearing", "6205", "--rpm", 900)
    assert run("diagnose", *bearing, *files, "-o", output, "-q")[0] == 0
    with_unit, without = json.loads(output.read_text())["recordings"]
    assert with_unit["velocity_rms_mm_s"] == pytest.approx(2.25, rel=0.02)
    assert without["velocity_rms_mm_s"] is None


def test_results_state_the_velocity_if_the_unit_is_known(run, recordings, tmp_path):
    model, output = tmp_path / "model.skops", tmp_path / "out.json"
    for names, states_velocity in ((("good", "other"), True), (("plain",), False)):
        files = [tmp_path / f"{name}.csv" for name in names]
        (tmp_path / "table.txt.csv").write_text(
            f"path,condition\n{files[0].name},good\n"
        )
        fit = ("fit", tmp_path / "table.txt.csv", "-o", model, "--window-length", 400)
        assert run(*fit, "-q")[0] == 0
        assert run("diagnose", model, *files, "-o", output, "-q")[0] == 0
        for row in json.loads(output.read_text())["recordings"]:
            assert ("velocity_rms_mm_s" in row) == states_velocity
            if states_velocity:
                assert row["velocity_rms_mm_s"] == pytest.approx(2.25, rel=0.02)
