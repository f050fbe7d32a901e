"""Columns that only rise or only fall, in windows and in recordings."""

import numpy as np
import pytest

from skarxlag import load_recordings, signal_quality
from skarxlag.plant.readers.entries import ListedRecording

RNG = np.random.default_rng(0)
N = 1200
TIME = np.arange(N) / 20_000


@pytest.mark.parametrize(
    "ramp",
    [
        TIME,
        1.7e9 + TIME,
        -TIME,
        np.arange(float(N)),
        np.round(TIME, 4),
        TIME + RNG.normal(scale=5e-6, size=N),
    ],
    ids=["seconds", "dates", "seconds back", "a count", "rounded", "jitter"],
)
def test_a_window_of_times_is_a_ramp(ramp):
    assert signal_quality([ramp]).tolist() == ["ramp"]


@pytest.mark.parametrize(
    "signal",
    [
        RNG.normal(size=N),
        # The signal of a sensor on a strong drift, and slow motion in a short window.
        RNG.normal(size=N) + 0.3 * np.arange(N),
        np.sin(2 * np.pi * 8 * TIME) + 1e-3 * RNG.normal(size=N),
        np.cumsum(RNG.normal(size=N)),
        np.exp(-TIME / 0.01) + 1e-3 * RNG.normal(size=N),
    ],
)
def test_a_signal_is_no_ramp(signal):
    assert signal_quality([signal]).tolist() == ["good"]


def test_short_windows_are_no_ramps():
    assert signal_quality([np.arange(63.0)]).tolist() == ["good"]
    assert signal_quality([np.arange(64.0)]).tolist() == ["ramp"]


@pytest.mark.parametrize("cuts", [(), (1,), (0, 400), range(1, N)])
def test_the_direction_of_a_recording(cuts):
    entry = ListedRecording("line 2", "run", "run.npy", channel="t")
    for times in (TIME, -TIME, TIME % 0.02):
        message = r"^line 2: run.npy: channel 't' only rises or only falls"
        with pytest.raises(ValueError, match=message):
            list(entry.one_way_refused(np.split(times, cuts)))
    for signal in (np.round(TIME, 3), RNG.normal(size=N), np.zeros(N), TIME % 0.0005):
        blocks = list(entry.one_way_refused(np.split(signal, cuts)))
        np.testing.assert_array_equal(np.concatenate(blocks), signal)


@pytest.mark.parametrize(("n_samples", "is_refused"), [(64, False), (65, True)])
def test_few_samples_show_no_direction(tmp_path, n_samples, is_refused):
    np.save(tmp_path / "run.npy", np.arange(n_samples) / 7)
    if is_refused:
        message = r"run.npy: channel only rises or only falls"
        with pytest.raises(ValueError, match=message):
            load_recordings(tmp_path, window_length=10, sampling_rate=1.0)
    else:
        found = load_recordings(tmp_path, window_length=10, sampling_rate=1.0)
        assert len(found.data) == 6


def test_an_input_may_rise(tmp_path):
    """The torque of a run-up."""
    np.savez(
        tmp_path / "run.npz", acc=RNG.normal(size=N), torque=np.arange(N) / 7, fs=1000
    )
    found = load_recordings(tmp_path, window_length=100, channel=["acc", "torque"])
    assert found.data.shape == (12, 2, 100)
    assert set(signal_quality(found.data)) == {"good"}
