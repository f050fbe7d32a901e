import numpy as np
import pytest
from scipy.linalg import block_diag

from skarxlag.kernels import arx_laguerre
from skarxlag.kernels.laguerre import laguerre_matrices

LAYOUTS = [([3], [0.4]), ([2, 3], [0.5, -0.3]), ([1, 2, 4], [0.0, 0.8, -0.7])]


def literal_states(window, orders, poles):
    """x(k+1) = A x(k) + b_y y(k) + b_u u(k), with the matrices, one sample after another."""
    blocks = [laguerre_matrices(n, p) for n, p in zip(orders, poles, strict=True)]
    A = block_diag(*[A for A, _ in blocks])
    B = block_diag(*[b[:, np.newaxis] for _, b in blocks])
    states = np.zeros((window.shape[1], len(A)))
    for k in range(window.shape[1] - 1):
        states[k + 1] = A @ states[k] + B @ window[:, k]
    return states, A, B


@pytest.fixture(params=LAYOUTS, ids=str)
def case(request):
    orders, poles = request.param
    rng = np.random.default_rng(3)
    windows = rng.normal(size=(4, len(orders), 60))
    coef = 0.2 * rng.normal(size=(2, sum(orders)))
    return windows, np.array(orders), np.array(poles, dtype=float), coef


@pytest.mark.parametrize("n_transient", [0, 7])
def test_sums_are_weighted_products_of_states_and_output(case, n_transient):
    windows, orders, poles, _ = case
    weights = np.array([1.0, 0.5, 0.0, 2.0])
    expected = 0
    for window, weight in zip(windows, weights, strict=True):
        states, _, _ = literal_states(window, orders, poles)
        both = np.column_stack([states, window[0]])[n_transient:]
        expected = expected + weight * both.T @ both
    sums = arx_laguerre.accumulate_sums(windows, weights, orders, poles, n_transient)
    np.testing.assert_allclose(np.tril(sums), np.tril(expected), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("n_transient", [0, 7])
def test_innovations_are_output_less_one_step_prediction(case, n_transient):
    windows, orders, poles, coef = case
    expected = [
        [window[0] - literal_states(window, orders, poles)[0] @ g for g in coef]
        for window in windows
    ]
    found = arx_laguerre.innovations(windows, orders, poles, coef, n_transient)
    np.testing.assert_allclose(found, np.array(expected)[..., n_transient:], atol=1e-12)


@pytest.mark.parametrize("n_start", [0, 1, 9])
def test_free_run_feeds_its_own_output_back(case, n_start):
    windows, orders, poles, coef = case
    for g in coef:
        expected = np.zeros((len(windows), windows.shape[-1]))
        for w, window in enumerate(windows):
            _, A, B = literal_states(window, orders, poles)
            x = np.zeros(len(A))
            for k in range(window.shape[1]):
                expected[w, k] = g @ x
                fed = window[:, k].copy()
                fed[0] = window[0, k] if k < n_start else expected[w, k]
                x = A @ x + B @ fed
        found = arx_laguerre.free_run(windows, orders, poles, g, n_start)
        np.testing.assert_allclose(found, expected, atol=1e-10)


def test_prediction_is_strictly_causal(case):
    windows, orders, poles, coef = case
    changed = windows.copy()
    changed[:, :, 30:] += 1.0
    before = windows[:, :1] - arx_laguerre.innovations(windows, orders, poles, coef, 0)
    after = changed[:, :1] - arx_laguerre.innovations(changed, orders, poles, coef, 0)
    np.testing.assert_allclose(after[..., :31], before[..., :31], atol=1e-12)
    assert np.abs(after - before)[..., 31].max() > 1e-3
