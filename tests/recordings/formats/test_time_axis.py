"""Sampling rates that a channel of times states."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from skarxlag import read_recording
from skarxlag.recordings.files import recording_blocks, recording_start

N = 600
Y = np.random.default_rng(0).normal(size=N)


def write(tmp_path, times, name="time", suffix="csv"):
    path = tmp_path / f"run.{suffix}"
    frame = pd.DataFrame({name: times, "y": Y[: len(times)]})
    if suffix == "parquet":
        frame.to_parquet(path)
    elif suffix == "npz":
        np.savez(path, **{name: frame[name].to_numpy(), "y": frame["y"].to_numpy()})
    elif suffix == "mat":
        savemat(path, {name: frame[name].to_numpy(), "y": frame["y"].to_numpy()})
    else:
        frame.to_csv(path, index=False)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz", "mat"])
@pytest.mark.parametrize("rate", [25_600, 20_000, 51_200, 97_656.25, 12.5])
def test_rate(tmp_path, suffix, rate):
    path = write(tmp_path, np.arange(N) / rate + 3, suffix=suffix)
    signal, stated = read_recording(path)
    np.testing.assert_allclose(signal, Y, rtol=1e-13)
    assert stated == pytest.approx(rate, rel=1e-5)
    blocks, rates = zip(*recording_blocks(path, 70), strict=True)
    np.testing.assert_allclose(np.concatenate(blocks), Y, rtol=1e-13)
    assert set(rates) == {stated}


@pytest.mark.parametrize("name", ["t", "Time", "TIMESTAMP", "time (s)", "Zeit [s]", "seconds"])
def test_names_of_times(tmp_path, name):
    assert read_recording(write(tmp_path, np.arange(N) / 8000, name))[1] == 8000


@pytest.mark.parametrize(("unit", "scale"), [("ms", 1e3), ("µs", 1e6), ("us", 1e6), ("ns", 1e9)])
def test_units_of_times(tmp_path, unit, scale):
    path = write(tmp_path, np.arange(N) / 8000 * scale, f"time ({unit})")
    assert read_recording(path)[1] == 8000


def test_rounded_times(tmp_path):
    """Steps of 0.1 ms are printed with three decimals: ten times are equal, then one leaps."""
    path = write(tmp_path, np.round(np.arange(N) / 10_000, 3))
    assert read_recording(path)[1] == pytest.approx(10_000, rel=0.02)


@pytest.mark.parametrize("rounding", [np.floor, np.round, np.ceil])
@pytest.mark.parametrize(("n", "rate", "step"), [(2000, 1000, 0.01), (60_000, 20_000, 1.0)])
def test_coarse_times(tmp_path, rounding, n, rate, step):
    """2000 times in steps of 10 ms give 1999 / 1.99 s = 1004.52 Hz from end to end."""
    times = rounding(np.arange(n) / rate / step) * step
    np.savez(tmp_path / "run.npz", time=times, y=np.zeros(n))
    assert read_recording(tmp_path / "run.npz", channel="y")[1] == rate


def test_times_that_are_too_coarse(tmp_path):
    np.savez(tmp_path / "run.npz", time=np.arange(5000) // 4000 + 0.5, y=np.zeros(5000))
    assert read_recording(tmp_path / "run.npz", channel="y")[1] is None


@pytest.mark.parametrize(
    "form",
    [
        "%d.%m.%Y %H:%M:%S,%f",
        "%d/%m/%Y %H:%M:%S.%f",
        "%d.%m.%YT%H:%M:%S.%f",
        "%d.%m.%y %H:%M:%S,%f",
    ],
)
def test_dates_with_the_day_first(tmp_path, form):
    times = pd.Timestamp("2026-02-03 23:59:59.5") + pd.to_timedelta(np.arange(N) * 40, unit="us")
    lines = [f"{time:{form}};{y}" for time, y in zip(times, Y, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join(["Datum;y", *lines]))
    assert read_recording(tmp_path / "run.csv")[1] == 25_000
    assert recording_start(tmp_path / "run.csv") == times[0].timestamp()


@pytest.mark.parametrize("names", ["Date;Time;y", "Zeit;Datum;y"])
@pytest.mark.parametrize("form", ["%d.%m.%y", "%Y-%m-%d"])
def test_dates_and_times_of_day_in_two_columns(tmp_path, names, form):
    times = pd.Timestamp("2026-02-03 23:59:59.99") + pd.to_timedelta(np.arange(N) * 40, unit="us")
    parts = {"Date": form, "Datum": form, "Time": "%H:%M:%S.%f", "Zeit": "%H:%M:%S,%f"}
    first, second, _ = names.split(";")
    rows = zip(times, Y, strict=True)
    lines = [f"{time:{parts[first]}};{time:{parts[second]}};{y}" for time, y in rows]
    (tmp_path / "run.csv").write_text("\n".join([names, *lines]))
    signal, rate = read_recording(tmp_path / "run.csv")
    np.testing.assert_allclose(signal, Y, rtol=1e-13)
    assert rate == 25_000
    assert recording_start(tmp_path / "run.csv") == times[0].timestamp()


def test_whole_dates_and_seconds_in_two_columns_stay_apart(tmp_path):
    dates = pd.Timestamp("2026-02-03") + pd.to_timedelta(np.arange(N) * 40, unit="us")
    seconds = np.arange(N) * 4e-5
    columns = {"date": dates.strftime("%Y-%m-%dT%H:%M:%S.%f"), "time": seconds, "y": Y}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    assert read_recording(tmp_path / "run.csv", channel="y")[1] == 25_000
    np.testing.assert_allclose(read_recording(tmp_path / "run.csv", channel="time")[0], seconds)


def test_dates(tmp_path):
    times = pd.Timestamp("2026-01-01") + pd.to_timedelta(np.arange(N) * 40, unit="us")
    assert read_recording(write(tmp_path, times, suffix="parquet"))[1] == 25_000


@pytest.mark.parametrize(
    "times",
    [
        np.arange(N),  # a number of the sample
        np.arange(N, dtype=float),
        np.arange(0, 40 * N, 40),  # integers of an unknown unit
        Y,  # t may be a torque
        np.zeros(N),
    ],
)
def test_what_is_no_time(tmp_path, times):
    assert read_recording(write(tmp_path, times, "t", "npz"), channel="y")[1] is None


@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet"])
@pytest.mark.parametrize("at", [1, 250, N - 1])
def test_a_gap_is_refused(tmp_path, suffix, at):
    times = np.arange(N) / 1000
    times[at:] += 0.005
    path = write(tmp_path, times, suffix=suffix)
    for n_samples in (None, 50):
        with pytest.raises(ValueError, match=rf"'time' is not evenly spaced: 0.006 s .* {at}, "):
            list(recording_blocks(path, n_samples))


def test_jitter_is_none(tmp_path):
    times = (np.arange(N) + np.random.default_rng(0).uniform(-0.2, 0.2, N)) / 1000
    assert read_recording(write(tmp_path, times))[1] == pytest.approx(1000, rel=1e-3)


def test_a_rate_in_the_file_comes_before_the_times(tmp_path):
    np.savez(tmp_path / "run.npz", time=np.arange(N) / 1000, y=Y, fs=2000)
    assert read_recording(tmp_path / "run.npz", channel="y")[1] == 2000


def test_times_of_another_length_belong_to_other_channels(tmp_path):
    np.savez(tmp_path / "run.npz", t=np.arange(N // 2) / 1000, y=Y)
    assert read_recording(tmp_path / "run.npz")[1] is None
