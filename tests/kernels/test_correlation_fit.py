import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag.kernels.correlation_fit import best_fits, impulse_responses, state_correlations
from skarxlag.kernels.pole_search import correlations

LAYOUTS = [
    ([5], [0.4]),
    ([5], [0.0]),
    ([3], [-0.95]),
    ([2], [0.999]),
    ([32], [0.3]),
    ([4, 3], [0.4, -0.3]),
    ([4, 3], [0.4, 0.4]),
    ([2, 6], [0.9, 0.2]),
    ([2, 1, 3], [0.0, 0.9, -0.5]),
]


def coloured(n_windows, n_channels, n_samples, seed=0):
    noise = np.random.default_rng(seed).normal(size=(n_windows, n_channels, n_samples))
    return lfilter([1], [1, -0.9], noise) + 0.3 * noise


def settled(signal, pole):
    """The signal, followed by zeros until a network of this pole has forgotten it."""
    return np.append(signal, np.zeros(100 + int(40 * (1 + abs(pole)) / (1 - abs(pole)))))


def states_of(signal, order, pole):
    """States of one network, filter by filter."""
    state = lfilter([0, np.sqrt(1 - pole**2)], [1, -pole], signal)
    states = [state]
    for _ in range(order - 1):
        state = lfilter([-pole, 1], [1, -pole], state)
        states.append(state)
    return np.array(states)


def literal_sums(windows, orders, poles):
    """Gram matrix, cross vector and power from the states on zero-padded windows."""
    longest = max(poles, key=abs)
    total = 0.0
    for window in windows:
        channels = [settled(signal, longest) for signal in window]
        rows = [states_of(s, n, p) for s, n, p in zip(channels, orders, poles, strict=True)]
        regressor = np.concatenate([*rows, channels[:1]])
        total = total + regressor @ regressor.T
    return total[:-1, :-1], total[:-1, -1], total[-1, -1]


def fits(windows_of_models, orders, poles, alpha):
    found = np.array([correlations(windows) for windows in windows_of_models])
    power = found[:, 0, 0, found.shape[-1] // 2].copy()
    orders, poles = np.array(orders), np.array(poles, dtype=float)
    return best_fits(state_correlations(found, orders, poles), power, orders, poles, alpha)


@pytest.mark.parametrize(("order", "pole"), [(1, 0.0), (4, 0.6), (32, -0.3), (64, 0.9)])
def test_impulse_responses_are_orthonormal_and_last_as_long_as_they_are_heard(order, pole):
    responses = impulse_responses(order, pole, 10**6)
    np.testing.assert_allclose(responses.T @ responses, np.eye(order + 1), atol=1e-12)
    assert np.all(np.abs(responses[-1]) < 1e-11) or pole == 0
    impulse = np.zeros(len(responses) + 1)
    impulse[0] = 1
    expected = states_of(impulse, order + 1, pole)[:, 1:].T
    np.testing.assert_allclose(responses, expected, atol=1e-12)
    assert len(impulse_responses(order, pole, 9)) == (4 if order == 1 else 12)


def test_correlations_of_states_have_an_entry_for_each_state_and_channel():
    sums = state_correlations(np.ones((3, 2, 2, 9)), np.array([5, 2]), np.array([0.4, 0.0]))
    assert sums.shape == (3, 2, 3, 6)


@pytest.mark.parametrize("n_samples", [1, 3, 40, 700])
@pytest.mark.parametrize(("orders", "poles"), LAYOUTS, ids=str)
def test_fits_are_those_of_states_on_padded_windows(orders, poles, n_samples):
    models = [coloured(3, len(orders), n_samples, seed) for seed in range(2)]
    coef, error, _ = fits(models, orders, poles, alpha=1e-3)
    expected_error = 0.0
    for m, windows in enumerate(models):
        gram, cross, power = literal_sums(windows, orders, poles)
        expected = np.linalg.solve(gram + 1e-3 * np.eye(len(gram)), cross)
        np.testing.assert_allclose(coef[m], expected, rtol=1e-8, atol=1e-11)
        expected_error += 1 - cross @ expected / power
    assert error == pytest.approx(expected_error, rel=1e-9)


@pytest.mark.parametrize("alpha", [1e-6, 10.0])
@pytest.mark.parametrize(("orders", "poles"), LAYOUTS, ids=str)
def test_slopes_are_derivatives_of_the_error(orders, poles, alpha):
    models = [coloured(2, len(orders), 300, seed) for seed in range(2)]
    _, _, slopes = fits(models, orders, poles, alpha)
    for channel in range(len(orders)):
        around = []
        for step in (-1e-5, 1e-5):
            moved = np.array(poles, dtype=float)
            moved[channel] = np.tanh(np.arctanh(moved[channel]) + step)
            around.append(fits(models, orders, moved, alpha)[1])
        difference = (around[1] - around[0]) / 2e-5
        assert slopes[channel] == pytest.approx(difference, rel=1e-5, abs=1e-8)


def test_each_model_counts_as_a_share_of_its_own_power():
    windows = coloured(2, 1, 200)
    _, one, slope = fits([windows], [4], [0.2], 0.0)
    _, two, slopes = fits([windows, 1e-3 * windows], [4], [0.2], 0.0)
    assert two == pytest.approx(2 * one, rel=1e-9)
    np.testing.assert_allclose(slopes, 2 * slope, rtol=1e-7)


@pytest.mark.parametrize("scale", [1e-120, 1e120])
def test_scale_does_not_matter_without_a_ridge(scale):
    windows = coloured(2, 2, 200)
    coef, error, _ = fits([windows], [3, 2], [0.2, 0.5], 0.0)
    scaled, same_error, _ = fits([scale * windows], [3, 2], [0.2, 0.5], 0.0)
    np.testing.assert_allclose(scaled, coef, rtol=1e-9)
    assert same_error == pytest.approx(error, rel=1e-9)


def test_an_output_without_power_has_no_error():
    silent, heard = np.zeros((2, 1, 50)), coloured(2, 1, 50)
    coef, error, slopes = fits([silent, heard], [3], [0.2], 1e-6)
    np.testing.assert_array_equal(coef[0], 0)
    assert error == fits([heard], [3], [0.2], 1e-6)[1]
    assert np.all(np.isfinite(slopes))


# With the second pole, and where the sign alternates, neighbouring states of the network are
# correlated negatively.
@pytest.mark.parametrize(("pole", "ratio"), [(0.2, 1), (0.95, 1), (0.0, -1)])
@pytest.mark.parametrize("second", ["silent", "the output again"])
def test_states_that_others_determine_get_no_coefficients(second, pole, ratio):
    windows = coloured(2, 2, 200) * float(ratio) ** np.arange(200)
    windows[:, 1] = 0 if second == "silent" else windows[:, 0]
    coef, error, slopes = fits([windows], [3, 3], [pole, pole], 0.0)
    alone, expected, _ = fits([windows[:, :1]], [3], [pole], 0.0)
    np.testing.assert_allclose(coef[0], [*alone[0], 0, 0, 0], rtol=1e-6, atol=1e-12)
    assert error == pytest.approx(expected, rel=1e-9)
    assert np.all(np.isfinite(slopes))
