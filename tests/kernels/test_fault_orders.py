import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import maximum_filter1d, median_filter

from skarxlag.kernels import fault_orders as kernel

from .literal import generators, some_examples

IMPACTS = np.array([4.72, 5.415, 3.585])  # ball, inner and outer race
NOTHING = np.zeros(4001, dtype=bool)


def impacts(order, turn=2000.0, n_samples=80_000, seed=0, scatter=0.01, height=12):
    """Noise with impacts that scatter by 1 % about an order."""
    rng = np.random.default_rng(seed)
    signal = rng.normal(size=n_samples)
    n_impacts = int(n_samples / turn * order)
    intervals = turn / order * rng.normal(1, scatter, size=n_impacts)
    places = np.cumsum(intervals).astype(int)
    signal[places[places < n_samples]] += height
    return signal


def matched(signal, turn=2000.0, tolerance=0.0, slip=0.02, trains=()):
    """Return the combs of a signal."""
    contrasts = kernel.order_contrast(signal, turn)
    error = kernel.speed_error(contrasts, IMPACTS, tolerance)
    contrast = kernel.at_true_speed(contrasts, error)
    masked = kernel.no_fault_lines(trains)
    n_revolutions = len(signal) / np.mean(turn)
    return kernel.fault_comb(contrast, IMPACTS, slip, n_revolutions, masked)


@pytest.mark.parametrize(("fault", "factor"), [(1, 0.985), (2, 1.0), (2, 1.015)])
def test_comb_finds_a_race_and_its_slip(fault, factor):
    comb = matched(impacts(IMPACTS[fault] * factor))
    assert comb.scores.argmax() == fault and comb.scores[fault] > 3
    assert comb.factors[fault] == pytest.approx(factor, abs=0.004)


def test_longer_signals_show_a_comb_more_clearly():
    signal = impacts(3.585, n_samples=160_000, scatter=0.003)
    scores = [matched(signal[:n]).scores[2] for n in (20_000, 40_000, 80_000, 160_000)]
    assert (np.diff(scores) > 0).all()


@pytest.mark.parametrize("turn", [500.0, 2000.0, 6000.0])
def test_noise_has_low_scores_at_any_length_and_speed(turn):
    rng = np.random.default_rng(4)
    best = [
        matched(row, turn).scores.max()
        for n_samples in (10_000, 100_000)
        for row in rng.normal(size=(4, n_samples))
    ]
    assert max(best) < 1.2


def test_impacts_show_in_a_narrow_band_at_any_frequency():
    rng = np.random.default_rng(5)
    signal = impacts(5.415, scatter=0.0)
    carrier = np.cos(0.93 * np.pi * np.arange(len(signal)))
    high = 30 * rng.normal(size=len(signal)).cumsum() / 300 + signal * carrier
    assert matched(high).scores.argmax() == 1 and matched(high).scores[1] > 2


def test_a_varying_speed_is_followed():
    rng = np.random.default_rng(3)
    turn = np.linspace(1600.0, 2600.0, 60_000)
    angle = np.cumsum(1 / turn)
    signal = rng.normal(size=60_000)
    angles = np.cumsum(rng.normal(1 / 5.415, 0.002, size=int(angle[-1] * 5.4)))
    signal[np.searchsorted(angle, angles[angles < angle[-1]])] += 12
    mean = len(turn) / angle[-1]
    assert matched(signal, turn).scores[1] > matched(signal, mean).scores[1] + 1
    assert_allclose(
        kernel.order_contrast(signal, np.full(60_000, 2000.0))[:, 100:1000],
        kernel.order_contrast(signal, 2000.0)[:, 100:1000],
        atol=0.5,
    )


@pytest.mark.parametrize("error", [-0.07, 0.015, 0.05])
def test_lines_of_the_shaft_show_the_true_speed(error):
    turn = 2000.0 * np.exp(-error)
    signal = impacts(3.585, turn, height=60)
    signal += impacts(1.0, turn, seed=1, scatter=0.0, height=60)
    contrasts = kernel.order_contrast(signal, 2000.0)
    found = kernel.speed_error(contrasts, IMPACTS, 0.1)
    assert found == pytest.approx(error, abs=0.002)
    assert matched(signal, tolerance=0.1).scores.argmax() == 2
    # Beyond the tolerance it is not found.
    nearest = kernel.speed_error(contrasts, IMPACTS, abs(error) / 2)
    assert abs(nearest) <= abs(error) / 2 + 1e-12


def test_lines_of_faults_do_not_show_a_speed():
    signal = impacts(3.585 * 1.01, scatter=0.0)
    contrasts = kernel.order_contrast(signal, 2000.0)
    assert abs(kernel.speed_error(contrasts, IMPACTS, 0.02)) < 0.01


