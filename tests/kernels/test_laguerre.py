import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import group_delay, lfilter

from skarxlag.kernels.laguerre import (
    impulse_responses,
    laguerre_matrices,
    network_matrices,
    settling_length,
)

POLES = [-0.9, -0.5, 0.0, 0.3, 0.7, 0.95]
ORDERS = [1, 2, 3, 5, 8]


def cascade(order, pole, signal):
    """Eq. (5) as a chain of scipy.signal sections: a low-pass, then all-passes."""
    output = lfilter([0, np.sqrt(1 - pole**2)], [1, -pole], signal)
    outputs = [output]
    for _ in range(order - 1):
        output = lfilter([-pole, 1], [1, -pole], output)
        outputs.append(output)
    return np.array(outputs)


def by_matrices(order, pole, signal):
    A, b = laguerre_matrices(order, pole)
    states = np.zeros((order, len(signal)))
    for k in range(len(signal) - 1):
        states[:, k + 1] = A @ states[:, k] + b * signal[k]
    return states


@pytest.mark.parametrize("pole", POLES)
@pytest.mark.parametrize("order", ORDERS)
def test_network_is_input_balanced(order, pole):
    A, b = laguerre_matrices(order, pole)
    assert_allclose(A @ A.T + np.outer(b, b), np.eye(order), atol=1e-14)


@pytest.mark.parametrize("pole", POLES)
@pytest.mark.parametrize("order", ORDERS)
def test_matrices_advance_and_filter_cascade_agree(order, pole):
    signal = np.random.default_rng(order).normal(size=150)
    expected = cascade(order, pole, signal)
    assert_allclose(by_matrices(order, pole, signal), expected, atol=1e-12)
    responses = impulse_responses(order, pole, 149)
    convolved = [np.convolve(response, signal)[:149] for response in responses]
    assert_allclose(convolved, expected[:, 1:], atol=1e-12)


def test_pole_zero_is_a_delay_line():
    signal = np.arange(1.0, 8.0)
    expected = [[0, 1, 2, 3, 4, 5, 6], [0, 0, 1, 2, 3, 4, 5], [0, 0, 0, 1, 2, 3, 4]]
    assert_array_equal(by_matrices(3, 0.0, signal), expected)


@pytest.mark.parametrize("pole", [-0.6, 0.0, 0.3, 0.9])
@pytest.mark.parametrize("order", [1, 5, 32])
def test_settling_length_is_the_longest_group_delay_of_the_all_passes(order, pole):
    frequency = np.linspace(0, np.pi, 257)
    _, delay = group_delay(([-pole, 1], [1, -pole]), w=frequency)
    assert settling_length(order, pole) == np.ceil(order * delay.max() - 1e-9)


def test_parallel_networks_have_nothing_to_do_with_each_other():
    A, B = network_matrices([2, 3], [0.4, -0.3])
    for channel, states in enumerate((slice(0, 2), slice(2, 5))):
        single = laguerre_matrices((2, 3)[channel], (0.4, -0.3)[channel])
        assert_array_equal(A[states, states], single[0])
        assert_array_equal(B[states, channel], single[1])
    assert np.count_nonzero(A[:2, 2:]) == np.count_nonzero(A[2:, :2]) == 0
    assert np.count_nonzero(B[2:, 0]) == np.count_nonzero(B[:2, 1]) == 0
