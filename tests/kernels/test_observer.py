import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import linalg
from scipy.signal import lfilter

from skarxlag.kernels import observer
from skarxlag.kernels.laguerre import laguerre_matrices
from skarxlag.kernels.lanes import LANES, TILE
from skarxlag.kernels.observer import common_lyapunov, loop_matrix

PIO = (0.4, 0.3, 0.06, 0.0, 1.0, 1.0, 0.0)
EXTENDED = (0.4, 0.3, 0.03, 0.02, 2.0, 1.5, 1.2)

#: Of the gains at the two ends of a sector.
SHARES = np.array([0, 0.2, 0.5, 0.9, 1])[:, np.newaxis, np.newaxis]


def observe(signals, *loop):
    """Errors and fault estimates of one model on each signal."""
    return [
        path[:, 0] for path in observer.observe(signals[:, np.newaxis], tuple(loop))
    ]


def literal_observer(signal, pole, kp, ki_a, ki_b, gain, exponent, saturation):
    """The recursion of Form A on one signal, one sample after another."""
    correction = integral = estimate = 0.0
    errors, estimates = [], []
    for sample in signal:
        e = sample - correction
        errors.append(e)
        estimates.append(estimate)
        correction = pole * correction + kp * e + estimate
        surface = min(abs(integral + ki_b * e), saturation)
        integral = integral + ki_a * e
        estimate = gain * (1 + surface**exponent) * integral
    return errors, estimates


@pytest.mark.parametrize("constants", [PIO, EXTENDED], ids=["PIO", "extended"])
@pytest.mark.parametrize("n_windows", [1, LANES - 1, LANES, LANES + 3])
@pytest.mark.parametrize("n_samples", [1, TILE, 2 * TILE + 5])
def test_blocks_leave_every_signal_to_itself(constants, n_windows, n_samples):
    innovations = np.random.default_rng(0).normal(size=(n_windows, 2, n_samples))
    error, estimate = observer.observe(innovations, constants)
    for w in range(n_windows):
        for c in range(2):
            literal = literal_observer(innovations[w, c], *constants)
            assert_allclose((error[w, c], estimate[w, c]), literal, atol=1e-12)
            alone = observer.observe(
                innovations[w : w + 1, c : c + 1].copy(), constants
            )
            assert_array_equal(
                (error[w, c], estimate[w, c]), np.ravel(alone).reshape(2, -1)
            )


def full_state_observer(y, inputs, A, b_y, b_u, coef, constants):
    """Eqs. (17)-(20), repaired, on all Laguerre states, with y_hat where the paper has it."""
    pole, kp, ki_a, ki_b, gain, exponent, saturation = constants
    # g with coef'(zI - A)^-1 g = 1/(z - pole): its Markov parameters are pole^k.
    n = len(A)
    markov = np.array([coef @ np.linalg.matrix_power(A, k) for k in range(2 * n)])
    g = np.linalg.lstsq(markov, pole ** np.arange(2.0 * n), rcond=None)[0]
    assert_allclose(markov @ g, pole ** np.arange(2.0 * n), atol=1e-9)
    E, K_p = g, b_y + kp * g
    x, integral, estimate = np.zeros(n), 0.0, 0.0
    errors = []
    for k in range(len(y)):
        y_hat = coef @ x
        e = y[k] - y_hat
        errors.append(e)
        x = A @ x + b_y * y_hat + b_u @ inputs[:, k] + E * estimate + K_p * e
        S = integral + ki_b * e
        integral = integral + ki_a * e
        estimate = gain * (1 + min(abs(S), saturation) ** exponent) * integral
    return np.array(errors)


