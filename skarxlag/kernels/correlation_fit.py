"""Fits for given poles from the correlations of the channels alone, for many models at a time.

A fit does not read the samples again, so its cost does not depend on the length of the data. The
correlations are those of zero-padded windows, as in the autocorrelation method of linear
prediction.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled


@compiled
def impulse_responses(order: int, pole: float, longest: int) -> NDArray[Any]:
    """Compute the impulse responses of a network's filters and of one additional filter.

    Parameters
    ----------
    order : int
        Number of filters N.
    pole : float
        The shared pole, in (-1, 1).
    longest : int
        Largest number of samples, at least 1. Longer responses are cut off.

    Returns
    -------
    ndarray of shape (n_samples, order + 1)
        Row k is the response at time k + 1; n_samples is rounded up to a multiple of four.
    """
    n_samples = order + 1
    if pole != 0.0:
        # The front arrives with the longest group delay, spread by the cube root of its length,
        # and decays by the pole: less than 1e-12 is left.
        size = abs(pole)
        spread = 20.0 + 12.0 * n_samples ** (1.0 / 3.0)
        n_samples = int(n_samples * (1.0 + size) / (1.0 - size) - spread / math.log(size)) + 1
    n_samples = min(n_samples, longest)
    n_samples += -n_samples % 4
    responses = np.empty((n_samples, order + 1))
    responses[0, 0] = math.sqrt(1.0 - pole * pole)
    for n in range(1, order + 1):
        responses[0, n] = -pole * responses[0, n - 1]
    for k in range(1, n_samples):
        responses[k, 0] = pole * responses[k - 1, 0]
        for n in range(1, order + 1):
            # In this order one multiply-add waits for the filter before, not two operations.
            held = pole * responses[k - 1, n] + responses[k - 1, n - 1]
            responses[k, n] = held - pole * responses[k, n - 1]
    return responses


@compiled
def state_correlations(
    correlations: NDArray[Any], orders: NDArray[Any], poles: NDArray[Any]
) -> NDArray[Any]:
    """Correlate the states of each network with the first states of all networks and the output.

    Parameters
    ----------
    correlations : ndarray of shape (n_models, n_channels, n_channels, 2 * n_lags + 1)
        Correlations of each model's windows.
    orders, poles : ndarray of shape (n_channels,)
        The networks.

    Returns
    -------
    ndarray of shape (n_models, n_channels, n_channels + 1, max(orders) + 1)
        Entry (m, a, b, i), i = 0 .. order of a, is the sum over time of state i of channel a times
        state 0 of channel b, or times the output for b = n_channels.
    """
    n_models, n_channels, _, n_points = correlations.shape
    n_lags = n_points // 2
    largest = 0
    for order in orders:
        largest = max(largest, order)
    found = np.zeros((n_models, n_channels, n_channels + 1, largest + 1))
    ahead = np.empty(4)
    for a in range(n_channels):
        responses = impulse_responses(orders[a], poles[a], n_lags + 1)
        n_samples, n_filters = responses.shape
        for m in range(n_models):
            for b in range(n_channels):
                lags = correlations[m, a, b]
                sums = found[m, a, b]
                gain = math.sqrt(1.0 - poles[b] * poles[b])
                start = min(n_lags, 1)
                if poles[b] != 0.0:
                    start = min(n_lags, int(-40.0 / math.log(abs(poles[b]))) + 1)
                # Channel a against state 0 of b, from later samples of a to earlier ones.
                value = 0.0
                for lag in range(start, 0, -1):
                    value = poles[b] * value + gain * lags[n_lags + lag]
                for k in range(0, n_samples, 4):
                    for step in range(4):
                        lag = n_lags - k - step
                        value = poles[b] * value + gain * (lags[lag] if lag >= 0 else 0.0)
                        ahead[step] = value
                    # Four at a time, or reading and writing the sums takes most of the time.
                    w, x, y, z = ahead[0], ahead[1], ahead[2], ahead[3]
                    for n in range(n_filters):
                        sums[n] += (
                            w * responses[k, n]
                            + x * responses[k + 1, n]
                            + y * responses[k + 2, n]
                            + z * responses[k + 3, n]
                        )
                # Without further lags the value decays by b's pole, and the rest has a closed form.
                rate = 1.0 - poles[a] * poles[b]
                last = responses[n_samples - 1]
                rest = last[0] / rate
                sums[0] += value * (rest - last[0])
                for n in range(1, n_filters):
                    entering = last[n] + poles[a] * last[n - 1]
                    rest = (entering - (poles[a] - poles[b]) * rest) / rate
                    sums[n] += value * (rest - last[n])
            # The output is what drives its own state 0, so one more sum gives them all.
            lags = correlations[m, a, 0]
            sums = found[m, a, 0]
            cross = found[m, a, n_channels]
            beyond = n_filters - 1
            for k in range(min(n_samples, n_lags)):
                cross[beyond] += lags[n_lags - k - 1] * responses[k, beyond]
            gain = math.sqrt(1.0 - poles[0] * poles[0])
            for n in range(beyond, 0, -1):
                driven = (1.0 - poles[a] * poles[0]) * sums[n] + (poles[a] - poles[0]) * sums[n - 1]
                cross[n - 1] = driven / gain - poles[a] * cross[n]
    return found


@compiled
def best_fits(
    states: NDArray[Any],
    power: NDArray[Any],
    orders: NDArray[Any],
    poles: NDArray[Any],
    alpha: float,
) -> tuple[NDArray[Any], float, NDArray[Any]]:
    r"""Ridge fit of each model, and how its error changes with the poles.

    With :math:`D_{ij}` the correlation of state i of a network of pole :math:`\zeta` and state j of
    one of pole :math:`\xi`, the all-passes give

    .. math::

        D_{ij} = D_{i-1,j-1} + \frac{\zeta - \xi}{1 - \zeta\xi} (D_{i,j-1} - D_{i-1,j}),

    so first row and column carry the block; it is Toeplitz where the poles are equal. Of the
    derivative of the error with respect to :math:`\operatorname{artanh} \zeta`, all is orthogonal
    to the error but :math:`-2 N g_{N-1} \langle e, x_N \rangle`: see the stationarity condition
    :math:`g_{N-1} g_N = 0` of Laguerre series.

    Parameters
    ----------
    states : ndarray of shape (n_models, n_channels, n_channels + 1, max(orders) + 1)
        Correlations, as `state_correlations` returns them.
    power : ndarray of shape (n_models,)
        Sum of squares of the output.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    alpha : float
        Ridge parameter, which is added to the sum of squares.

    Returns
    -------
    coef : ndarray of shape (n_models, n_states)
        Coefficients. A state that is a linear combination of the states before it gets 0.
    error : float
        Sum over the models of the minimised error, each relative to the power of its output. The
        error of an output without power is 0.
    slopes : ndarray of shape (n_channels,)
        Derivative of the error with respect to artanh of each pole.
    """
    n_models, n_channels, _, width = states.shape
    n_states = 0
    for order in orders:
        n_states += order
    size = n_states + n_channels + 1
    coef = np.zeros((n_models, n_states))
    error = 0.0
    slopes = np.zeros(n_channels)
    # All states, then the one beyond each network, then the output: upper triangle.
    sums = np.empty((size, size))
    least = np.empty(n_states)
    row = np.empty(size)
    block = np.empty((width, width))
    for m in range(n_models):
        if power[m] == 0.0:
            continue
        sums[:, :] = 0.0
        first = 0
        for a in range(n_channels):
            n = orders[a]
            own = states[m, a, a]
            cross = states[m, a, n_channels]
            for i in range(n):
                for j in range(i, n):
                    sums[first + i, first + j] = own[j - i]
                least[first + i] = 1e-12 * own[0]
                sums[first + i, first + i] += alpha
                sums[first + i, n_states + a] = own[n - i]
                sums[first + i, size - 1] = cross[i]
            sums[n_states + a, size - 1] = cross[n]
            other = first + n
            for b in range(a + 1, n_channels):
                turn = (poles[a] - poles[b]) / (1.0 - poles[a] * poles[b])
                for j in range(orders[b] + 1):
                    block[0, j] = states[m, b, a, j]
                for i in range(1, n + 1):
                    block[i, 0] = states[m, a, b, i]
                    for j in range(1, orders[b] + 1):
                        difference = block[i, j - 1] - block[i - 1, j]
                        block[i, j] = block[i - 1, j - 1] + turn * difference
                for j in range(orders[b]):
                    for i in range(n):
                        sums[first + i, other + j] = block[i, j]
                    sums[other + j, n_states + a] = block[n, j]
                for i in range(n):
                    sums[first + i, n_states + b] = block[i, orders[b]]
                other += orders[b]
            first += n
        sums[size - 1, size - 1] = power[m]
        for j in range(n_states):
            if sums[j, j] <= least[j]:
                sums[j, j] = np.inf
                continue
            # Whole rows, of which the lower part is never read: they vectorise best.
            for k in range(size):
                row[k] = sums[j, k]
            for i in range(j + 1, size):
                share = row[i] / row[j]
                for k in range(size):
                    sums[i, k] -= share * row[k]
        for j in range(n_states - 1, -1, -1):
            rest = sums[j, size - 1]
            for k in range(j + 1, n_states):
                rest -= sums[j, k] * coef[m, k]
            coef[m, j] = rest / sums[j, j]
        error += sums[size - 1, size - 1] / power[m]
        last = -1
        for a in range(n_channels):
            last += orders[a]
            beyond = sums[n_states + a, size - 1]
            slopes[a] -= 2.0 * orders[a] * coef[m, last] * beyond / power[m]
    return coef, error, slopes
