"""Equations (17)-(20) as printed, in open and in closed loop."""

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import ExtendedStatePIObserver
from skarxlag.kernels.laguerre import laguerre_matrices


def full_state_errors(y, feedback, K_p, A, b_y, coef):
    """Output errors of Eq. (17) without fault, fed with y or with its own output."""
    x, errors = np.zeros(len(A)), []
    for sample in y:
        y_hat = coef @ x
        errors.append(sample - y_hat)
        fed = y_hat if feedback == "own" else sample
        x = A @ x + b_y * fed + K_p * errors[-1]
    return np.array(errors)


def test_equation_17_is_equation_11_with_another_gain():
    rng = np.random.default_rng(0)
    A, b_y = laguerre_matrices(4, 0.4)
    coef, y = np.array([0.4, -0.3, 0.2, 0.1]), rng.normal(size=200)
    gain = rng.normal(scale=0.1, size=4)
    printed = full_state_errors(y, "own", b_y + gain, A, b_y, coef)
    np.testing.assert_allclose(
        printed, full_state_errors(y, "measured", gain, A, b_y, coef)
    )
    # With K_p = b_y it is the one-step predictor of (11), the error its innovation.
    predictor = full_state_errors(y, "own", b_y, A, b_y, coef)
    np.testing.assert_allclose(
        predictor, full_state_errors(y, "measured", 0.0, A, b_y, coef)
    )


@pytest.mark.parametrize("start", [0.01, 0.3, -1.2])
def test_equation_20_doubles_every_step(start):
    # d+ = 2 d + 2 d^2 without any error at all has the solution 1 + 2 d = (1 + 2
    # d(0))^(2^k).
    estimate = start
    for k in range(1, 5):
        estimate = 2 * estimate + 2 * estimate**2
        assert 1 + 2 * estimate == pytest.approx((1 + 2 * start) ** (2**k))
    for _ in range(20):
        estimate = min(2 * estimate + 2 * estimate**2, 1e100)
    assert estimate > 1e50


def printed_loop(innovations, pole, kp, ki_a, ki_b):
    """Estimates of Eqs. (19) and (20) on innovations, until they leave 1e6."""
    correction, estimate, estimates = 0.0, 0.0, []
    for sample in innovations:
        estimates.append(estimate)
        if abs(estimate) > 1e6:
            break
        e = sample - correction
        correction = pole * correction + kp * e + estimate
        estimate = 2 * (estimate + ki_a * e) + 2 * (estimate + ki_b * e) ** 2
    return np.array(estimates)


@pytest.mark.parametrize("gain", [0.01, 0.05, 0.2])
def test_equation_20_diverges_in_closed_loop_and_form_a_does_not(gain):
    innovations = lfilter([0, 1], [1, -0.3], np.full(400, 0.5))
    innovations += 0.05 * np.random.default_rng(0).normal(size=400)
    assert abs(printed_loop(innovations, 0.3, 0.1, gain, gain)[-1]) > 1e6
    observer = ExtendedStatePIObserver(ki=min(2 * gain, 0.06), n_observers=1)
    repaired = observer.fit(innovations[np.newaxis]).observe(innovations[np.newaxis])
    assert repaired.fault_estimate[0, 200:].mean() == pytest.approx(0.5, abs=0.02)


def test_square_must_keep_its_sign():
    p = np.linspace(-2, 2, 4001)
    printed, repaired = 2 * (p + p**2), 2 * (p + np.abs(p) * p)
    # Unsigned it folds: no integral gives an estimate below -1/2.
    assert printed.min() == pytest.approx(-0.5)
    assert np.all(np.diff(repaired) > 0)
    np.testing.assert_allclose(repaired, -repaired[::-1], atol=1e-12)