@pytest.mark.parametrize("divisor", [2, 3, 4])
@pytest.mark.parametrize("fault", [1, 2])
def test_impacts_at_a_fraction_of_an_order_are_no_fault(fault, divisor):
    order = IMPACTS[fault] / divisor
    comb = matched(impacts(order, scatter=0.0, height=60))
    assert comb.scores[fault] == 0
    if order > 1.2:
        assert comb.other_order == pytest.approx(order, rel=0.01)
        assert comb.other_score > 3


@pytest.mark.parametrize(("turn", "n_samples"), [(2000.0, 80_000), (2000.0, 30_000)])
def test_multiples_of_the_shaft_are_no_fault(turn, n_samples):
    signal = impacts(1.0, turn, n_samples, scatter=0.0, height=60)
    contrasts = kernel.order_contrast(signal, turn)
    near = np.array([3.993, 4.95, 3.05])
    masked = kernel.no_fault_lines([])
    comb = kernel.fault_comb(
        kernel.at_true_speed(contrasts, 0.0), near, 0.02, n_samples / turn, masked
    )
    assert comb.scores.max() < 1.5


@pytest.mark.parametrize(("n_revolutions", "is_parted"), [(60, False), (65, True)])
def test_orders_within_the_resolution_of_the_shaft_are_not_named(
    n_revolutions, is_parted
):
    contrast = np.zeros(4001)
    contrast[[401, 802, 1202, 1603]] = 5.0
    near = np.array([4.008, 4.95, 3.05])
    masked = np.zeros(4001, dtype=bool)
    comb = kernel.fault_comb(contrast, near, 0.0, n_revolutions, masked)
    # The fourth multiple is .032 orders, two cells of 62.5 revolutions, from the shaft's.
    assert (comb.scores[0] > 4) == is_parted


def test_trains_of_the_mains_are_no_fault():
    signal = impacts(3.6, scatter=0.0)
    assert matched(signal).scores[2] > 3
    without = matched(signal, trains=[3.6])
    assert without.scores[2] < matched(signal).scores[2] - 0.5
    # One below an order would leave nothing.
    assert matched(signal, trains=[0.6]).scores[2] > 3


@pytest.mark.parametrize("n_samples", [1, 5, 40])
@pytest.mark.parametrize("value", [0.0, 3.0])
def test_constant_and_short_signals_have_no_contrast(n_samples, value):
    contrasts = kernel.order_contrast(np.full(n_samples, value), 10.0)
    assert_array_equal(contrasts, np.zeros((3, 4001)))
    assert kernel.speed_error(contrasts, IMPACTS, 0.1) == 0


def test_gain_does_not_matter():
    signal = impacts(5.415)
    one, small, large = (
        kernel.order_contrast(gain * signal, 2000.0) for gain in (1.0, 1e-200, 1e200)
    )
    assert_allclose(small, one, atol=1e-6)
    assert_allclose(large, one, atol=1e-6)


