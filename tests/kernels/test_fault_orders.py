import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.signal import resample

from skarxlag.kernels import fault_orders
from skarxlag.kernels import fault_orders as kernel

from .literal import between, generators, some_examples

ORDERS = np.array([0.4, 2.36, 5.4, 3.6])  # cage, spin, inner and outer race


def impacts(order, turn=2000.0, n_samples=40_000, seed=0):
    """Noise with impacts that scatter by 1 % about an order."""
    rng = np.random.default_rng(seed)
    signal = rng.normal(size=n_samples)
    intervals = turn / order * rng.normal(1, 0.01, size=int(n_samples / turn * order))
    places = np.cumsum(intervals).astype(int)
    signal[places[places < n_samples]] += 12
    return signal


@pytest.mark.parametrize("noise", [1.0, 5e-6])
def test_spectra_of_few_values_are_compared_up_to_order_41(noise):
    # The faint noise has about the least power that counts, 1e-12 of that of the
    # envelope.
    envelope = 3 + noise * np.random.default_rng(2).normal(size=(1, 100))
    cell, window = 1 / (400 * 0.0101), np.hanning(102)[1:-1]
    power = np.abs(np.fft.rfft((envelope[0] - envelope.mean()) * window, 400)) ** 2
    power = power[: int(41 / cell) + 2] + 1e-12 * np.mean(envelope**2) * 100
    # 12 cells of the plain spectrum, of which each is 4 cells wide
    median = median_filter(np.log(power), size=2 * 24 + 1, mode="nearest")
    above = np.log(power) - median + np.log(np.log(2))
    expected = maximum_filter1d(np.maximum(above, 0), 3)
    at = np.interp(np.arange(4001) * 0.01, np.arange(len(expected)) * cell, expected)
    assert_allclose(kernel.mean_contrast(envelope, 0.0101), at, atol=1e-6)


@pytest.mark.parametrize(("order", "place"), [(3.6, "outer"), (5.4, "inner")])
@pytest.mark.parametrize("factor", [0.975, 1.0, 1.03])
def test_comb_finds_a_race_and_the_factor_on_the_speed(order, place, factor):
    contrast = kernel.order_contrast(impacts(order * factor), 2000.0, 20_000.0)
    comb = kernel.fault_comb(contrast, ORDERS, 0.1, 0.03)
    best = comb.scores.argmax()
    assert kernel.FAULTS[best] == place
    assert comb.scores[best] > 2
    assert comb.factors[best] == pytest.approx(factor, abs=0.006)


@pytest.mark.parametrize(
    ("turn", "counts"), [(3000.0, False), (638.0, False), (400.0, True)]
)
def test_frequencies_above_the_highest_do_not_count(turn, counts):
    # 6.4 kHz, or 80 times the turns in a second: 17, 80 and 128
    rate, rng = 51_200.0, np.random.default_rng(9)
    signal, spectrum = rng.normal(size=51_200), np.zeros(25_601, complex)
    spectrum[6500:10_000] = 1e4 * np.exp(2j * np.pi * rng.random(3500))
    loud = signal + np.fft.irfft(spectrum)
    found = kernel.order_contrast(loud, turn, rate)
    without = kernel.order_contrast(signal, turn, rate)
    assert (np.abs(found - without).max() > 1e-6) == counts
    # The same for a speed of each sample.
    tracked = kernel.order_contrast(loud, np.full(51_200, turn), rate)
    assert np.abs(tracked - found)[100:900].max() < 0.05


def test_a_signal_is_resampled_to_twice_the_highest_frequency():
    signal = np.random.default_rng(9).normal(size=1001)
    found, turn, rate = kernel._without_high_frequencies(signal, 3000.0, 51_200.0)
    # 12.8 kHz or a little more
    expected = resample(signal - signal.mean(), 251)
    assert_allclose(found / found.std(), expected / expected.std(), atol=1e-9)
    assert_allclose([turn / 3000, rate / 51_200], 251 / 1001)


