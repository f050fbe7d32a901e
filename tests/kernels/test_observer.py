import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import lfilter

from skarxlag.kernels import observer
from skarxlag.kernels.laguerre import laguerre_matrices
from skarxlag.kernels.observer import meets_circle_criterion, spectral_radius

PIO = (0.4, 0.3, 0.06, 0.0)
EXTENDED = (0.4, 0.3, 0.06, 1.2)


def observe(signals, *loop):
    """Errors and fault estimates of one model on each signal."""
    return [
        path[:, 0] for path in observer.observe(signals[:, np.newaxis], tuple(loop))
    ]


def literal_observer(signal, pole, kp, ki, bound):
    """The recursion of Form A on one signal, one sample after another."""
    correction = integral = estimate = 0.0
    errors, estimates = [], []
    for sample in signal:
        e = sample - correction
        errors.append(e)
        estimates.append(estimate)
        correction = pole * correction + kp * e + estimate
        integral = integral + ki * e
        estimate = (1 + min(abs(integral), bound)) * integral
    return errors, estimates


@pytest.mark.parametrize("constants", [PIO, EXTENDED], ids=["PIO", "extended"])
@pytest.mark.parametrize("n_windows", [1, 15, 16, 19])
@pytest.mark.parametrize("n_samples", [1, 16, 37])
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


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1.0, 1e160, 1e300])
def test_power_levels_are_the_root_mean_square_of_the_error(size):
    innovations = np.random.default_rng(0).normal(size=(4, 2, 200))
    ordinary = observer.power_levels(innovations, PIO)
    error, _ = observer.observe(innovations, PIO)
    assert_allclose(ordinary, np.sqrt(np.mean(error**2, axis=-1)), rtol=1e-12)
    innovations[2] *= size
    levels = observer.power_levels(innovations, PIO)
    assert_array_equal(levels[[0, 1, 3]], ordinary[[0, 1, 3]])
    assert_allclose(levels[2], size * ordinary[2], rtol=1e-10)


def full_state_observer(y, inputs, A, b_y, b_u, coef, constants):
    """Eqs. (17)-(20), repaired, on all Laguerre states, with y_hat where the paper has it."""
    pole, kp, ki, bound = constants
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
        integral = integral + ki * e
        estimate = (1 + min(abs(integral), bound)) * integral
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
    error, estimate = observe(np.array([[1.0, 0.0, 0.0]]), 0.5, 0.25, 0.5, 0.375)
    # k=0: e=1, c=.25, p=.5, |p| clipped to .375, d=1.375*.5=.6875
    # k=1: e=-.25, c=.125-.0625+.6875=.75, p=.375, d=1.375*.375=.515625
    assert_array_equal(error, [[1.0, -0.25, -0.75]])
    assert_array_equal(estimate, [[0.0, 0.6875, 0.515625]])


@pytest.mark.parametrize("fault", [0.05, -0.05, 0.5, -2.0, 5.0, -40.0])
@pytest.mark.parametrize("bound", [0.0, 1.0])
def test_form_a_is_unbiased_for_a_constant_fault(fault, bound):
    pole = 0.3
    innovations = lfilter([0, 1], [1, -pole], np.full((1, 4000), fault))
    error, estimate = observe(innovations, pole, 0.1, 0.05, bound)
    assert estimate[0, -1] == pytest.approx(fault, rel=1e-6)
    assert abs(error[0, -1]) < 1e-6 * abs(fault)


def test_spectral_radius_is_that_of_the_loop():
    rng = np.random.default_rng(0)
    for pole, kp, ki in rng.uniform([-0.9, -1, 0.01], [0.9, 2, 2], size=(50, 3)):
        loop = [[pole - kp, 1.0], [-ki, 1.0]]
        expected = np.abs(np.linalg.eigvals(loop)).max()
        assert spectral_radius(pole, kp, ki) == pytest.approx(expected, rel=1e-6)
    # An integral that nothing feeds has no effect.
    assert spectral_radius(0.3, 0.9, 0.0) == pytest.approx(0.6)


@pytest.fixture(scope="module")
def random_loops():
    rng = np.random.default_rng(0)
    loops = rng.uniform([-0.95, -0.5, 0.01, 0.05], [0.95, 1.5, 0.6, 8], size=(250, 4))
    return [loop for loop in loops if spectral_radius(*loop[:3]) < 1]


def test_circle_criterion_is_a_positive_real_part_on_the_circle(random_loops):
    z = np.exp(1j * np.linspace(0, np.pi, 2001))
    verdicts = []
    for pole, kp, ki, bound in random_loops:
        plant = (z - pole + kp) * (z - 1)
        real_part = np.real((plant + ki * (1 + bound)) / (plant + ki)).min()
        if abs(real_part) < 2e-3:
            continue
        verdicts.append(real_part > 0)
        assert meets_circle_criterion(pole, kp, ki, bound) == verdicts[-1]
    assert min(np.mean(verdicts), 1 - np.mean(verdicts)) > 0.1
    # An integral that nothing feeds does not decay.
    assert not meets_circle_criterion(0.3, 0.3, 0.0, 1.0)
