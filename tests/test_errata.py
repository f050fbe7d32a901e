"""The paper's equations as printed, and why the package computes others."""

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import ExtendedStatePIObserver
from skarxlag.kernels.laguerre import laguerre_matrices


def printed_matrix(order, pole):
    """Eq. (13): its corner has the exponent N - 1, where its own third row has n - j - 1."""
    A, b = laguerre_matrices(order, pole)
    A = A.copy()
    A[-1, 0] = (-pole) ** (order - 1) * (1 - pole**2)
    return A, b


@pytest.mark.parametrize("order", [3, 4])
def test_corner_exponent_of_equation_13(order):
    pole = 0.6
    impulse = np.zeros(60)
    impulse[0] = 1.0
    last = lfilter([0, np.sqrt(1 - pole**2)], [1, -pole], impulse)
    for _ in range(order - 1):
        last = lfilter([-pole, 1], [1, -pole], last)
    deviations, imbalances = [], []
    for A, b in (laguerre_matrices(order, pole), printed_matrix(order, pole)):
        response = [(np.linalg.matrix_power(A, k - 1) @ b)[-1] for k in range(1, 60)]
        deviations.append(np.abs(response - last[1:]).max())
        imbalances.append(np.abs(A @ A.T + np.outer(b, b) - np.eye(order)).max())
    assert deviations[0] < 1e-12 and imbalances[0] < 1e-12
    assert deviations[1] > 0.2 and imbalances[1] > 0.2


def test_figure_6_lacks_a_square():
    pole = 0.6
    decay = pole ** np.arange(200.0)
    assert np.sum((1 - pole**2) * decay**2) == pytest.approx(1)
    assert np.sum((1 - pole) * decay**2) == pytest.approx(1 / (1 + pole))


def test_sign_of_equation_16():
    rng = np.random.default_rng(0)
    states = rng.normal(size=(300, 3))
    output = states @ [1.0, -0.5, 0.25]
    final = {}
    for sign in (1, -1):
        K, P = np.zeros(3), np.eye(3)
        for x, y in zip(states, output, strict=True):
            d = x @ P @ x
            P = P - np.outer(P @ x, x @ P) / (1 + d)
            before = y - K @ x
            K = K + sign * P @ x * before
            # What a step makes of its own error.
            factor = 1 / (1 + d) if sign > 0 else 1 + d / (1 + d)
            assert y - K @ x == pytest.approx(factor * before, abs=1e-9 * (1 + abs(before)))
        final[sign] = np.abs(K - [1.0, -0.5, 0.25]).max()
    assert final[1] < 0.02
    assert final[-1] > 10


@pytest.mark.parametrize("start", [0.01, 0.3, -1.2])
def test_equation_20_doubles_every_step(start):
    # d+ = 2 d + 2 d^2 without any error at all has the solution 1 + 2 d = (1 + 2 d(0))^(2^k).
    estimate = start
    for k in range(1, 5):
        estimate = 2 * estimate + 2 * estimate**2
        assert 1 + 2 * estimate == pytest.approx((1 + 2 * start) ** (2**k))
    for _ in range(20):
        estimate = min(2 * estimate + 2 * estimate**2, 1e100)
    assert estimate > 1e50


def test_equation_20_has_a_spurious_fixed_point():
    estimate = -0.01
    for _ in range(60):
        estimate = 2 * estimate + 2 * estimate**2
    assert estimate == pytest.approx(-0.5)


@pytest.mark.parametrize("gain", [0.01, 0.05, 0.2])
def test_equation_20_diverges_in_closed_loop_and_form_a_does_not(gain):
    innovations = lfilter([0, 1], [1, -0.3], np.full(400, 0.5))
    innovations += 0.05 * np.random.default_rng(0).normal(size=400)
    correction, estimate = 0.0, 0.0
    for sample in innovations:
        e = sample - correction
        correction = 0.3 * correction + 0.1 * e + estimate
        estimate = 2 * (estimate + gain * e) + 2 * (estimate + gain * e) ** 2
        if abs(estimate) > 1e6:
            break
    assert abs(estimate) > 1e6
    observer = ExtendedStatePIObserver(ki_a=min(gain, 0.03), ki_b=gain)
    repaired = observer.fit(innovations[np.newaxis]).observe(innovations[np.newaxis])
    assert repaired.fault_estimate[0, 200:].mean() == pytest.approx(0.5, abs=0.02)


def test_square_must_keep_its_sign():
    p = np.linspace(-2, 2, 4001)
    printed, repaired = 2 * (p + p**2), 2 * (p + np.abs(p) * p)
    # Unsigned it folds: no integral gives an estimate below -1/2.
    assert printed.min() == pytest.approx(-0.5)
    assert np.all(np.diff(repaired) > 0)
    np.testing.assert_allclose(repaired, -repaired[::-1], atol=1e-12)


def test_residual_of_equation_21_is_the_same_for_every_condition():
    rng = np.random.default_rng(0)
    levels = [
        np.sqrt(np.mean((0.7 * np.sign(scale * rng.normal(size=5000))) ** 2))
        for scale in (0.25, 1.0, 9.5)
    ]
    np.testing.assert_allclose(levels, 0.7)
