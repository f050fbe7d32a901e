"""Sampling rates that a channel of times states."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from skarxlag import read_recording
from skarxlag.recordings.files import recording_start
from tests.recordings.blocks import recording_blocks

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


@pytest.mark.parametrize(
    "name", ["t", "Time", "TIMESTAMP", "time (s)", "Zeit [s]", "seconds"]
)
def test_names_of_times(tmp_path, name):
    assert read_recording(write(tmp_path, np.arange(N) / 8000, name))[1] == 8000


@pytest.mark.parametrize(
    ("unit", "scale"), [("ms", 1e3), ("µs", 1e6), ("us", 1e6), ("ns", 1e9)]
)
def test_units_of_times(tmp_path, unit, scale):
    path = write(tmp_path, np.arange(N) / 8000 * scale, f"time ({unit})")
    assert read_recording(path)[1] == 8000


def test_rounded_times(tmp_path):
    """Steps of 0.1 ms are printed with three decimals: ten times are equal, then one leaps."""
    path = write(tmp_path, np.round(np.arange(N) / 10_000, 3))
    assert read_recording(path)[1] == pytest.approx(10_000, rel=0.02)


@pytest.mark.parametrize("rounding", [np.floor, np.round, np.ceil])
@pytest.mark.parametrize(
    ("n", "rate", "step"), [(2000, 1000, 0.01), (60_000, 20_000, 1.0)]
)
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
    times = pd.Timestamp("2026-02-03 23:59:59.5") + pd.to_timedelta(
        np.arange(N) * 40, unit="us"
    )
    lines = [f"{time:{form}};{y}" for time, y in zip(times, Y, strict=True)]
    (tmp_path / "run.csv").write_text("\n".join(["Datum;y", *lines]))
    assert read_recording(tmp_path / "run.csv")[1] == 25_000
    assert recording_start(tmp_path / "run.csv") == times[0].timestamp()


@pytest.mark.parametrize("names", ["Date;Time;y", "Zeit;Datum;y"])
@pytest.mark.parametrize("form", ["%d.%m.%y", "%Y-%m-%d"])
def test_dates_and_times_of_day_in_two_columns(tmp_path, names, form):
    times = pd.Timestamp("2026-02-03 23:59:59.99") + pd.to_timedelta(
        np.arange(N) * 40, unit="us"
    )
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
    np.testing.assert_allclose(
        read_recording(tmp_path / "run.csv", channel="time")[0], seconds
    )


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
        with pytest.raises(
            ValueError, match=rf"'time' is not evenly spaced: 0.006 s .* {at}, "
        ):
            list(recording_blocks(path, n_samples))


def test_jitter_is_none(tmp_path):
    times = (np.arange(N) + np.random.default_rng(0).uniform(-0.2, 0.2, N)) / 1000
    assert read_recording(write(tmp_path, times))[1] == pytest.approx(1000, rel=1e-3)


def test_a_rate_in_the_file_comes_before_the_times(tmp_path):
    path = tmp_path / "run.npz"
    np.savez(path, time=np.arange(N) / 1000, y=Y, fs=1001)
    assert read_recording(path, channel="y")[1] == 1001
    np.savez(path, time=np.arange(N) / 1000, y=Y, fs=2000)
    message = "the sampling rate is 2000 Hz, but its times 'time' state 1000 Hz"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="y")
    for rate in (1000.0, 2000.0):
        ((_, decided),) = recording_blocks(path, channel="y", stated_rate=rate)
        assert decided == rate
    with pytest.raises(ValueError, match=message):
        list(recording_blocks(path, channel="y", stated_rate=3000.0))
    np.savez(path, time=np.arange(N) / 1000 + np.repeat([0, 3], N // 2), y=Y, fs=1000)
    with pytest.raises(
        ValueError, match=r"not evenly spaced: 3\.001 s before sample 300"
    ):
        read_recording(path, channel="y")


BROKEN = {
    "jump back": lambda t: np.where(t < 0.4, t, t - 0.2),
    "restart": lambda t: t % 0.25,
    "descending": lambda t: 5 - t,
    "a gap": lambda t: np.where(t < 0.3, t, t + 60),
    "a gap of unknown times": lambda t: (
        np.where((t < 0.3) | (t > 0.35), t, np.nan) + (t > 0.3)
    ),
}


@pytest.mark.parametrize("broken", BROKEN)
@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet"])
@pytest.mark.parametrize("n_samples", [None, 70])
def test_broken_clocks_are_refused(tmp_path, broken, suffix, n_samples):
    """They were taken for no times, so that their gaps were not noticed."""
    path = write(tmp_path, BROKEN[broken](np.arange(N) / 1000), suffix=suffix)
    with pytest.raises(
        ValueError, match=r"'time' is not evenly spaced: .* expected 0.001 s"
    ):
        list(recording_blocks(path, n_samples, channel="y"))


@pytest.mark.parametrize("is_date", [False, True])
@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet"])
def test_unknown_times_follow_the_sample_before(tmp_path, suffix, is_date):
    times = np.arange(N) / 1000 + 1e9 * is_date
    times[[0, 7, 8, 9, 300, -1]] = np.nan
    if is_date:
        times = pd.to_datetime(pd.Series(times), unit="s").astype("datetime64[ns]")
    if is_date and suffix == "npz":
        pytest.skip("dates of an archive are no channel")
    path = write(tmp_path, times, suffix=suffix)
    for n_samples in (None, 50):
        blocks, rates = zip(*recording_blocks(path, n_samples), strict=True)
        np.testing.assert_allclose(np.concatenate(blocks), Y, rtol=1e-13)
        assert set(rates) == {1000.0}
    if is_date:
        assert recording_start(path) == pytest.approx(1e9, abs=1e-6)


def test_texts_among_times_are_unknown_times(tmp_path):
    times = [f"{t:.3f}" for t in np.arange(N) / 1000]
    times[3] = times[400] = "later"
    assert read_recording(write(tmp_path, times))[1] == 1000


@pytest.mark.parametrize("n_samples", [None, 999])
@pytest.mark.parametrize("at", [0, 20_000])
def test_a_rate_that_drifts_is_refused(tmp_path, n_samples, at):
    """Each step is right within the tolerance of a step."""
    n = 60_000
    rates = 1000 * np.append(np.ones(at), np.linspace(1, 1.3, n - at))
    np.savez(tmp_path / "run.npz", time=np.cumsum(1 / rates), y=np.zeros(n))
    with pytest.raises(
        ValueError, match=r"'time' is not evenly spaced: .* samples before sample"
    ):
        list(recording_blocks(tmp_path / "run.npz", n_samples, channel="y"))


def test_a_clock_that_is_wrong_by_a_share_is_no_drift(tmp_path):
    times = np.arange(60_000) / 1000 * np.where(np.arange(60_000) < 30_000, 1, 1.00001)
    np.savez(tmp_path / "run.npz", time=times, y=np.zeros(60_000))
    assert read_recording(tmp_path / "run.npz", channel="y")[1] == 1000


@pytest.mark.parametrize("unit", ["min", "h"])
def test_times_in_minutes_and_hours(tmp_path, unit):
    scale = {"min": 60, "h": 3600}[unit]
    path = write(tmp_path, np.arange(N) / 1000 / scale, f"time ({unit})")
    assert read_recording(path)[1] == pytest.approx(1000, rel=1e-3)


@pytest.mark.parametrize("n_samples", [None, 999])
def test_a_clock_that_stands_still(tmp_path, n_samples):
    """Its rate is not known. If another one is stated, ten seconds of equal times are too many."""
    path = tmp_path / "run.npz"
    np.savez(path, time=np.full(15_000, 7.5), y=np.zeros(15_000))
    assert read_recording(path)[1] is None
    assert len(read_recording(path)[0]) == 15_000
    blocks = recording_blocks(path, n_samples, stated_rate=1000.0)
    with pytest.raises(
        ValueError, match=r"'time' is not evenly .* take 0 s, expected 1.* at 1000"
    ):
        list(blocks)
    assert len(list(recording_blocks(path, stated_rate=2000.0))) == 1


def test_a_rate_that_is_stated_decides_between_two_of_the_file(tmp_path):
    path = tmp_path / "run.npz"
    np.savez(path, y=Y, fs=12e3, Fs=48e3)
    for rate in (12e3, 48e3):
        assert len(list(recording_blocks(path, stated_rate=rate))) == 1
    for rate in (None, 24e3):
        with pytest.raises(
            ValueError, match="several sampling rates: fs 12000 Hz, Fs 48000"
        ):
            list(recording_blocks(path, stated_rate=rate))


def test_times_of_another_length_belong_to_other_channels(tmp_path):
    np.savez(tmp_path / "run.npz", t=np.arange(N // 2) / 1000, y=Y)
    assert read_recording(tmp_path / "run.npz")[1] is None
