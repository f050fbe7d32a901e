import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import block_diag

from skarxlag.kernels import arx_laguerre
from skarxlag.kernels.arx_laguerre import LANES
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


def innovations(windows, orders, poles, coef, n_transient):
    out = np.full((len(windows), len(coef), windows.shape[2] - n_transient), np.nan)
    return arx_laguerre.innovations(windows, orders, poles, coef, n_transient, out)


@pytest.fixture(params=LAYOUTS, ids=str)
def case(request):
    orders, poles = request.param
    rng = np.random.default_rng(3)
    windows = rng.normal(size=(4, len(orders), 60))
    coef = 0.2 * rng.normal(size=(2, sum(orders)))
    return windows, np.array(orders), np.array(poles, dtype=float), coef


@pytest.mark.parametrize("most_lags", [10, 2000])
@pytest.mark.parametrize("n_transient", [0, 7])
def test_sums_are_weighted_products_of_states_and_output(
    case, n_transient, most_lags, monkeypatch
):
    monkeypatch.setattr(arx_laguerre, "_MANY_LAGS", most_lags)
    windows, orders, poles, _ = case
    weights = np.array([1.0, 0.5, 0.0, 2.0])
    expected = 0
    for window, weight in zip(windows, weights, strict=True):
        states, _, _ = literal_states(window, orders, poles)
        both = np.column_stack([states, window[0]])[n_transient:]
        expected = expected + weight * both.T @ both
    parts = arx_laguerre.accumulate_sums(windows, weights, orders, poles, n_transient)
    sums = arx_laguerre.sums_of_products(*parts, orders, poles)
    assert_allclose(np.tril(sums), np.tril(expected), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("n_windows", [1, LANES - 1, LANES, LANES + 3])
@pytest.mark.parametrize("n_samples", [2, 16, 37])
@pytest.mark.parametrize("n_transient", [0, 1, 15, 17])
def test_blocks_leave_every_window_to_itself(n_windows, n_samples, n_transient):
    n_transient = min(n_transient, n_samples - 1)
    rng = np.random.default_rng(5)
    orders, poles = np.array([5, 2]), np.array([0.4, -0.3])
    windows, coef = rng.normal(size=(n_windows, 2, n_samples)), rng.normal(size=(5, 7))
    found = innovations(windows, orders, poles, coef, n_transient)
    for w, window in enumerate(windows):
        predicted = literal_states(window, orders, poles)[0] @ coef.T
        expected = (window[0][:, np.newaxis] - predicted).T[:, n_transient:]
        assert_allclose(found[w], expected, atol=1e-12)
        alone = innovations(windows[w : w + 1], orders, poles, coef, n_transient)
        assert_array_equal(found[w], alone[0])


@pytest.mark.parametrize(
    "make", [np.asfortranarray, np.float32, lambda x: x[..., ::-1][..., ::-1]]
)
def test_innovations_of_any_array_go_into_any_array(case, make):
    windows, orders, poles, coef = case
    windows = windows.astype(np.float32).astype(np.float64)
    expected = innovations(windows, orders, poles, coef, 3)
    given, out = make(windows), make(np.zeros(expected.shape))
    given.flags.writeable = False
    found = arx_laguerre.innovations(given, orders, poles, coef, 3, out)
    assert found is out
    assert_allclose(out, expected, rtol=1e-5 if out.dtype == np.float32 else 0)


@pytest.mark.parametrize("n_transient", [0, 7])
@pytest.mark.parametrize("n_samples", [2, 8, 60])  # also fewer samples than channels
def test_innovations_are_output_less_one_step_prediction(case, n_transient, n_samples):
    windows, orders, poles, coef = case
    windows, n_transient = windows[..., :n_samples], min(n_transient, n_samples - 1)
    expected = [
        [window[0] - literal_states(window, orders, poles)[0] @ g for g in coef]
        for window in windows
    ]
    found = innovations(windows, orders, poles, coef, n_transient)
    assert_allclose(found, np.array(expected)[..., n_transient:], atol=1e-12)


@pytest.mark.parametrize("n_start", [0, 1, 9])
def test_free_run_feeds_its_own_output_back(case, n_start):
    windows, orders, poles, coef = case
    found = arx_laguerre.free_run(windows, orders, poles, coef, n_start)
    for c, g in enumerate(coef):
        expected = np.zeros((len(windows), windows.shape[-1]))
        for w, window in enumerate(windows):
            _, A, B = literal_states(window, orders, poles)
            x = np.zeros(len(A))
            for k in range(window.shape[1]):
                expected[w, k] = g @ x
                fed = window[:, k].copy()
                fed[0] = window[0, k] if k < n_start else expected[w, k]
                x = A @ x + B @ fed
        assert_allclose(found[:, c], expected, atol=1e-10)