def test_a_varying_speed_is_followed():
    rng = np.random.default_rng(3)
    turn = np.linspace(1600.0, 2600.0, 60_000)
    angle = np.cumsum(1 / turn)
    signal = rng.normal(size=60_000)
    angles = np.cumsum(rng.normal(1 / 5.4, 0.002, size=int(angle[-1] * 5.4)))
    places = np.searchsorted(angle, angles[angles < angle[-1]])
    signal[places] += 12
    followed, mean = (
        kernel.fault_comb(
            kernel.order_contrast(signal, each, 20_000.0), ORDERS, 0.02, 0.03
        )
        for each in (turn, float(turn.mean()))
    )
    assert followed.scores[1] > mean.scores[1] + 1


def test_noise_has_low_scores_in_rows_of_any_length():
    rng = np.random.default_rng(4)
    best = []
    for n_samples in (6000, 20_000, 100_000):
        noise = rng.normal(size=(8, n_samples))
        contrasts = [kernel.order_contrast(row, 2000.0, 20_000.0) for row in noise]
        best.append(
            max(kernel.fault_comb(c, ORDERS, 0.1, 0.03).scores.max() for c in contrasts)
        )
    assert max(best) < 1.2


@pytest.mark.parametrize("n_samples", [1, 5, 40])
@pytest.mark.parametrize("value", [0.0, 3.0])
def test_constant_and_short_signals_have_no_contrast(n_samples, value):
    contrast = kernel.order_contrast(np.full(n_samples, value), 10.0, 100.0)
    assert contrast.shape == (4001,)
    assert not contrast.any()


def test_gain_does_not_matter():
    signal = impacts(5.4)
    one, other = (
        kernel.order_contrast(g * signal, 2000.0, 20_000.0) for g in (1.0, 1e-200)
    )
    assert_allclose(one, other, atol=1e-6)


