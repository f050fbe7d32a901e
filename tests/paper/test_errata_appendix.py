"""Appendix A as printed: convergence time, Lyapunov function, its derivative, its condition.

The function of (A-6) is the one known for x1' = -k1 |x1|^kappa sgn(x1) + x2 + rho and
x2' = -k2 sgn(x1), with k1 = k2 = K, x1 = S, x2 the fault estimate and rho its error.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

K_VALUES = np.geomspace(0.01, 100, 41)


def flow(x1, x2, k1, k2, kappa, rho=0.0):
    return -k1 * np.abs(x1) ** kappa * np.sign(x1) + x2 + rho, -k2 * np.sign(x1)


def lyapunov(x1, x2, k1, k2, kappa, signed=True):
    """(A-6); signed=False as printed, without the sign of S."""
    power = np.abs(x1) ** kappa * (np.sign(x1) if signed else 1)
    return 2 * k2 * np.abs(x1) + x2**2 / 2 + (k1 * power - x2) ** 2 / 2


def slope(x1, x2, k1, k2, kappa, rho=0.0, signed=True):
    """Derivative of `lyapunov` along the flow, by a central difference."""
    f1, f2 = flow(x1, x2, k1, k2, kappa, rho)
    h = 1e-6
    ahead = lyapunov(x1 + h * f1, x2 + h * f2, k1, k2, kappa, signed)
    return (ahead - lyapunov(x1 - h * f1, x2 - h * f2, k1, k2, kappa, signed)) / (2 * h)


def states(n=2000):
    rng = np.random.default_rng(0)
    x1, x2 = rng.uniform(0.05, 3, n) * rng.choice([-1, 1], n), rng.normal(size=n)
    return x1, x2


def test_equation_20_is_outside_the_range_of_the_exponent():
    # with S = delta and the gain 2, next to the square of (20).
    delta = np.linspace(0.1, 2, 20)
    deviations = {
        kappa: np.abs(2 * (delta + delta**kappa * delta) - 2 * (delta + delta**2)).max()
        for kappa in (1.0, 1.01, 1.5, 1.99)
    }
    assert deviations[1.0] < 1e-12
    assert min(deviations[kappa] for kappa in (1.01, 1.5, 1.99)) > 0.05


@pytest.mark.parametrize("kappa", [1.1, 1.5, 1.9])
def test_convergence_time_of_a_3_is_negative_for_small_negative_errors(kappa):
    S = np.linspace(-0.99, -0.01, 99)
    assert np.all(S + np.abs(S) ** (kappa + 1) < 0)
    assert np.all(np.abs(S) + np.abs(S) ** (kappa + 1) > 0)


def arcs(kappa, v, n_arcs, k1=1.0, k2=1.0):
    """Speeds and times at which x1 passes through zero, starting from x1 = 0 with speed v.

    Between two passages the sign of x1 is constant, so that each arc is smooth and its
    end exact: with u = |x1| and v = x2 sgn(x1), u' = -k1 u^kappa + v and v' = -k2.
    """

    def back_at_zero(t, state):
        return state[0] if t > 0 else 1.0

    back_at_zero.terminal, back_at_zero.direction = True, -1
    speeds, times = [v], [0.0]
    for _ in range(n_arcs):
        arc = solve_ivp(
            lambda t, state: [-k1 * max(state[0], 0.0) ** kappa + state[1], -k2],
            (0, 4 * speeds[-1] / k2),
            [0.0, speeds[-1]],
            events=back_at_zero,
            rtol=1e-9,
            atol=1e-12 * speeds[-1] ** 2,
        )
        times.append(times[-1] + arc.t_events[0][0])
        speeds.append(-arc.y_events[0][0][1])
    return np.array(speeds), np.array(times)


@pytest.mark.parametrize("kappa", [1.25, 1.5, 1.75])
def test_exponents_of_a_3_never_reach_zero(kappa):
    k1 = k2 = 1.0
    speeds, times = arcs(kappa, 1.0, 40)
    energy = speeds**2 / 2
    # E = k2 |x1| + x2^2 / 2 obeys E' = -k1 k2 |x1|^kappa >= -k1 k2^(1 - kappa) E^kappa.
    power = kappa - 1
    bound = (energy[0] ** -power + power * k1 * k2**-power * times) ** (-1 / power)
    assert np.all(energy >= bound * (1 - 1e-6))
    assert np.all(bound > 0)
    # Algebraic: E t^(1 / (kappa - 1)) levels off, while an exponential would take it to
    # zero.
    levels = energy * times ** (1 / power)
    assert abs(levels[-1] / levels[-8] - 1) < 0.35
    durations = np.diff(times)
    assert durations[-1] / durations[-2] > 0.95 > durations[1] / durations[0]


@pytest.mark.parametrize("kappa", [0.5, 1.0, 1.5])
def test_sign_of_a_6_makes_it_decrease(kappa):
    x1, x2 = states()
    K = 1.5
    decrease = -K * K * np.abs(x1) ** kappa
    decrease -= (
        K
        * kappa
        * np.abs(x1) ** (kappa - 1)
        * (K * np.abs(x1) ** kappa * np.sign(x1) - x2) ** 2
    )
    np.testing.assert_allclose(
        slope(x1, x2, K, K, kappa), decrease, rtol=1e-4, atol=1e-6
    )
    assert np.all(decrease < 0)
    # As printed it increases in places.
    assert slope(x1, x2, K, K, kappa, signed=False).max() > 0.5


@pytest.mark.parametrize("share", [0.0, 0.8, -0.8])
def test_derivative_of_a_7(share):
    x1, x2 = states()
    k1, k2 = 1.3, 0.7
    root = np.sqrt(np.abs(x1))
    rho = share * root
    z = np.array([root * np.sign(x1), x2])
    Q = k1 / 2 * np.array([[2 * k2 + k1**2, -k1], [-k1, 1.0]])
    q = np.array([2 * k2 + k1**2 / 2, -k1 / 2])
    repaired = (-np.einsum("in,ij,jn->n", z, Q, z) + rho * (q @ z)) / root
    np.testing.assert_allclose(
        slope(x1, x2, k1, k2, 0.5, rho), repaired, rtol=1e-4, atol=1e-5
    )


def test_a_7_as_printed_never_decreases_without_a_fault():
    for K in K_VALUES:
        printed = K / 2 * np.array([[K**2, -K], [-K, 1.0]])
        assert np.linalg.eigvalsh(printed)[0] == pytest.approx(
            0, abs=1e-9 * K**3 + 1e-12
        )
        assert np.trace(printed) > 0
        # Without the lost 2 K it is singular: with a minus in front it still only holds
        # V.
        along = np.array([1.0, K])
        assert along @ printed @ along == pytest.approx(0, abs=1e-9 * K**3)


def printed_condition(K, w):
    return np.array([[K**2 - (1 / K + K) * w, -K], [-(K + 2 * w), 1.0]])


def test_condition_a_9_is_infeasible():
    for K in K_VALUES:
        for w in np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 30)]):
            M = printed_condition(K, w)
            symmetric = (M + M.T) / 2
            scale = (K + w) ** 2 + w / K
            closed = -w * (3 * K + 1 / K + w)
            assert np.linalg.det(symmetric) == pytest.approx(closed, abs=1e-9 * scale)
            # Every term of w (3 K + 1/K + w) is positive: no K > 0 helps.
            assert closed < 0 if w > 0 else closed == 0
            assert np.linalg.det(M) == pytest.approx(
                -w * (3 * K + 1 / K), abs=1e-9 * scale
            )
            if w > 1e-3:
                direction = np.linalg.eigh(symmetric)[1][:, 0]
                assert direction @ M @ direction < 0


def test_repaired_condition_of_a_9_is_exact_for_the_form():
    rng = np.random.default_rng(0)
    verdicts = []
    for k1, k2, bound in rng.uniform(0.05, 3, size=(4000, 3)):
        forms = []
        for share in (
            bound,
            -bound,
        ):  # the form is linear in the share: its ends decide
            off = -(k1**2) / 2 + share * k1 / 4
            corner = k1 * (k2 + k1**2 / 2) - share * (2 * k2 + k1**2 / 2)
            forms.append(np.array([[corner, off], [off, k1 / 2]]))
        least = min(np.linalg.eigvalsh(form)[0] for form in forms)
        room = k2 * (k1 - 2 * bound) - k1 * bound**2 / 8
        if abs(room) < 1e-6:
            continue
        assert (least > 0) == (k1 > 2 * bound and room > 0)
        verdicts.append(least > 0)
    assert min(np.mean(verdicts), 1 - np.mean(verdicts)) > 0.1
