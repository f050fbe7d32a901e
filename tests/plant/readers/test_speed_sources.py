"""Shaft speeds that a tachometer or a log next to the recordings states."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from skarxlag import load_recordings
from skarxlag.plant.readers.listing import list_recordings

RATE, SECONDS = 1000, 4.0
TIME = np.arange(int(RATE * SECONDS)) / RATE
Y = np.random.default_rng(0).normal(size=len(TIME))


def pulses(rpm, pulses_per_revolution=1):
    angle = 2 * np.pi * pulses_per_revolution * rpm / 60 * TIME
    return (np.sin(angle) > 0.95).astype(float)


@pytest.fixture
def folder(tmp_path):
    for name, rpm in (("a", 600), ("b", 900)):
        np.savez(tmp_path / f"{name}.npz", y=Y, key=pulses(rpm, 2), fs=RATE)
    return tmp_path


def table(folder, *rows, columns="path,condition,channel,rpm"):
    (folder / "table.csv").write_text("\n".join([columns, *rows]))
    return folder / "table.csv"


@pytest.mark.parametrize("n_pulses", [2, 4])
def test_a_tacho_channel(folder, n_pulses):
    rows = [f"{name}.npz,{name},y,tacho:key,{n_pulses}" for name in "ab"]
    columns = "path,condition,channel,rpm,pulses_per_revolution"
    rig = load_recordings(table(folder, *rows, columns=columns), window_length=2000)
    assert rig.data.shape == (4, 2000)
    expected = np.repeat([600, 900], 2) * 2 / n_pulses
    np.testing.assert_allclose(rig.rpm, expected, rtol=5e-3)


def test_a_pulse_in_each_turn_is_the_default(folder):
    (entry,) = list_recordings(table(folder, "a.npz,a,y,tacho:k*"))
    assert entry.rpm is None and entry.with_speed().rpm == pytest.approx(1200, rel=5e-3)


def test_a_log_of_recordings(folder):
    log = "Recording;RPM;note\na.npz;601,5;x\nb;899;\nc;5;\n"
    (folder / "speeds.csv").write_text(log)
    rows = [f"{name}.npz,{name},y,speeds.csv" for name in "ab"]
    listed = list_recordings(table(folder, *rows))
    assert [entry.with_speed().rpm for entry in listed] == [601.5, 899]


@pytest.mark.parametrize("is_date", [False, True])
def test_a_log_over_time(folder, is_date):
    """Speeds of the seconds that the recording lasts count; it lasts 4 seconds."""
    start = datetime(2026, 11, 22, 7, tzinfo=UTC) + timedelta(seconds=10)

    def date(seconds):
        return (start + timedelta(seconds=seconds)).isoformat()

    lines = [f"{date(t)},{y}" for t, y in zip(TIME, Y, strict=True)]
    (folder / "run.csv").write_text("\n".join(["time,y", *lines]))
    log = [f"{date(s) if is_date else s},{900 + s}" for s in np.arange(-5.5, 8)]
    (folder / "speeds.csv").write_text("\n".join(["time,rpm", *log]))
    (entry,) = list_recordings(table(folder, "run.csv,a,y,speeds.csv"))
    assert entry.with_speed().rpm == 902


NO_SPEED = "speeds.csv: the log states no speed above 0"
COLUMNS = "speeds.csv: the columns are .* expected rpm, and"


@pytest.mark.parametrize(
    ("log", "message"),
    [
        (None, "No such file"),
        ("recording,speed\na,5\n", COLUMNS),
        ("rpm,load\n5,5\n", COLUMNS),
        ("recording,rpm\nb,5\n", NO_SPEED),
        ("recording,rpm\na,-5\n", NO_SPEED),
        ("recording,rpm\na,fast\n", NO_SPEED),
        ("time,rpm\n9.5,600\n", NO_SPEED),
        ("time,rpm\n2026-11-22,600\n", "does not state the date"),
        ("recording,rpm\na,1.797\nb,985\n", "1.797', which means 1797 or"),
        ("recording;rpm\na;1,797\n", "1,797', which means 1797 or"),
    ],
)
def test_errors_of_a_log_name_the_entry(folder, log, message):
    if log is not None:
        (folder / "speeds.csv").write_text(log)
    (entry,) = list_recordings(table(folder, "a.npz,a,y,speeds.csv"))
    message = rf"table.csv, line 2: .*{message}"
    with pytest.raises((ValueError, FileNotFoundError), match=message):
        entry.with_speed()


@pytest.mark.parametrize(
    ("rpm", "message"),
    [
        ("tacho:none", "no channel 'none'; available: 'y', 'key'"),
        ("tacho:fs", "no channel 'fs'"),
        ("speeds.txt", "rpm is 'speeds.txt', expected a positive number"),
    ],
)
def test_sources_that_are_none(folder, rpm, message):
    with pytest.raises(ValueError, match=rf"table.csv, line 2: .*{message}"):
        list_recordings(table(folder, f"a.npz,a,y,{rpm}"))[0].with_speed()


@pytest.mark.parametrize("other", ["112.125", "45.5", "0.875"])
def test_another_speed_of_a_log_shows_that_the_point_is_decimal(folder, other):
    (folder / "speeds.csv").write_text(f"recording,rpm\na,45.125\nb,{other}\n")
    (entry,) = list_recordings(table(folder, "a.npz,a,y,speeds.csv"))
    assert entry.with_speed().rpm == 45.125


@pytest.mark.parametrize(
    ("text", "message"), [("2.5", "not an integer"), ("0", "positive")]
)
def test_pulses_that_are_none(folder, text, message):
    columns = "path,condition,channel,rpm,pulses_per_revolution"
    with pytest.raises(
        ValueError, match=f"line 2: .*pulses_per_revolution is .*{message}"
    ):
        load_recordings(table(folder, f"a.npz,a,y,tacho:key,{text}", columns=columns))
