import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from skarxlag.kernels.arx_laguerre import accumulate_sums
from skarxlag.kernels.laguerre import laguerre_matrices
from skarxlag.kernels.least_squares import solve_sums
from skarxlag.kernels.pole_search import (
    N_FREQUENCIES,
    closed_form_pole,
    cross_spectra,
    fit_spectrum,
    search_poles,
)
from skarxlag.kernels.spectra import frequency_grid


def test_frequency_grid_has_the_midpoints_of_equal_cells():
    np.testing.assert_allclose(frequency_grid(2), [np.pi / 4, 3 * np.pi / 4])


@pytest.mark.parametrize(("n_samples", "times"), [(1, 1), (50, 1), (1024, 1), (1025, 2), (5000, 5)])
def test_cross_spectra_are_cell_means_of_the_periodogram(n_samples, times):
    windows = np.random.default_rng(0).normal(size=(2, 2, n_samples))
    cells = [0, 1, 500, N_FREQUENCIES - 1]
    within = frequency_grid(N_FREQUENCIES * times).reshape(N_FREQUENCIES, times)[cells]
    waves = np.exp(-1j * within[..., np.newaxis] * np.arange(n_samples))
    transform = np.einsum("wan,ctn->wact", windows, waves)
    expected = np.einsum("wact,wbct->abct", transform, transform.conj()).mean(axis=-1)
    found = cross_spectra(windows)
    # What a search costs does not depend on how long or how many the windows are.
    assert found.shape == (2, 2, N_FREQUENCIES)
    np.testing.assert_allclose(found[..., cells], expected, atol=1e-9 * n_samples)


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


def test_sums_of_spectra_are_sums_in_time():
    # Parseval, and so the same ridge as in the fit.
    windows = np.random.default_rng(0).normal(size=(3, 1, 1500))
    assert cross_spectra(windows).real.mean() == pytest.approx(np.sum(windows**2), rel=1e-9)
    for alpha in (1e3, 1e5):
        sums = accumulate_sums(windows, np.ones(3), np.array([4]), np.array([0.3]), 0)
        found, _ = fit_spectrum(cross_spectra(windows), [4], [0.3], alpha)
        np.testing.assert_allclose(found, solve_sums(sums, alpha)[0], rtol=0.05, atol=1e-4)


@pytest.mark.parametrize("orders_poles", [([4], [0.5]), ([3, 2], [0.2, 0.7])], ids=str)
def test_error_from_spectra_is_near_the_one_in_time(orders_poles):
    orders, poles = orders_poles
    coef = [0.5, -0.3, 0.2, 0.1] if len(orders) == 1 else [0.5, -0.3, 0.2, 0.4, 0.3]
    windows = simulated(orders, poles, coef, 20_000)
    for tried in (poles, [0.0] * len(orders)):
        sums = accumulate_sums(windows, np.ones(1), np.array(orders), np.array(tried), 0)
        expected, error = solve_sums(sums, 1e-6)
        found, share = fit_spectrum(cross_spectra(windows), orders, tried, 1e-6)
        np.testing.assert_allclose(found, expected, atol=2e-3)
        assert share == pytest.approx(error / windows.shape[-1], rel=1e-3)


def test_silent_windows_have_no_error_and_a_pole():
    spectra = np.zeros((1, 1, 1, N_FREQUENCIES), dtype=complex)
    coef, share = fit_spectrum(spectra[0], [3], [0.2], 1e-6)
    np.testing.assert_array_equal(coef, 0)
    assert share == 0
    assert -1 < search_poles(spectra, [3], [None], 1e-6)[0] < 1


def poles_of(windows, orders, given):
    return search_poles(cross_spectra(windows)[np.newaxis], orders, given, 1e-6)


@pytest.mark.parametrize(
    ("pole", "coef"), [(-0.6, [0.3, -0.3]), (0.4, [-0.4, 0.4]), (0.8, [-0.4, 0.4])]
)
def test_search_finds_the_pole_of_a_laguerre_system(pole, coef):
    windows = simulated([2], [pole], coef, 20_000)
    assert poles_of(windows, [2], [None])[0] == pytest.approx(pole, abs=0.04)


def test_search_finds_the_pole_of_each_channel():
    windows = simulated([1, 2], [0.3, 0.8], [0.5, 1.0, -1.0], 20_000, noise=0.2)
    np.testing.assert_allclose(poles_of(windows, [1, 2], [None, None]), [0.3, 0.8], atol=0.03)
    np.testing.assert_allclose(poles_of(windows, [1, 2], [0.3, None]), [0.3, 0.8], atol=0.03)
    assert poles_of(windows, [1, 2], [0.25, None])[0] == 0.25


def test_search_is_no_worse_than_a_fine_grid():
    noise = np.random.default_rng(0).normal(size=(3, 1, 2000))
    windows = lfilter([1], [1, -1.6, 0.9], noise)
    spectra = cross_spectra(windows)[np.newaxis]
    found = search_poles(spectra, [6], [None], 1e-6)
    grid = np.linspace(-0.97, 0.97, 195)
    best = min(fit_spectrum(spectra[0], [6], [pole], 1e-6)[1] for pole in grid)
    assert fit_spectrum(spectra[0], [6], found, 1e-6)[1] <= best * (1 + 1e-6)


@pytest.mark.parametrize("pole", [-0.8, -0.2, 0.0, 0.5, 0.9])
def test_closed_form_is_exact_for_one_pole(pole):
    taps = pole ** np.arange(400.0)
    assert closed_form_pole(taps[np.newaxis]) == pytest.approx(pole, abs=1e-9)


def test_closed_form_minimises_the_weighted_laguerre_spectrum():
    k = np.arange(120.0)
    taps = np.array([0.9**k - 0.5 * 0.5**k, 0.3 * (-0.4) ** k + 0.6**k])

    def spread(pole):
        impulse = np.zeros(400)
        impulse[0] = 1.0
        output = lfilter([np.sqrt(1 - pole**2)], [1, -pole], impulse)
        total = 0.0
        for n in range(100):
            total += n * np.sum((taps @ output[: taps.shape[1]]) ** 2)
            output = lfilter([-pole, 1], [1, -pole], output)
        return total

    brute = minimize_scalar(spread, bounds=(0, 0.95), method="bounded").x
    assert closed_form_pole(taps) == pytest.approx(brute, abs=1e-3)


def test_closed_form_without_any_response_is_zero():
    assert closed_form_pole(np.zeros((2, 5))) == 0
