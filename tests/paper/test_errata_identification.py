"""Equations (1)-(18) of the model as printed, run against what they should give."""

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag.kernels.laguerre import laguerre_matrices, network_matrices


def test_motor_currents_need_the_transpose_and_the_derivative_by_angle():
    # Three-phase machine with M(theta), currents given; V = R i + d(flux)/dt by
    # differences.
    speed, step = 20.0, 1e-5
    shift = 2 * np.pi / 3 * np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])
    self_inductance, R = np.eye(3) + 0.2, 0.3 * np.eye(6)

    def mutual(t):
        return 0.6 * np.cos(speed * t + shift)

    def inductance(M):
        return np.block([[self_inductance, M], [M.T, self_inductance]])

    def current(t):
        return np.sin(7 * t + np.arange(6.0))

    def flux(t):
        return inductance(mutual(t)) @ current(t)

    t = 0.013
    V = R @ current(t) + (flux(t + step) - flux(t - step)) / (2 * step)
    slope = (current(t + step) - current(t - step)) / (2 * step)
    M, by_angle = mutual(t), -0.6 * np.sin(speed * t + shift)

    def currents_derivative(inductances, rotation):
        off = np.block([[np.zeros((3, 3)), rotation], [rotation.T, np.zeros((3, 3))]])
        return np.linalg.solve(inductances, V - (R + off) @ current(t))

    right = currents_derivative(inductance(M), speed * by_angle)
    np.testing.assert_allclose(right, slope, atol=1e-6)
    without_transpose = np.block([[self_inductance, M], [M, self_inductance]])
    for printed in (
        currents_derivative(without_transpose, speed * by_angle),
        currents_derivative(inductance(M), speed * (speed * by_angle)),
    ):
        assert np.abs(printed - slope).max() > 1


def test_equation_4_is_quadratic_in_the_signals():
    # A filtered signal times the filtered signal again: twice the signal, four times
    # the output.
    signal = np.random.default_rng(0).normal(size=50)

    def printed(y):
        filtered = lfilter([0, 0.8], [1, -0.6], y)
        return 0.5 * filtered * filtered

    def repaired(y):
        return 0.5 * lfilter([0, 0.8], [1, -0.6], y)

    np.testing.assert_allclose(printed(2 * signal), 4 * printed(signal))
    np.testing.assert_allclose(repaired(2 * signal), 2 * repaired(signal))


def test_figure_6_lacks_a_square():
    pole = 0.6
    decay = pole ** np.arange(200.0)
    assert np.sum((1 - pole**2) * decay**2) == pytest.approx(1)
    assert np.sum((1 - pole) * decay**2) == pytest.approx(1 / (1 + pole))


def response(order, pole, frequency):
    """Frequency responses of the filters of Eq. (5)."""
    z = np.exp(1j * frequency)
    all_pass = (1 - pole * z) / (z - pole)
    return (
        np.sqrt(1 - pole**2) / (z - pole) * all_pass ** np.arange(order)[:, np.newaxis]
    )


def test_transfer_function_is_that_of_output_and_input():
    orders, poles = [3, 2], [0.4, -0.3]
    coef = np.array([0.3, -0.2, 0.1, 0.5, 0.25])
    A, b = network_matrices(orders, poles)
    u, x, y = np.zeros(600), np.zeros(5), []
    u[0] = 1.0
    for sample in u:
        y.append(coef @ x)
        x = A @ x + b @ [y[-1], sample]
    frequency = np.linspace(0, np.pi, 301)
    A_z, B_z = (
        coef[part] @ response(order, pole, frequency)
        for part, order, pole in zip(
            (slice(3), slice(3, 5)), orders, poles, strict=True
        )
    )
    measured = np.fft.rfft(y)
    np.testing.assert_allclose(measured, B_z / (1 - A_z), atol=1e-9)
    # Eq. (8) as printed: filtered output over filtered input is another function.
    filtered = measured * response(1, 0.4, frequency)[0]
    filtered /= response(1, -0.3, frequency)[0]
    assert np.abs(filtered - B_z / (1 - A_z)).max() > 0.1


