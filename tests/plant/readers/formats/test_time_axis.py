"""Sampling rates that a channel of times states."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from skarxlag import read_recording
from skarxlag.plant.readers.files import recording_start

from .reading import in_blocks

N = 600
Y = np.random.default_rng(0).normal(size=N)
MIDNIGHT = pd.Timestamp("2026-02-03 23:59:59.99")
DATES = MIDNIGHT + pd.to_timedelta(np.arange(N) * 40, unit="us")
EVEN = np.arange(N) / 1000


@pytest.fixture
def write(tmp_path):
    """Write times beside a signal, and return the path."""

    def write(times, name="time", suffix="csv", **numbers):
        path = tmp_path / f"run.{suffix}"
        signal = np.resize(Y, len(times))
        frame = pd.DataFrame({name: times, "y": signal})
        arrays = {name: frame[name].to_numpy(), "y": signal, **numbers}
        if suffix == "parquet":
            frame.to_parquet(path)
        elif suffix == "npz":
            np.savez(path, **arrays)
        elif suffix == "mat":
            savemat(path, arrays)
        else:
            frame.to_csv(path, index=False)
        return path

    return write


@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz", "mat"])
@pytest.mark.parametrize("rate", [20_000, 51_200, 97_656.25, 12.5])
def test_rate(write, suffix, rate):
    path = write(np.arange(N) / rate + 3, suffix=suffix)
    for n_samples in (None, 70):
        signal, stated, _ = in_blocks(path, n_samples)
        np.testing.assert_allclose(signal, Y, rtol=1e-13)
        assert stated == pytest.approx(rate, rel=1e-5)


NAMES = ["t", "Time", "TIMESTAMP", "time (s)", "Zeit [s]", "seconds"]
UNITS = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), 1.0),
    **{"ms": 1e3, "µs": 1e6, "μs": 1e6, "us": 1e6, "ns": 1e9},
    **dict.fromkeys(("min", "minute", "minutes"), 1 / 60),
    **dict.fromkeys(("h", "hours"), 1 / 3600),
}


@pytest.mark.parametrize(
    ("name", "scale"),
    [(name, 1.0) for name in NAMES]
    + [(f"time ({unit})", scale) for unit, scale in UNITS.items()],
)
def test_names_and_units_of_times(write, name, scale):
    path = write(np.arange(N) / 8000 * scale, name)
    assert read_recording(path)[1] == pytest.approx(8000, rel=1e-3 * (scale < 1))


def test_rounded_times(write):
    """Steps of 0.1 ms are printed with three decimals: ten times are equal, then one leaps."""
    path = write(np.round(np.arange(N) / 10_000, 3))
    assert read_recording(path)[1] == pytest.approx(10_000, rel=0.02)


@pytest.mark.parametrize("rounding", [np.floor, np.round, np.ceil])
@pytest.mark.parametrize(
    ("n", "rate", "step"), [(2000, 1000, 0.01), (100_000, 20_000, 1.0)]
)
def test_coarse_times(write, rounding, n, rate, step):
    """2000 times in steps of 10 ms give 1999 / 1.99 s = 1004.52 Hz from end to end."""
    path = write(rounding(np.arange(n) / rate / step) * step, suffix="npz")
    assert read_recording(path, channel="y")[1] == rate


DAY_FIRST = [
    *("%d.%m.%Y %H:%M:%S,%f", "%d/%m/%Y %H:%M:%S.%f", "%d.%m.%YT%H:%M:%S.%f"),
    "%d.%m.%y %H:%M:%S,%f",
]
TWO_COLUMNS = [
    ("Date;Time;y", "%d.%m.%y;%H:%M:%S.%f"),
    ("Date;Time;y", "%Y-%m-%d;%H:%M:%S.%f"),
    ("Zeit;Datum;y", "%H:%M:%S,%f;%d.%m.%y"),
    ("Zeit;Datum;y", "%H:%M:%S,%f;%Y-%m-%d"),
]


@pytest.mark.parametrize(
    ("header", "form"), [("Datum;y", form) for form in DAY_FIRST] + TWO_COLUMNS
)
def test_dates_with_the_day_first_and_in_two_columns(tmp_path, header, form):
    path = tmp_path / "run.csv"
    lines = [f"{time.strftime(form)};{y}" for time, y in zip(DATES, Y, strict=True)]
    path.write_text("\n".join([header, *lines]))
    signal, rate = read_recording(path)
    np.testing.assert_allclose(signal, Y, rtol=1e-13)
    assert rate == 25_000
    assert recording_start(path) == DATES[0].timestamp()


def test_whole_dates_and_seconds_in_two_columns_stay_apart(tmp_path):
    path = tmp_path / "run.csv"
    texts = DATES.strftime("%Y-%m-%dT%H:%M:%S.%f")
    pd.DataFrame({"date": texts, "time": EVEN, "y": Y}).to_csv(path, index=False)
    assert read_recording(path, channel="y")[1] == 25_000
    np.testing.assert_allclose(read_recording(path, channel="time")[0], EVEN)


@pytest.mark.parametrize(
    ("name", "times"),
    [
        ("time", np.arange(N)),  # a number of the sample
        ("time", np.arange(N, dtype=float)),
        ("time", np.arange(0, 40 * N, 40)),  # integers of an unknown unit
        ("t", Y),  # t may be a torque
        ("t", np.zeros(N)),
        ("time (weeks)", EVEN),
        ("time", np.arange(5000) // 4000 + 0.5),  # too coarse
    ],
)
def test_what_is_no_time(write, name, times):
    assert read_recording(write(times, name, "npz"), channel="y")[1] is None


def test_times_of_another_length_belong_to_other_channels(tmp_path):
    np.savez(tmp_path / "run.npz", t=EVEN[: N // 2], y=Y)
    assert read_recording(tmp_path / "run.npz")[1] is None


BROKEN = {
    "jump back": np.where(EVEN < 0.4, EVEN, EVEN - 0.2),
    "restart": EVEN % 0.25,
    "descending": 5 - EVEN,
    "a gap": np.where(EVEN < 0.3, EVEN, EVEN + 60),
    "a gap of unknown times": np.where(
        (EVEN < 0.3) | (EVEN > 0.35), EVEN + (EVEN > 0.3), np.nan
    ),
    "a gap at the beginning": EVEN + 0.005 * (np.arange(N) >= 1),
    "a gap at the end": EVEN + 0.005 * (np.arange(N) >= N - 1),
}


@pytest.mark.parametrize("broken", BROKEN)
@pytest.mark.parametrize("suffix", ["csv", "npz", "parquet"])
@pytest.mark.parametrize("n_samples", [None, 50])
def test_broken_clocks_are_refused(write, broken, suffix, n_samples):
    """They were taken for no times, so that their gaps were not noticed."""
    message = r"'time' is not evenly spaced: .* expected 0.001 s"
    if broken.startswith("a gap at"):
        sample = 1 if "beginning" in broken else N - 1
        message = rf"0\.006 s before sample {sample}, expected 0.001 s"
    path = write(BROKEN[broken], suffix=suffix)
    with pytest.raises(ValueError, match=message):
        in_blocks(path, n_samples, channel="y")


def test_jitter_is_no_gap(write):
    times = (np.arange(N) + np.random.default_rng(0).uniform(-0.2, 0.2, N)) / 1000
    assert read_recording(write(times))[1] == pytest.approx(1000, rel=1e-3)


def test_a_rate_in_the_file_comes_before_the_times(write):
    path = write(EVEN, suffix="npz", fs=1001)
    assert read_recording(path, channel="y")[1] == 1001
    path = write(EVEN + np.repeat([0, 3], N // 2), suffix="npz", fs=1000)
    message = r"not evenly spaced: 3\.001 s before sample 300"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="y")


def test_a_stated_rate_decides_between_a_number_and_times(write):
    path = write(EVEN, suffix="npz", fs=2000)
    for rate in (1000.0, 2000.0):
        assert in_blocks(path, channel="y", stated_rate=rate)[1] == rate
    message = "several sampling rates: fs 2000 Hz, the times 'time' 1000 Hz"
    for rate in (None, 3000.0):
        with pytest.raises(ValueError, match=message):
            in_blocks(path, channel="y", stated_rate=rate)


def test_a_stated_rate_decides_between_two_numbers(tmp_path):
    path = tmp_path / "run.npz"
    np.savez(path, y=Y, fs=12e3, Fs=48e3)
    for rate in (12e3, 48e3):
        assert len(in_blocks(path, stated_rate=rate)[0]) == N
    message = "several sampling rates: fs 12000 Hz, Fs 48000"
    for rate in (None, 24e3):
        with pytest.raises(ValueError, match=message):
            in_blocks(path, stated_rate=rate)


@pytest.mark.parametrize(
    ("suffix", "is_date"),
    [
        *((s, False) for s in ("csv", "npz", "parquet")),
        ("csv", True),
        ("parquet", True),
    ],
)
def test_unknown_times_follow_the_sample_before(write, suffix, is_date):
    times = EVEN + 1e9 * is_date
    times[[0, 7, 8, 9, 300, -1]] = np.nan
    if is_date:
        times = pd.to_datetime(pd.Series(times), unit="s").astype("datetime64[ns]")
    path = write(times, suffix=suffix)
    for n_samples in (None, 50):
        signal, rate, _ = in_blocks(path, n_samples)
        np.testing.assert_allclose(signal, Y, rtol=1e-13)
        assert rate == 1000
    if is_date:
        assert recording_start(path) == pytest.approx(1e9, abs=1e-6)


@pytest.mark.parametrize("n_samples", [None, 50])
def test_missing_times_are_unknown_and_texts_are_refused(write, n_samples):
    times = [f"{t:.3f}" for t in EVEN]
    times[3] = "NaN"
    times[400:500] = ["NaN"] * 100
    assert in_blocks(write(times), n_samples)[1] == 1000
    times[7] = "later"
    with pytest.raises(ValueError, match="line 9: 'later' in column 'time'"):
        in_blocks(write(times), n_samples)


@pytest.mark.parametrize("n_samples", [None, 999])
@pytest.mark.parametrize("at", [0, 20_000])
def test_a_rate_that_drifts_is_refused(write, n_samples, at):
    """Each step is right within the tolerance of a step."""
    rates = 1000 * np.append(np.ones(at), np.linspace(1, 1.3, 60_000 - at))
    path = write(np.cumsum(1 / rates), suffix="npz")
    message = r"'time' is not evenly spaced: .* samples before sample"
    with pytest.raises(ValueError, match=message):
        in_blocks(path, n_samples, channel="y")


def test_a_clock_that_is_wrong_by_a_share_is_no_drift(write):
    times = np.arange(60_000) / 1000 * np.where(np.arange(60_000) < 30_000, 1, 1.00001)
    assert read_recording(write(times, suffix="npz"), channel="y")[1] == 1000


@pytest.mark.parametrize("n_samples", [None, 999])
def test_a_clock_that_stands_still(write, n_samples):
    """It states no rate. If it stops, ten seconds of equal times are too many."""
    times = np.arange(30_000) / 1000
    path = write(np.minimum(times, 7.5), suffix="npz")
    with pytest.raises(ValueError, match=r"'time' is not evenly .* at 1000"):
        in_blocks(path, n_samples, channel="y")
    path = write(np.full(15_000, 7.5), suffix="npz")
    assert in_blocks(path, n_samples, channel="y")[1] is None