@some_examples
@given(generators, st.integers(150, 400), st.floats(5.0, 40.0))
def test_order_contrast_of_a_signal_and_of_its_envelopes(rng, n, turn):
    samples = rng.normal(size=n) + 4
    spectrum = np.fft.rfft(samples - samples.mean())
    places = 0.01 * np.arange(4001)
    square, n_shown = np.zeros(4001), np.zeros(4001)
    for band in np.array_split(np.arange(1, n // 2 + 1), 4):
        n_values = kernel.fft.next_fast_len(2 * len(band))
        at = np.arange(n_values) * n / n_values
        turning = np.exp(2j * np.pi * np.outer(at, band) / n)
        squared = np.abs(turning @ spectrum[band]) ** 2
        level = literal_level(squared / squared.mean() - 1, n / turn)
        shows = places * n / turn < n_values / 2
        square += shows * np.maximum(level, 0) ** 2
        n_shown += shows
    expected = np.sqrt(square / np.maximum(n_shown, 1))
    assert_allclose(kernel.order_contrast(samples, turn)[0], expected, atol=1e-6)


def literal_level(values, n_revolutions):
    """Logarithm of a padded periodogram over orders, less its running median."""
    n = len(values)
    n_fft = kernel.fft.next_fast_len(2 * n, real=True)
    cell = n / n_fft / n_revolutions
    hann = np.sin(np.pi * (np.arange(n) + 1) / (n + 1)) ** 2
    power = np.abs(np.fft.rfft(values * hann, n_fft)) ** 2
    power = power[: int(41 / cell) + 2]
    level = np.log(power + 1e-12 * power.mean())
    n_cells = max(round(max(0.01, 1 / n_revolutions) / cell), 1) | 1
    largest = maximum_filter1d(level, n_cells)
    places = 0.01 * np.arange(4001)
    on_grid = np.interp(places / cell, np.arange(len(level)), largest)
    width = 2 * int(max(1.2, 24 / n_revolutions) / 0.02) + 1
    return on_grid - median_filter(on_grid, width, mode="nearest")


@some_examples
@given(generators, st.floats(1.3, 9), st.floats(0.004, 0.05))
def test_fault_comb(rng, order, slip):
    contrast = rng.exponential(size=4001)
    masked = rng.random(4001) < 0.1
    fits = []
    n_slips = int(slip / 0.0005 + 1e-9)
    for step in range(-n_slips, n_slips + 1):
        own = 0.0005 * step
        heights = []
        for k in range(1, 5):
            cell = round(k * order * math.exp(own) / 0.01)
            if cell > 4000:
                heights.append(0.0)
            elif not masked[cell]:
                near = range(max(cell - 1, 0), min(cell + 2, 4001))
                heights.append(max(contrast[j] * (not masked[j]) for j in near))
        mean = sum(heights) / max(len(heights), 2)
        fits.append((mean, -abs(own), own))
    score, _, own = max(fits)
    orders = np.array([1.2, order, 1.21])
    comb = kernel.fault_comb(contrast, orders, slip, 1e3, masked)
    assert comb.scores[1] in (0, pytest.approx(score))
    assert abs(np.log(comb.factors[1])) == pytest.approx(abs(own), abs=1e-12)


def test_a_constant_signal_has_a_squared_envelope_spectrum_of_zeros():
    found = kernel.squared_envelope_spectrum(np.full(64, 3.0), (0.0, 0.5), False)
    assert_array_equal(found, np.zeros(33))


def test_frequencies_without_power_are_not_prewhitened():
    # A tone of one bin: its rounding errors at the other bins must not become as large
    # as the tone.
    tone = np.sin(2 * np.pi * 8 / 64 * np.arange(64))
    found = kernel.squared_envelope_spectrum(tone, (0.0, 0.5), True)
    # The envelope of one tone is constant.
    assert found.max() < 1e-12
    # A second one beats with it, if its share of the largest magnitude is above 1e-12.
    faint = np.sin(2 * np.pi * 24 / 64 * np.arange(64))
    for share, beats in ((1.05e-12, True), (0.95e-12, False)):
        found = kernel.squared_envelope_spectrum(tone + share * faint, (0.0, 0.5), True)
        assert (found[16] > 0.1) == beats


@pytest.mark.parametrize(("n_samples", "first"), [(1000, 100), (1001, 101)])
def test_the_bins_at_the_ends_of_the_band_count_and_their_neighbours_do_not(
    n_samples, first
):
    angle = 2 * np.pi * np.arange(n_samples) / n_samples
    for ends, beats in (
        ((first, 400), True),
        ((first - 1, 400), False),
        ((first, 401), False),
    ):
        signal = np.cos(ends[0] * angle) + np.cos(ends[1] * angle)
        found = kernel.squared_envelope_spectrum(signal, (0.1, 0.4), False)
        assert (found[ends[1] - ends[0]] > 1e-3) == beats


def literal_squared_envelope(samples, n_fft, first, last, prewhiten):
    """Squared size of the sum of all frequencies of a band, one sample after another."""
    k, centred = np.arange(len(samples)), samples - samples.mean()
    total = np.zeros(len(samples), dtype=complex)
    for f in range(n_fft // 2 + 1):
        turning = np.exp(2j * np.pi * f * k / n_fft)
        amplitude = centred @ turning.conj()
        if first <= Fraction(f, n_fft) <= last:
            # The mean, which has been taken off, is nothing but rounding.
            size = abs(amplitude) if prewhiten and f > 0 else 1.0
            total += amplitude / size * turning / n_fft
    return np.abs(total) ** 2


@some_examples
@given(
    generators,
    st.integers(16, 120),
    st.integers(0, 20).map(lambda percent: Fraction(percent, 100)),
    st.integers(25, 50).map(lambda percent: Fraction(percent, 100)),
    st.booleans(),
)
def test_squared_envelope_spectrum(rng, n, first, last, prewhiten):
    # A limit that is a frequency, which only a fraction meets, is a matter of rounding.
    first, last = first + Fraction(1, 10_007), last - Fraction(1, 10_007)
    samples = 5 + rng.normal(size=n)
    squared = literal_squared_envelope(samples, n, first, last, prewhiten)
    # A band of a short signal may hold no frequency.
    assume(squared.any())
    k = np.arange(n)
    windowed = (squared / squared.mean() - 1) * np.sin(np.pi * (k + 1) / (n + 1)) ** 2
    expected = [
        abs(windowed @ np.exp(-2j * np.pi * f * k / n)) ** 2 * 16 / n**2
        for f in range(n // 2 + 1)
    ]
    band = (float(first), float(last))
    found = kernel.squared_envelope_spectrum(samples, band, prewhiten)
    assert_allclose(found, expected, atol=1e-9)
