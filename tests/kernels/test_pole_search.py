import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from skarxlag.kernels import pole_search
from skarxlag.kernels.laguerre import laguerre_matrices, network_matrices
from skarxlag.kernels.pole_search import (
    LARGEST_POLE,
    cross_spectra,
    fit_errors,
    search_poles,
)


def literal_cross_spectra(windows):
    """Cross-spectra of windows that are followed by as many zeros."""
    n_samples = windows.shape[-1]
    angles = np.outer(
        np.arange(n_samples), np.pi * np.arange(n_samples + 1) / n_samples
    )
    spectra = windows @ np.exp(-1j * angles)
    return sum(w[:, np.newaxis] * w[np.newaxis].conj() for w in spectra)


@pytest.mark.parametrize("n_windows", [1, 70])
@pytest.mark.parametrize(
    ("n_channels", "n_samples"), [(1, 1), (1, 2), (3, 7), (2, 301)]
)
def test_cross_spectra_are_sums_of_products(n_windows, n_channels, n_samples):
    windows = np.random.default_rng(0).normal(size=(n_windows, n_channels, n_samples))
    found = cross_spectra(windows)
    assert found.shape == (n_channels, n_channels, n_samples + 1)
    assert_allclose(found, literal_cross_spectra(windows), atol=1e-9 * n_samples)