@pytest.mark.parametrize("constants", [PIO, EXTENDED], ids=["PIO", "extended"])
@pytest.mark.parametrize("order", [1, 2, 4])
@pytest.mark.parametrize("pole", [-0.6, 0.0, 0.4])
@pytest.mark.parametrize("input_pole", [None, 0.7, "same"])
def test_full_state_observer_obeys_the_scalar_recursion(
    constants, order, pole, input_pole
):
    rng = np.random.default_rng(order)
    constants = (pole, *constants[1:])
    A, b_y = laguerre_matrices(order, pole)
    b_u = np.zeros((order, 0))
    if input_pole is not None:
        A_u, b = laguerre_matrices(2, pole if input_pole == "same" else input_pole)
        A = np.block([[A, np.zeros((order, 2))], [np.zeros((2, order)), A_u]])
        b_y = np.append(b_y, [0, 0])
        b_u = np.append(np.zeros(order), b)[:, np.newaxis]
    coef = rng.uniform(0.3, 0.6, size=len(A)) * rng.choice([-1, 1], size=len(A))
    y, inputs = rng.normal(size=150), rng.normal(size=(b_u.shape[1], 150))
    x, innovations = np.zeros(len(A)), []
    for k in range(len(y)):
        innovations.append(y[k] - coef @ x)
        x = A @ x + b_y * y[k] + b_u @ inputs[:, k]
    expected = full_state_observer(y, inputs, A, b_y, b_u, coef, constants)
    error, _ = observe(np.array([innovations]), *constants)
    assert_allclose(error[0], expected, atol=1e-10)


@pytest.mark.parametrize("pole", [-0.5, 0.0, 0.8])
def test_linear_observer_is_its_transfer_function(pole):
    _, kp, ki, *rest = PIO
    innovations = np.random.default_rng(0).normal(size=(3, 400))
    error, estimate = observe(innovations, pole, kp, ki, *rest)
    denominator = [1, -(1 + pole - kp), pole - kp + ki]
    assert_allclose(
        error, lfilter([1, -(1 + pole), pole], denominator, innovations), atol=1e-11
    )
    assert_allclose(estimate, lfilter([0, ki], [1, -1], error), atol=1e-11)


def test_extended_observer_by_hand():
    error, estimate = observe(
        np.array([[1.0, 0.0, 0.0]]), 0.5, 0.25, 0.5, 1.0, 2.0, 1.0, 0.75
    )
    # k=0: e=1, c=.25, S=1 clipped to .75, p=.5, d=2*1.75*.5=1.75
    # k=1: e=-.25, c=.125-.0625+1.75=1.8125, S=.25, p=.375, d=2*1.25*.375=.9375
    assert_array_equal(error, [[1.0, -0.25, -1.8125]])
    assert_array_equal(estimate, [[0.0, 1.75, 0.9375]])


def test_without_nonlinearity_the_extended_observer_is_linear():
    innovations = np.random.default_rng(0).normal(size=(2, 200))
    linear = observe(innovations, *PIO)
    assert_array_equal(observe(innovations, 0.4, 0.3, 0.06, 9.0, 1.0, 2.0, 0.0), linear)
    # Kc is redundant with the integral gain.
    scaled = observe(innovations, 0.4, 0.3, 0.03, 9.0, 2.0, 2.0, 0.0)
    assert_allclose(scaled, linear, atol=1e-12)


