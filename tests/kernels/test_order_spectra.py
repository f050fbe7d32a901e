import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.lib.stride_tricks import sliding_window_view
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import welch, windows

from skarxlag.kernels import order_spectra
from skarxlag.kernels.order_spectra import (
    band_envelopes,
    envelopes_over_angle,
    order_spectrum,
)

from .literal import generators, shares, some_examples, walk


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.mark.parametrize("factor", [1e-300, 1e-3, 1e300])
def test_envelopes_do_not_depend_on_scale(rng, factor):
    samples = rng.normal(size=500)
    found = band_envelopes(factor * samples, 32, 16, 4)
    assert_allclose(found, band_envelopes(samples, 32, 16, 4), rtol=1e-9)


@pytest.mark.parametrize("value", [0.0, 5.0])
def test_envelopes_of_a_constant_are_zero(value):
    assert_array_equal(band_envelopes(np.full(100, value), 16, 8, 4), 0)


def test_envelopes_have_a_floor_of_1e_14_of_the_power_of_the_signal(rng):
    # A low tone, whose leakage falls below the weak noise far from it.
    frame, k = 4096, np.arange(16 * 4096)
    samples = 100 * np.sin(2 * np.pi * 8 / frame * k) + 1e-5 * rng.normal(size=len(k))
    unit = samples - samples.mean()
    window = np.sin(np.pi * np.arange(1, frame + 1) / (frame + 1)) ** 2
    power = np.abs(np.fft.fft(unit.reshape(16, frame) * window)[:, 1 : frame // 2]) ** 2
    mean, floor = power.mean(axis=0), 1e-14 * frame * np.mean(unit**2)
    top = np.array_split(np.arange(len(mean)), 4)[3]
    assert 0.1 < mean[top].mean() / floor < 10
    expected = (power[:, top] / (mean[top] + floor)).mean(axis=1)
    assert_allclose(band_envelopes(samples, frame, frame, 4)[3], expected, rtol=1e-6)


def hann(length):
    return windows.hann(length + 2)[1:-1]


# A turn of 1000 samples and frames of 64: half a cycle a hop of 32 is order 15.6.
@pytest.mark.parametrize(
    ("frame", "max_order", "hop"),
    [
        (64, 1, 32),
        (64, 15, 32),
        (64, 15.625, 32),
        (64, 16, 16),
        (64, 31, 16),
        (64, 32, 8),
        (64, 1e6, 8),
        (8, 1e6, 1),
        (6, 1e6, 1),
    ],
)
def test_frames_overlap_as_much_as_the_highest_order_needs(rng, frame, max_order, hop):
    samples = rng.normal(size=2000)
    envelopes, step = envelopes_over_angle(samples, 1000.0, frame, 2, max_order)
    assert step == hop / 1000
    assert_array_equal(envelopes, band_envelopes(samples, frame, hop, 2))


def test_a_signal_of_less_than_32_samples_has_one_value(rng):
    envelopes, step = envelopes_over_angle(rng.normal(size=31), 10.0, 64, 3, 5)
    assert_array_equal(envelopes, np.zeros((3, 1)))
    log_power, cell = order_spectrum(envelopes, step, 10)
    assert_array_equal(log_power, np.zeros((3, 1)))
    assert (step, cell) == (1.0, 1.0)
    # Frames of four samples, two apart.
    assert envelopes_over_angle(rng.normal(size=32), 10.0, 64, 3, 2)[0].shape == (3, 15)


@pytest.mark.parametrize(("n_turns", "n_segment"), [(5, 25), (1e9, 100), (0.01, 2)])
def test_segments_hold_so_many_turns_as_far_as_there_are_values(
    rng, n_turns, n_segment
):
    envelopes = 1 + 0.1 * rng.normal(size=(2, 100))
    log_power, cell = order_spectrum(envelopes, 0.2, n_turns)
    assert cell == pytest.approx(1 / (4 * n_segment * 0.2))
    expected, step = order_spectrum(envelopes, 1.0, n_segment)
    assert_array_equal(log_power, expected)
    assert cell == pytest.approx(step / 0.2)
    assert order_spectrum(envelopes[:, :2], 0.2, n_turns)[0].shape[1] > 1


@some_examples
@given(
    generators,
    st.integers(40, 200),
    st.integers(4, 40),
    st.integers(1, 40),
    st.integers(1, 5),
)
def test_envelopes_of_bands(rng, n_samples, frame, hop, n_bands):
    samples = rng.normal(size=n_samples).cumsum()
    found = order_spectra.band_envelopes(samples, frame, hop, n_bands)
    centred = samples - samples.mean()
    frames = sliding_window_view(centred, frame)[::hop]
    power = np.abs(np.fft.fft(frames * hann(frame))[:, 1 : max(frame // 2, 2)]) ** 2
    share = power / (power.mean(axis=0) + 1e-14 * frame * np.mean(centred**2))
    # The first bands get the frequencies that remain.
    for band, expected in zip(
        found, np.array_split(share, n_bands, axis=1), strict=True
    ):
        mean = expected.sum(axis=1) / max(expected.shape[1], 1)
        assert_allclose(band, mean, rtol=1e-6, atol=1e-12)


@some_examples
@given(generators, st.integers(2, 120), st.floats(0.01, 2), shares)
def test_order_spectra(rng, n_values, step, share):
    envelopes = 1 + rng.exponential(size=(2, n_values))
    n_segment = 2 + int(share * (n_values - 2))
    log_power, cell = order_spectra.order_spectrum(envelopes, step, n_segment * step)
    last = log_power.shape[1] - 1
    assert cell * last == pytest.approx(0.5 / step) and last >= 2 * n_segment
    overlap = n_segment - math.ceil(n_segment / 4)
    segments = {"window": hann(n_segment), "noverlap": overlap, "nfft": 2 * last}
    expected = welch(envelopes, **segments)[1]
    assert_allclose(log_power, np.log(expected + 1e-9), atol=1e-6)


@some_examples
@given(generators, st.integers(1, 3), st.integers(2, 50), st.floats(0.05, 0.5))
def test_spectra_at_orders_and_their_distances(rng, n_bands, n_frequencies, step):
    log_power = walk(rng, n_bands, n_frequencies)
    orders, factors = np.sort(rng.uniform(0.1, 10, 8)), rng.uniform(0.5, 2, 3)
    references = rng.normal(size=(2, n_bands, 8))
    variances = rng.uniform(0.5, 2, (n_bands, 8))
    found, inside = order_spectra.at_orders(log_power, step, orders, factors)
    distances = order_spectra.distances(found, inside, references, variances)
    for f, factor in enumerate(factors):
        places = factor * orders / step
        shown = places <= n_frequencies - 1
        assert_array_equal(inside[f], shown)
        expected = np.zeros((n_bands, 8))
        literal = np.ones(2)
        if shown.any():
            cells = np.arange(n_frequencies)
            values = [np.interp(places[shown], cells, band) for band in log_power]
            expected[:, shown] = values - np.median(values, axis=1, keepdims=True)
            squares = (expected - references) ** 2 / variances
            literal = np.sqrt(squares[..., shown].mean(axis=(1, 2)))
        assert_allclose(found[f], expected, atol=1e-9)
        assert_allclose(distances[f], literal, rtol=1e-7)


@some_examples
@given(generators, st.integers(2, 12), st.integers(1, 12))
def test_equal_angles(rng, n_frames, hop):
    frame = 2 * hop
    turn = rng.uniform(20, 40, size=(n_frames - 1) * hop + frame)
    envelopes = rng.exponential(size=(2, n_frames))
    found, step = order_spectra.equal_angles(envelopes, turn, frame, hop)
    centres = np.arange(n_frames) * hop + (frame - 1) / 2
    at = np.interp(centres, np.arange(len(turn)), np.cumsum(1 / turn))
    assert step == pytest.approx((at[-1] - at[0]) / (n_frames - 1))
    places = np.linspace(at[0], at[-1], n_frames)
    expected = [np.interp(places, at, envelope) for envelope in envelopes]
    assert_allclose(found, expected, atol=1e-9)


@some_examples
@given(generators, st.integers(10, 60), st.floats(0, 0.3))
def test_match(rng, n_values, deviation):
    envelopes, step = 1 + rng.exponential(size=(2, n_values)), 0.05
    orders, n_turns = np.linspace(0.5, 6, 12), n_values * step / 2
    references, variances = rng.normal(size=(3, 2, 12)), rng.uniform(0.5, 2, (2, 12))
    least, factors, closest = order_spectra.match(
        envelopes, step, n_turns, orders, deviation, references, variances
    )
    # Groups of factors, each as wide as 0.4 at most, with steps of 0.02 from its
    # middle.
    n_groups = next(n for n in range(1, 9) if 4 * deviation / n <= 0.4 + 1e-9)
    tried = []
    for group in range(n_groups):
        centre = 2 * deviation * ((2 * group + 1) / n_groups - 1)
        log_power, cell = order_spectra.order_spectrum(
            envelopes, step * math.exp(centre), n_turns
        )
        n_steps = math.floor(2 * deviation / n_groups / 0.02 + 1e-9)
        for number in range(-n_steps, n_steps + 1):
            near = np.array([math.exp(0.02 * number)])
            spectra_, inside = order_spectra.at_orders(log_power, cell, orders, near)
            away = order_spectra.distances(spectra_, inside, references, variances)[0]
            log = centre + 0.02 * number
            unlikely = (log / deviation) ** 2 / 50 if deviation > 0 else 0.0
            tried.append((np.sqrt(away**2 + unlikely), math.exp(log), spectra_[0]))
    for c in range(3):
        residual, factor, spectrum = min(tried, key=lambda each: each[0][c])
        assert least[c] == pytest.approx(residual[c])
        assert factors[c] == pytest.approx(factor)
        assert_allclose(closest[c], spectrum)