@pytest.mark.parametrize(
    ("n_samples", "length"), [(64, 64), (65, 33), (128, 64), (500, 63)]
)
def test_long_windows_are_cut_into_equal_segments(n_samples, length, monkeypatch):
    monkeypatch.setattr(pole_search, "LONGEST_SEGMENT", 64)
    windows = np.random.default_rng(0).normal(size=(2, 2, n_samples))
    n_segments = -(-n_samples // length)
    padded = np.pad(windows, ((0, 0), (0, 0), (0, n_segments * length - n_samples)))
    segments = (
        padded.reshape(2, 2, n_segments, length).swapaxes(1, 2).reshape(-1, 2, length)
    )
    found = cross_spectra(windows)
    # What a search costs does not depend on how long or how many the windows are.
    assert found.shape == (2, 2, length + 1)
    assert_allclose(found, literal_cross_spectra(segments), atol=1e-9)


def test_windows_are_cut_above_16384_samples():
    for n_samples, length in ((2**14, 2**14), (2**14 + 1, 2**13 + 1)):
        assert cross_spectra(np.ones((1, 1, n_samples))).shape == (1, 1, length + 1)


def simulated(orders, poles, coef, n_samples, seed=0, noise=1.0):
    """y(k) = coef . x(k) + e(k) with white e and white inputs, literally."""
    rng = np.random.default_rng(seed)
    blocks = [laguerre_matrices(n, p) for n, p in zip(orders, poles, strict=True)]
    coef = np.split(np.asarray(coef), np.cumsum(orders)[:-1])
    channels = rng.normal(size=(len(orders), n_samples))
    channels[0] *= noise
    states = [np.zeros(n) for n in orders]
    for k in range(n_samples):
        channels[0, k] += sum(g @ x for g, x in zip(coef, states, strict=True))
        for i, (A, b) in enumerate(blocks):
            states[i] = A @ states[i] + b * channels[i, k]
    return channels[np.newaxis] / channels[0].std()


def fit_with(windows, orders, poles, alpha=1e-6):
    """Share of the power left with these poles."""
    return fit_errors(cross_spectra(windows)[np.newaxis], orders, poles, alpha)[0]


@pytest.mark.parametrize("alpha", [1e-6, 30.0])
def test_error_is_that_of_plain_least_squares_on_padded_windows(alpha):
    rng = np.random.default_rng(0)
    windows, orders, poles = rng.normal(size=(3, 2, 200)), [3, 2], [0.4, -0.3]
    A, B = network_matrices(orders, poles)
    states, outputs = [], []
    for window in np.pad(windows, ((0, 0), (0, 0), (0, 200))):
        x = np.zeros(5)
        for sample in window.T:
            states.append(x)
            outputs.append(sample[0])
            x = A @ x + B @ sample
    states, outputs = np.array(states), np.array(outputs)
    rows = np.concatenate([states, np.sqrt(alpha) * np.eye(5)])
    _, residual, _, _ = np.linalg.lstsq(
        rows, np.concatenate([outputs, np.zeros(5)]), rcond=None
    )
    share = residual[0] / (outputs @ outputs)
    assert fit_with(windows, orders, poles, alpha) == pytest.approx(share, rel=1e-9)


def test_each_model_counts_as_a_share_of_its_own_power():
    windows = np.random.default_rng(0).normal(size=(2, 1, 1, 300))
    spectra = np.array([cross_spectra(model) for model in windows])
    expected = fit_errors(spectra, [4], [0.3], 0.0)
    for factor in (1e12, 1e-20):
        scaled = spectra * np.array([1.0, factor])[:, None, None, None]
        assert_allclose(fit_errors(scaled, [4], [0.3], 0.0), expected, rtol=1e-9)
    for alpha in (0.0, 1.0):
        assert fit_errors(0 * spectra, [4], [0.3], alpha).tolist() == [0, 0]


def test_silent_windows_and_models_do_not_move_the_poles():
    windows = lfilter(
        [1], [1, -1.6, 0.9], np.random.default_rng(0).normal(size=(3, 1, 500))
    )
    expected = search_poles(cross_spectra(windows)[np.newaxis], [4], [None], 1e-6)
    more = np.concatenate([windows, np.zeros((1, 1, 500))])
    for models in ([more], [windows, more[3:]]):
        of_models = np.array([cross_spectra(model) for model in models])
        found = search_poles(of_models, [4], [None], 1e-6)
        assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize(("n_samples", "size"), [(1, 1), (2, 1), (5, 1), (50, 0)])
def test_shortest_and_silent_windows_have_a_pole(n_samples, size):
    windows = size * np.random.default_rng(0).normal(size=(4, 2, n_samples))
    found = search_poles(cross_spectra(windows)[np.newaxis], [8, 4], [None, None], 1e-6)
    assert np.all(np.abs(found) <= LARGEST_POLE)


def poles_of(windows, orders, given):
    return search_poles(cross_spectra(windows)[np.newaxis], orders, given, 1e-6)


@pytest.mark.parametrize(
    ("pole", "coef"),
    [(-0.6, [0.3, -0.3]), (0.4, [-0.4, 0.4]), (0.8, [-0.4, 0.4]), (0.95, [-0.2, 0.25])],
)
def test_search_finds_the_pole_of_a_laguerre_system(pole, coef):
    windows = simulated([2], [pole], coef, 20_000)
    assert poles_of(windows, [2], [None])[0] == pytest.approx(pole, abs=0.04)


@pytest.mark.parametrize("of_input", [0.8, 0.95])
def test_search_finds_the_pole_of_each_channel(of_input):
    windows = simulated([1, 2], [0.3, of_input], [0.5, 1.0, -1.0], 20_000, noise=0.2)
    for given in ([None, None], [0.3, None], [None, of_input]):
        found = poles_of(windows, [1, 2], given)
        assert_allclose(found, [0.3, of_input], atol=0.03)
    assert poles_of(windows, [1, 2], [0.25, None])[0] == 0.25


def test_poles_end_at_098():
    # The output is noise and a response to the input that is slower than every pole
    # that is tried.
    noise, slow = np.random.default_rng(0).normal(size=(2, 20_000))
    windows = np.stack([noise + lfilter([0.0, 0.1], [1, -0.998], slow), slow])[
        np.newaxis
    ]
    assert poles_of(windows, [1, 1], [0.0, None])[1] == pytest.approx(0.98, abs=1e-9)


def test_networks_that_do_not_settle_within_a_segment_are_not_tried():
    slow = lfilter([1], [1, -0.999], np.random.default_rng(0).normal(size=(4, 1, 100)))
    # 32 (1 + p) / (1 - p) samples are as many as there are.
    assert abs(poles_of(slow, [32], [None])[0]) <= (100 - 32) / (100 + 32) + 1e-9


def test_poles_given_for_every_other_channel_may_be_slow():
    windows = simulated([1, 2], [0.3, 0.8], [0.5, 1.0, -1.0], 5_000, noise=0.2)
    found = poles_of(windows, [1, 2], [0.99999, None])
    assert found[0] == 0.99999
    assert abs(found[1]) <= LARGEST_POLE


@pytest.mark.parametrize("order", [1, 6, 8, 32])
def test_search_is_no_worse_than_a_fine_grid(order):
    noise = np.random.default_rng(0).normal(size=(3, 1, 2000))
    windows = lfilter([1], [1, -1.6, 0.9], noise)
    found = poles_of(windows, [order], [None])
    error = fit_with(windows, [order], found)
    near = np.clip(found + np.linspace(-0.01, 0.01, 41)[:, np.newaxis], -0.98, 0.98)
    assert error <= min(fit_with(windows, [order], p) for p in near) * (1 + 1e-9)
    # Between the starts of the search the error of a high order has ripples of this
    # size.
    best = min(fit_with(windows, [order], [p]) for p in np.linspace(-0.97, 0.97, 195))
    assert error <= best * (1 + 1e-4)


def test_the_pole_is_shared_by_all_models():
    models = [
        simulated([2], [p], [-0.4, 0.4], 5000, seed)
        for seed, p in enumerate((0.2, 0.7))
    ]
    found = np.array([cross_spectra(windows) for windows in models])
    shared = search_poles(found, [2], [None], 1e-6)
    grid = np.linspace(-0.95, 0.95, 381)
    total = [sum(fit_with(windows, [2], [p]) for windows in models) for p in grid]
    assert shared[0] == pytest.approx(grid[np.argmin(total)], abs=0.005)
    # Loudness says nothing of a model's share.
    found[0] *= 1e6
    assert_allclose(search_poles(found, [2], [None], 0.0), shared, atol=1e-3)


def test_a_ridge_enters_as_in_the_fit():
    windows = simulated([2], [0.4], [-0.4, 0.4], 2000)
    found = cross_spectra(windows)[np.newaxis]
    ridged = search_poles(found, [2], [None], 1e4)
    best = min(fit_with(windows, [2], [p], 1e4) for p in np.linspace(-0.97, 0.97, 195))
    assert fit_with(windows, [2], ridged, 1e4) <= best * (1 + 1e-6)
    assert abs(ridged[0] - search_poles(found, [2], [None], 1e-6)[0]) > 1e-3


@pytest.mark.parametrize(("order", "largest"), [(1, 19 / 21), (5, 15 / 25), (30, 0.0)])
def test_poles_end_where_a_network_settles_within_a_window(order, largest, monkeypatch):
    # The slower, the better.
    monkeypatch.setattr(pole_search, "fit_errors", lambda *given: -np.array(given[2]))
    spectra = np.ones((1, 1, 1, 21))
    assert search_poles(spectra, [order], [None], 0.0)[0] == pytest.approx(largest)


@pytest.mark.parametrize("n_channels", [1, 3])
def test_grids_are_tried_twice_if_several_poles_are_free(n_channels, monkeypatch):
    tried, best = [], np.arctanh([0.5, -0.2, 0.7])[:n_channels]

    def error_of(spectra, orders, poles, alpha):
        tried.append(np.arctanh(poles))
        return np.array([np.sum((tried[-1] - best) ** 2)])

    monkeypatch.setattr(pole_search, "fit_errors", error_of)
    orders = [7, 1, 32][:n_channels]
    spectra = np.ones((1, n_channels, n_channels, 10_001))
    found = search_poles(spectra, orders, [None] * n_channels, 0.0)
    assert_allclose(np.arctanh(found), best, atol=1e-5)
    passes = 1 if n_channels == 1 else 2
    # The error is evaluated on an even grid of each channel, with a place more for two
    # filters.
    for channel in [*range(n_channels)] * passes:
        n_places = {7: 24, 1: 21, 32: 37}[orders[channel]]
        grid, tried[:n_places] = np.array(tried[:n_places]), []
        limit = np.arctanh(LARGEST_POLE)
        assert_allclose(grid[:, channel], np.linspace(-limit, limit, n_places))
        assert all(
            len(set(others)) == 1 for others in np.delete(grid, channel, axis=1).T
        )
    # All poles are refined together from the best places.
    start = np.array(tried[: n_channels + 1])
    assert_allclose(start - start[0], np.eye(n_channels + 1, n_channels, -1) * 1e-6)
