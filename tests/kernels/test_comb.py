import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from skarxlag.kernels import comb
from skarxlag.kernels.comb import comb_frequency

from .literal import generators, some_examples


def literal_frequency(samples, fundamental, tolerance, n_harmonics):
    """The largest sum over harmonics of what stands out, one frequency after another."""
    n_samples = len(samples)
    n_fft = 4 * n_samples
    windowed = (samples - samples.mean()) * np.hanning(n_samples)
    level = np.log(np.abs(np.fft.rfft(windowed, n_fft)) ** 2)
    half = int(0.4 * fundamental * n_fft)
    # A thousandth, or a quarter of a cell at the highest harmonic.
    step = min(1e-3, 0.25 / (n_harmonics * fundamental * n_fft))
    scores, most = {}, int(np.floor(tolerance / step + 1e-6))
    for number in range(-most, most + 1):
        frequency, score = fundamental * np.exp(step * number), 0.0
        for harmonic in range(1, n_harmonics + 1):
            place = harmonic * frequency * n_fft
            below = int(place)
            if below + 1 >= len(level):
                continue
            around = [
                max(level[k] - np.median(level[k - half : k + half + 1]), 0)
                for k in (below, below + 1)
            ]
            score += around[0] + (place - below) * (around[1] - around[0])
        scores[frequency] = score
    # Of equals the one next to the nominal frequency.
    return max(scores, key=lambda f: (scores[f], -abs(np.log(f / fundamental))))


def test_a_tolerance_may_be_a_whole_number_of_steps():
    samples = np.random.default_rng(0).normal(size=1024)
    # 0.04 is 40 steps of a thousandth, but for rounding.
    expected = literal_frequency(samples, 1 / 37.3, 0.04, 5)
    assert comb_frequency(samples, 1 / 37.3, 0.04, 5) == pytest.approx(expected)


def test_harmonics_above_the_spectrum_do_not_count():
    samples = np.random.default_rng(0).normal(size=1024)
    expected = comb_frequency(samples, 0.23, 0.02, 2)
    assert comb_frequency(samples, 0.23, 0.02, 3) == expected
    assert comb_frequency(samples, 0.23, 0.02, 10**12) == expected


@pytest.mark.parametrize(
    ("tones", "nominal", "tolerance"),
    [((0.0301, 0.0602), 0.029, 0.1), ((0.045,), 0.03, 0.45)],
)
def test_a_tone_is_found_also_at_the_end_of_the_range(tones, nominal, tolerance):
    samples = np.cos(2 * np.pi * np.outer(tones, np.arange(4096))).sum(axis=0)
    found = comb_frequency(samples, nominal, tolerance, len(tones))
    assert found == pytest.approx(tones[0], rel=2e-3)


# Multiples of the second lie above the spectrum.
@pytest.mark.parametrize("fundamental", [0.03, 0.24])
@pytest.mark.parametrize("value", [0.0, 7.0])
def test_a_constant_leaves_the_nominal_frequency(value, fundamental):
    assert comb_frequency(np.full(2048, value), fundamental, 0.1, 2) == fundamental


def test_harmonics_that_only_slow_candidates_have_below_half_a_cycle_count():
    k = np.arange(2048)
    tones = np.cos(2 * np.pi * 0.24 * k) + np.cos(2 * np.pi * 0.48 * k + 1)
    found = comb_frequency(tones + 2 * np.cos(2 * np.pi * 0.275 * k), 0.26, 0.1, 2)
    assert found == pytest.approx(0.24, rel=1e-3)


def test_a_harmonic_at_half_a_cycle_a_sample_counts():
    alternating = (-1.0) ** np.arange(1024)
    assert comb_frequency(alternating, 0.251, 0.01, 2) == pytest.approx(0.25, rel=2e-4)


# The loud tone has a mean power of which a share of 1e-12 is an amplitude of some 2e-8.
@pytest.mark.parametrize(
    ("pair", "single", "expected"), [(1e-6, 1e-5, 0.0202), (1e-8, 3e-8, 0.0212)]
)
def test_power_below_a_share_of_the_mean_power_does_not_stand_out(
    pair, single, expected
):
    k = np.arange(8192)
    samples = np.cos(2 * np.pi * 0.45 * k)
    samples += pair * (np.cos(2 * np.pi * 0.0202 * k) + np.cos(2 * np.pi * 0.0404 * k))
    samples += single * np.cos(2 * np.pi * 0.0212 * k)
    assert comb_frequency(samples, 0.0207, 0.05, 2) == pytest.approx(expected, rel=2e-3)


@some_examples
@given(
    generators,
    st.sampled_from([256, 500, 512]),
    st.integers(1, 4),
    st.floats(0.02, 0.08),
    st.floats(0, 0.1),
)
def test_comb_frequency(rng, n_samples, n_harmonics, fundamental, tolerance):
    # The reference knows nothing of what lies beyond the ends of the spectrum.
    assume((n_harmonics + 1) * fundamental * math.exp(tolerance) < 0.5)
    samples = rng.normal(size=n_samples)
    found = comb.comb_frequency(samples, fundamental, tolerance, n_harmonics)
    expected = literal_frequency(samples, fundamental, tolerance, n_harmonics)
    assert found == pytest.approx(expected, rel=1e-9)