@pytest.mark.parametrize("fault", [0.05, -0.05, 0.5, -2.0, 5.0, -40.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("gain", [1.0, 2.0])
def test_form_a_is_unbiased_for_a_constant_fault(fault, exponent, gain):
    pole = 0.3
    innovations = lfilter([0, 1], [1, -pole], np.full((1, 4000), fault))
    error, estimate = observe(innovations, pole, 0.1, 0.025, 0.025, gain, exponent, 1.0)
    assert estimate[0, -1] == pytest.approx(fault, rel=1e-6)
    assert abs(error[0, -1]) < 1e-6 * abs(fault)


def test_gain_grows_with_the_fault():
    settling = []
    for fault in (0.05, 0.5, 5.0):
        innovations = lfilter([0, 1], [1, -0.3], np.full((1, 2000), fault))
        _, estimate = observe(innovations, 0.3, 0.3, 0.01, 0.01, 1.0, 1.0, 5.0)
        settling.append(
            np.flatnonzero(np.abs(estimate[0] - fault) > 0.05 * fault).max()
        )
    assert settling[0] > settling[1] > settling[2]
    assert settling[0] > 2 * settling[2]


@pytest.fixture(scope="module")
def random_loops():
    rng = np.random.default_rng(0)
    loops = []
    for _ in range(250):
        pole, kp = rng.uniform(-0.95, 0.95), rng.uniform(-0.5, 1.5)
        ki, low = rng.uniform(0, 0.6), rng.uniform(0.2, 2)
        loops.append((pole - kp, ki, low, low * (1 + rng.uniform(0.05, 4))))
    return loops


def test_common_lyapunov_function_is_the_circle_criterion(random_loops):
    z = np.exp(1j * np.linspace(0, np.pi, 2001))
    verdicts = []
    for a, ki, low, high in random_loops:
        loops = loop_matrix(a, 0.0, ki, low), loop_matrix(a, 0.0, ki, high)
        plant = (z - a) * (z - 1)
        slow_is_stable = np.abs(np.roots([1, -(1 + a), a + ki * low])).max() < 1
        real_part = np.real((plant + high * ki) / (plant + low * ki)).min()
        if abs(real_part) < 2e-3:
            continue
        P = common_lyapunov(*loops)
        assert (P is not None) == (slow_is_stable and real_part > 0), (a, ki, low, high)
        verdicts.append(P is not None)
        if P is not None:
            assert np.linalg.eigvalsh(P)[0] > 0
            A = (1 - SHARES) * loops[0] + SHARES * loops[1]
            assert np.linalg.eigvalsh(A.transpose(0, 2, 1) @ P @ A - P).max() < 0
    assert min(np.mean(verdicts), 1 - np.mean(verdicts)) > 0.1


def test_equal_ends_need_only_a_stable_loop():
    stable, unstable = loop_matrix(0.3, 0.1, 0.05), loop_matrix(0.3, 0.1, 3.0)
    assert common_lyapunov(stable, stable) is not None
    assert common_lyapunov(unstable, unstable) is None
    # An integral that nothing feeds stays where it is: stable, but not asymptotically.
    idle = loop_matrix(0.3, 0.1, 0.0)
    assert_array_equal(idle, [[0.3 - 0.1, 1.0], [0.0, 1.0]])
    assert common_lyapunov(idle, idle) is None


@pytest.mark.parametrize(
    "wrong",
    [
        -np.eye(2),  # not positive definite
        np.diag([1.0, -1e-3]),  # positive in one direction only
        np.zeros((2, 2)),
        np.diag([1.0, 100.0]),  # positive definite, but the energy of a loop may grow
    ],
)
def test_solution_that_certifies_nothing_is_not_returned(monkeypatch, wrong):
    loops = loop_matrix(0.0, 0.5, 0.1), loop_matrix(0.0, 0.5, 0.1, 2.0)
    right = common_lyapunov(*loops)
    monkeypatch.setattr(observer.linalg, "solve_discrete_are", lambda *_, **__: -wrong)
    assert common_lyapunov(*loops) is None
    monkeypatch.setattr(observer.linalg, "solve_discrete_are", lambda *_, **__: -right)
    assert_array_equal(common_lyapunov(*loops), right)


def test_each_of_the_two_loops_is_looked_at(monkeypatch):
    slow, fast = loop_matrix(0.0, 0.5, 0.1), loop_matrix(0.0, 0.5, 0.1, 4.0)
    for own, other in ((slow, fast), (fast, slow)):
        # Barely a certificate of one loop alone.
        P = linalg.solve_discrete_lyapunov(own.T, np.diag([1e-9, 1.0]))
        assert np.linalg.eigvalsh(own.T @ P @ own - P)[-1] < 0
        assert np.linalg.eigvalsh(other.T @ P @ other - P)[-1] > 0
        monkeypatch.setattr(
            observer.linalg, "solve_discrete_are", lambda *_, P=P, **__: -P
        )
        assert common_lyapunov(slow, fast) is None


def test_loop_matrix_is_the_loop_of_the_kernel():
    pole, kp, ki, gain = 0.4, 0.3, 0.05, 1.7
    innovations = np.zeros((1, 30))
    innovations[0, 0] = 1.0
    _, estimate = observe(innovations, pole, kp, ki, 0.0, gain, 1.0, 0.0)
    state = np.array([kp, ki])
    A = loop_matrix(pole, kp, ki, gain)
    for k in range(1, 30):
        assert estimate[0, k] == pytest.approx(gain * state[1], abs=1e-12)
        state = A @ state


def test_certified_loops_stay_bounded_under_any_sequence_of_gains(random_loops):
    rng = np.random.default_rng(1)
    n_certified = 0
    for a, ki, *gains in random_loops:
        ends = [loop_matrix(a, 0.0, ki, gain) for gain in gains]
        P = common_lyapunov(*ends)
        if P is not None:
            n_certified += 1
            x = rng.normal(size=2)
            for end in rng.integers(2, size=100):
                energy = x @ P @ x
                x = ends[end] @ x
                assert x @ P @ x <= energy * (1 + 1e-12)
    assert n_certified > 20