def test_segments_are_whole_seconds_or_turns_and_five_of_them():
    rate, rng = 500.0, np.random.default_rng(6)
    # 1 s has 25, 8 and 50 turns; a segment has 10 to 30.
    for seconds, turn, length in (
        (2.0, 20.0, 500),
        (12.0, 60.0, 600),
        (12.0, 10.0, 300),
    ):
        samples = rng.normal(size=int(seconds * rate))
        found = kernel.contrast_parts(samples, turn, rate)
        parts = samples.reshape(-1, length)
        frame = 4  # 2.5 ms are about one sample; no frame is shorter than 4
        banded = [
            kernel.mean_contrast(*kernel.envelopes_over_angle(part, turn, frame, 1, 40))
            for part in parts
        ]
        n_long = max(len(samples) // (5 * length), 1)
        long = samples[: len(samples) // n_long * n_long].reshape(n_long, -1)
        in_short, in_long = (
            [kernel.mean_contrast(*kernel.prewhitened_envelope(p, turn)) for p in each]
            for each in (parts, long)
        )
        for contrast, of_segments in zip(
            found, (banded, in_short, in_long), strict=True
        ):
            assert_allclose(contrast, np.mean(of_segments, axis=0))


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


def test_a_neper_of_power_is_4_34_decibel():
    assert pytest.approx(10 * np.log10(np.e)) == kernel.NEPER_IN_DB


@pytest.mark.parametrize(
    ("n_samples", "turn", "n_bands"), [(3000, 100.0, 8), (100, 10.0, 5)]
)
def test_bands_are_eight_or_as_many_as_a_frame_has(n_samples, turn, n_bands):
    samples = np.random.default_rng(6).normal(size=n_samples)
    # 2.5 ms are 42.5 samples, of which the nearest power of two on a log scale is 32.
    banded = kernel.envelopes_over_angle(samples, turn, 32, n_bands, 40)
    found = kernel.contrast_parts(samples, turn, 17_000.0)[0]
    assert_array_equal(found, kernel.mean_contrast(*banded))


def test_contrast_weighs_long_segments_less():
    signal = impacts(5.4, n_samples=110_000)
    banded, short, long = kernel.contrast_parts(signal, 2000.0, 20_000.0)
    found = kernel.order_contrast(signal, 2000.0, 20_000.0)
    assert not np.array_equal(short, long)
    assert_allclose(found, (banded + short + 0.4 * long) / 2.4)


def test_slips_at_the_end_of_their_range_are_tried():
    contrast = np.zeros(4001)
    contrast[[540, 1080, 1620]] = 3.0, 2.0, 1.0
    comb = kernel.fault_comb(contrast, ORDERS * [1, 1, np.exp(-0.06), 1], 0.0, 0.06)
    assert comb.factors[1] == pytest.approx(np.exp(0.06))
    assert comb.scores[1] == pytest.approx(2 - 0.15)
    # A slip beyond the range is not.
    comb = kernel.fault_comb(contrast, ORDERS * [1, 1, np.exp(-0.06), 1], 0.0, 0.058)
    assert comb.scores[1] == 0


def all_combs(shift):
    """Contrast with a line of height 3 at the first multiples of all orders, all moved."""
    contrast = np.zeros(4001)
    for order in (2.36, 4.72, 5.4, 3.6):
        for multiple in (1, 2, 3, 4):
            contrast[round(100 * order * multiple * np.exp(shift))] = 3.0
    return contrast


def test_an_error_of_the_speed_moves_all_combs_together():
    comb = kernel.fault_comb(all_combs(0.05), ORDERS, 0.1, 0.03)
    assert_allclose(comb.factors, np.exp(0.05), rtol=0.005)
    assert comb.scores.min() > 1.8
    # Beyond the tolerance and the slip, none is found.
    assert kernel.fault_comb(all_combs(0.05), ORDERS, 0.01, 0.03).scores.max() < 1.5
    # A single comb moves the speed no farther than it slips.
    contrast = np.zeros(4001)
    contrast[[584, 1168, 1752]] = 3.0  # 8 % above the order of the inner race
    comb = kernel.fault_comb(contrast, ORDERS, 0.1, 0.02)
    assert comb.scores[1] == 0 and comb.factors[1] == 1


def test_the_largest_error_and_slip_are_tried_together():
    comb = kernel.fault_comb(all_combs(0.08), ORDERS, 0.05, 0.03)
    assert_allclose(comb.factors, np.exp(0.08))
    nearer = kernel.fault_comb(all_combs(0.08), ORDERS, 0.049, 0.03)
    assert nearer.scores.max() < comb.scores.min()


def test_the_last_orders_count():
    contrast = np.zeros(4001)
    contrast[3999] = 3.0
    for order, score in ((13.33, 1), (13.34, 0)):
        comb = kernel.fault_comb(contrast, np.array([0.4, 2.36, order, 3.6]), 0.0, 0.03)
        assert comb.scores[1] == pytest.approx(score)


def test_eight_values_have_a_contrast_and_seven_have_none():
    values = np.random.default_rng(7).normal(size=(1, 8))
    assert kernel.mean_contrast(values, 0.5).any()
    assert not kernel.mean_contrast(values[:, :7], 0.5).any()


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


@some_examples
@given(
    generators,
    st.lists(st.floats(0.3, 9), min_size=4, max_size=4),
    st.floats(0, 0.05),
    st.floats(0.002, 0.05),
    st.floats(0, 1),
)
def test_fault_comb(rng, orders, tolerance, slip, cage_weight):
    contrast = rng.exponential(size=4001)
    places = 0.01 * np.arange(4001)
    n_errors, n_slips = (math.floor(size / 0.002 + 1e-9) for size in (tolerance, slip))

    def heights(order, n_multiples):
        found = {}
        for shift in range(-n_errors - n_slips, n_errors + n_slips + 1):
            total = 0.0
            for k in range(1, n_multiples + 1):
                at = k * math.exp(0.002 * shift) * order
                below = int(at / 0.01)
                if at <= places[-1]:
                    near = slice(max(below - 2, 0), below + 3)
                    total += between(at, places[near], contrast[near])
            found[shift] = total / n_multiples
        return found

    def best(comb, error):
        return max(
            (
                comb[error + own] - 0.15 * (0.002 * own / slip) ** 2,
                -abs(own),
                error + own,
            )
            for own in range(-n_slips, n_slips + 1)
        )

    cage, spin, inner, outer = orders
    lines = (cage, 4), (spin, 4), (2 * spin, 3), (inner, 3), (outer, 3)
    combs = [heights(*line) for line in lines]
    fits = []
    for error in range(-n_errors, n_errors + 1):
        cage, spin, twice, inner, outer = (best(comb, error) for comb in combs)
        ball = (spin[0] + twice[0]) / 2 + cage_weight * min(cage[0], 1.0)
        expected = [ball, inner[0], outer[0]]
        shifts = [max(spin, twice)[2], inner[2], outer[2]]
        fit = sorted(expected)[1] - 0.6 * (0.002 * error / slip) ** 2
        fits.append((fit, -abs(error), expected, shifts))
    *_, expected, shifts = max(fits)
    scores, factors = fault_orders.fault_comb(
        contrast, np.array(orders), tolerance, slip, cage_weight
    )
    assert_allclose(scores, expected, atol=1e-9)
    assert_allclose(factors, np.exp(0.002 * np.array(shifts)), rtol=1e-12)


@some_examples
@given(
    generators,
    st.integers(1, 2),
    st.sampled_from([8, 25, 60, 100]),
    st.floats(0.01, 0.1),
)
def test_mean_contrast(rng, n_bands, n_values, step):
    envelopes = 1 + rng.exponential(size=(n_bands, n_values))
    n_fft, cell = 4 * n_values, 1 / (4 * n_values * step)
    k = np.arange(n_values)
    hann = np.sin(np.pi * (k + 1) / (n_values + 1)) ** 2
    n_cells = min(int(41 / cell) + 2, n_fft // 2 + 1)
    half = int(max(0.75, 12 / (n_values * step)) / cell / 2)
    curves = []
    for envelope in envelopes:
        centred = (envelope - envelope.mean()) * hann
        level = []
        for f in range(n_cells):
            power = abs(centred @ np.exp(-2j * np.pi * f * k / n_fft)) ** 2
            level.append(math.log(power + 1e-12 * np.mean(envelope**2) * n_values))
        above = []
        for f in range(n_cells):
            places = [
                min(max(j, 0), n_cells - 1) for j in range(f - half, f + half + 1)
            ]
            median = np.median([level[j] for j in places])
            above.append(max(level[f] - median + math.log(math.log(2)), 0))
        # The largest of three; beyond the ends there is nothing.
        curves.append([max(above[max(f - 1, 0) : f + 2]) for f in range(n_cells)])
    curve, highest = np.mean(curves, axis=0), cell * (n_cells - 1)
    orders = 0.01 * np.arange(4001)
    expected = [
        between(o, cell * np.arange(n_cells), curve) * (o <= highest)
        for o in orders[::37]
    ]
    at_the_end = np.abs(orders[::37] - highest) < 1e-9
    found = fault_orders.mean_contrast(envelopes, step)[::37]
    assert_allclose(found[~at_the_end], np.array(expected)[~at_the_end], atol=1e-6)


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
    k = np.arange(n)
    windowed = (squared / squared.mean() - 1) * np.sin(np.pi * (k + 1) / (n + 1)) ** 2
    expected = [
        abs(windowed @ np.exp(-2j * np.pi * f * k / n)) ** 2 * 16 / n**2
        for f in range(n // 2 + 1)
    ]
    band = (float(first), float(last))
    found = fault_orders.squared_envelope_spectrum(samples, band, prewhiten)
    assert_allclose(found, expected, atol=1e-9)


@some_examples
@given(generators, st.sampled_from([64, 90, 120]), st.floats(50, 900))
def test_prewhitened_envelope(rng, n, turn):
    samples = 5 + rng.normal(size=n)
    squared = literal_squared_envelope(samples, n, 0, Fraction(1, 2), True)
    block = max(int(turn / 100), 1)
    expected = [np.mean(squared[i : i + block]) for i in range(0, n - block + 1, block)]
    # Prewhitened samples have no size of their own.
    found, step = fault_orders.prewhitened_envelope(samples, turn)
    assert step == pytest.approx(block / turn)
    assert_allclose(found[0] / found.mean(), expected / np.mean(expected), rtol=1e-7)