@pytest.mark.parametrize("pole", [0.0, 0.5])
def test_truncated_sums_are_polynomials_only_without_a_pole(pole):
    order = 4
    A, b = laguerre_matrices(order, pole)
    taps = [
        np.array([0.4, -0.3, 0.2, 0.1]) @ np.linalg.matrix_power(A, k) @ b
        for k in range(12)
    ]
    beyond = np.abs(taps[order:]).max()
    assert beyond == 0 if pole == 0 else beyond > 1e-2
    # Over (z - pole)^N every sum of N filters is a polynomial of degree N - 1.
    numerator = np.convolve(taps, np.poly(np.full(order, pole)))[: len(taps)]
    np.testing.assert_allclose(numerator[order:], 0, atol=1e-12)


def test_input_vectors_of_equation_15_do_not_fit_equation_11():
    A, b = network_matrices([3, 2], [0.4, 0.1])
    b_y, _ = laguerre_matrices(3, 0.4)[1], laguerre_matrices(2, 0.1)[1]
    with pytest.raises(ValueError, match="broadcast"):
        A @ np.zeros(5) + b_y * 1.0
    np.testing.assert_array_equal(b[:, 0], [*b_y, 0, 0])


def test_a_fault_vector_cannot_be_estimated_from_one_output():
    rng = np.random.default_rng(0)
    n = 5
    A, _ = network_matrices([3, 2], [0.4, 0.1])
    coef = rng.uniform(0.3, 0.6, size=n)
    pencil = np.block([[A - np.eye(n), np.eye(n)], [coef, np.zeros(n)]])
    assert np.linalg.matrix_rank(pencil) == n + 1 < 2 * n
    for _ in range(20):
        K_p, K_I = rng.normal(size=n), rng.normal(size=n)
        error = np.block(
            [[A - np.outer(K_p, coef), np.eye(n)], [-np.outer(K_I, coef), np.eye(n)]]
        )
        stuck = np.abs(np.linalg.eigvals(error) - 1) < 1e-3
        assert (
            stuck.sum() >= n - 1
        )  # no gain moves them: these errors of the fault stay
    E = rng.normal(size=(n, 1))
    one = np.block([[A - np.eye(n), E], [coef, np.zeros(1)]])
    assert np.linalg.matrix_rank(one) == n + 1  # all of state and scalar fault


@pytest.mark.parametrize("order", [3, 4])
def test_corner_exponent_of_equations_13_and_14(order):
    pole = 0.6
    impulse = np.zeros(60)
    impulse[0] = 1.0
    last = lfilter([0, np.sqrt(1 - pole**2)], [1, -pole], impulse)
    for _ in range(order - 1):
        last = lfilter([-pole, 1], [1, -pole], last)
    right, b = laguerre_matrices(order, pole)
    printed = right.copy()
    printed[-1, 0] = (-pole) ** (order - 1) * (1 - pole**2)
    deviations, imbalances = [], []
    for A in (right, printed):
        response = [(np.linalg.matrix_power(A, k - 1) @ b)[-1] for k in range(1, 60)]
        deviations.append(np.abs(response - last[1:]).max())
        imbalances.append(np.abs(A @ A.T + np.outer(b, b) - np.eye(order)).max())
    assert deviations[0] < 1e-12 and imbalances[0] < 1e-12
    assert deviations[1] > 0.2 and imbalances[1] > 0.2
    if order == 3:
        # The third row is printed out and is the last: it has the right corner.
        assert right[2, 0] == pytest.approx(-pole * (1 - pole**2))
        assert deviations[1] == pytest.approx(0.59, abs=0.005)


def test_sign_of_equation_16():
    rng = np.random.default_rng(0)
    states = rng.normal(size=(2000, 3))
    output = states @ [1.0, -0.5, 0.25]
    deviations = {}
    for sign in (1, -1):
        K, P, deviations[sign] = np.zeros(3), np.eye(3), {}
        for k, (x, y) in enumerate(zip(states, output, strict=True), start=1):
            d = x @ P @ x
            P = P - np.outer(P @ x, x @ P) / (1 + d)
            before = y - K @ x
            K = K + sign * P @ x * before
            # What a step makes of its own error.
            factor = 1 / (1 + d) if sign > 0 else 1 + d / (1 + d)
            assert y - K @ x == pytest.approx(
                factor * before, abs=1e-9 * (1 + abs(before))
            )
            deviations[sign][k] = np.linalg.norm(K - [1.0, -0.5, 0.25])
    # The right sign forgets the start as 1/k; the printed one moves away in proportion
    # to k.
    assert deviations[1][2000] < 2e-3
    assert deviations[-1][2000] > 500
    assert deviations[-1][2000] / deviations[-1][500] == pytest.approx(4, rel=0.2)
