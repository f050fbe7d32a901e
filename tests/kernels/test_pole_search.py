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


@pytest.mark.parametrize(
    ("n_samples", "length"),
    [(1, 1), (2, 2), (7, 7), (64, 64), (65, 33), (128, 64), (500, 63)],
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


@pytest.mark.parametrize("of_input", [0.8, 0.95])
def test_search_finds_the_pole_of_each_channel(of_input):
    windows = simulated([1, 2], [0.3, of_input], [0.5, 1.0, -1.0], 20_000, noise=0.2)
    for given in ([None, None], [0.3, None], [None, of_input]):
        found = poles_of(windows, [1, 2], given)
        assert_allclose(found, [0.3, of_input], atol=0.03)
    assert poles_of(windows, [1, 2], [0.25, None])[0] == 0.25


def test_poles_given_for_every_other_channel_may_be_slow():
    windows = simulated([1, 2], [0.3, 0.8], [0.5, 1.0, -1.0], 5_000, noise=0.2)
    found = poles_of(windows, [1, 2], [0.99999, None])
    assert found[0] == 0.99999
    assert abs(found[1]) <= LARGEST_POLE


@pytest.mark.parametrize(
    ("order", "alpha"), [(1, 1e-6), (6, 1e-6), (32, 1e-6), (6, 1e4)]
)
def test_search_is_no_worse_than_a_fine_grid(order, alpha):
    noise = np.random.default_rng(0).normal(size=(3, 1, 2000))
    windows = lfilter([1], [1, -1.6, 0.9], noise)
    spectra = cross_spectra(windows)[np.newaxis]
    found = search_poles(spectra, [order], [None], alpha)

    def error(pole):
        return fit_errors(spectra, [order], [pole], alpha)[0]

    near = np.clip(found + np.linspace(-0.01, 0.01, 41), -0.98, 0.98)
    assert error(found[0]) <= min(map(error, near)) * (1 + 1e-9)
    # Between the starts of the search the error of a high order has ripples of this
    # size.
    best = min(map(error, np.linspace(-0.97, 0.97, 195)))
    assert error(found[0]) <= best * (1 + 1e-4)


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


@pytest.mark.parametrize(
    ("order", "n_samples", "largest"),
    [(1, 20, 19 / 21), (5, 20, 15 / 25), (30, 20, 0.0), (1, 10_000, 0.98)],
)
def test_poles_end_where_a_network_settles_within_a_window(
    order, n_samples, largest, monkeypatch
):
    # The slower, the better.
    monkeypatch.setattr(pole_search, "fit_errors", lambda *given: -np.array(given[2]))
    spectra = np.ones((1, 1, 1, n_samples + 1))
    assert search_poles(spectra, [order], [None], 0.0)[0] == pytest.approx(largest)
