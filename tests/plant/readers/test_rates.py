import numpy as np
import pytest
from scipy.signal import resample_poly

from skarxlag import load_recordings
from skarxlag.plant.readers.formats.rates import rates_agree
from skarxlag.plant.readers.resampling import resampled_blocks

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("first", "second", "agree"),
    [
        (51_199.87, 51_200, True),
        (51_200, 51_149, True),
        (51_200, 51_100, False),
        (None, 1, True),
        (1, None, True),
    ],
)
def test_rates_agree(first, second, agree):
    assert rates_agree(first, second) is agree


def joined(signal, cuts, old, new):
    parts = resampled_blocks(np.split(signal, cuts, axis=-1), old, new)
    return np.concatenate([*parts], axis=-1)


@pytest.mark.parametrize(
    ("old", "new", "p", "q"),
    [
        (48_000, 12_000, 1, 4),
        (12_000, 48_000, 4, 1),
        (48_000, 44_100, 147, 160),
        (12_000, 25_600, 32, 15),
        (97_656.25, 100_000, 128, 125),
        (51_199.9, 25_600, 1, 2),
    ],
)
@pytest.mark.parametrize("shape", [(5003,), (2, 5003)])
def test_the_parts_give_what_scipy_gives_of_the_whole(old, new, p, q, shape):
    signal = 3 + RNG.normal(size=shape)
    expected = resample_poly(signal - signal[..., :1], p, q, axis=-1) + signal[..., :1]
    for cuts in ([], [1, 700]):
        np.testing.assert_allclose(joined(signal, cuts, old, new), expected, atol=1e-12)


def test_rates_that_agree_leave_the_samples():
    signal = RNG.normal(size=100)
    same = joined(signal, [30], 51_199.9, 51_200)
    np.testing.assert_array_equal(same, signal)


def test_rates_that_cannot_be_brought_together():
    with pytest.raises(ValueError, match=r"unknown rate cannot be resampled to 5 Hz"):
        resampled_blocks([np.zeros(5)], None, 5)
    with pytest.raises(ValueError, match=r"from 1e-06 to 1e\+06 Hz: expected a ratio"):
        resampled_blocks([np.zeros(5)], 1e-6, 1e6)


@pytest.mark.parametrize(("unit", "scale"), [("min", 1 / 60), ("ms", 1000)])
def test_a_stated_rate_shows_the_unit_of_times(tmp_path, unit, scale):
    seconds, signal = np.arange(3000) / 800, RNG.normal(size=3000)
    path, table = tmp_path / "run.npz", tmp_path / "table.csv"
    table.write_text("path,sampling_rate\nrun.npz,800\n")
    np.savez(path, time=seconds * scale, acc=signal)
    assert load_recordings(table, channel="acc").sampling_rate == 800
    np.savez(path, **{f"time ({unit})": seconds * scale, "acc": signal})
    assert load_recordings(table, channel="acc").sampling_rate == 800
    np.savez(path, time=seconds * 1.5, acc=signal)
    with pytest.raises(ValueError, match=r"the file states 533.\d* Hz$"):
        load_recordings(table)
