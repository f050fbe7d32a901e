"""ARX-Laguerre models on windows: sums for least squares, innovations, free run.

Everywhere `windows` is (n_windows, n_channels, n_samples) with channel 0 the output y, and a
network layout is a pair of arrays (orders, poles), one entry a channel. The regressor x holds the
Laguerre states of channel 0, then of channel 1, and so on; it is strictly causal.
"""

import numpy as np

from .compiled import compiled
from .laguerre import advance


@compiled
def accumulate_sums(windows, weights, orders, poles, n_transient):
    """Weighted sums for least squares of y(k) on x(k), over samples after the transient.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs; states start from zero in every window.
    weights : ndarray of shape (n_windows,)
        Weight of each window in the sums.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    n_transient : int
        Samples at the start of a window that drive the states and enter no sum.

    Returns
    -------
    ndarray of shape (n_states + 1, n_states + 1)
        Lower triangle of sum w [x; y][x; y]'.
    """
    n_windows, n_channels, n_samples = windows.shape
    n_states = orders.sum()
    sums = np.zeros((n_states + 1, n_states + 1))
    states = np.empty(n_states + 1)
    for w in range(n_windows):
        states[:] = 0.0
        for k in range(n_samples):
            if k >= n_transient:
                states[n_states] = windows[w, 0, k]
                for i in range(n_states + 1):
                    weighted = weights[w] * states[i]
                    for j in range(i + 1):
                        sums[i, j] += weighted * states[j]
            first = 0
            for channel in range(n_channels):
                last = first + orders[channel]
                advance(states[first:last], windows[w, channel, k], poles[channel])
                first = last
    return sums


@compiled
def innovations(windows, orders, poles, coef, n_transient):
    """What each model could not predict: eps_c(k) = y(k) - coef_c . x(k).

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs.
    orders, poles : ndarray of shape (n_channels,)
        The networks, shared by all models.
    coef : ndarray of shape (n_models, n_states)
        Fourier coefficients of each model.
    n_transient : int
        Samples dropped at the start of every window.

    Returns
    -------
    ndarray of shape (n_windows, n_models, n_samples - n_transient)
        The innovations, in the unit of the output.
    """
    n_windows, n_channels, n_samples = windows.shape
    n_models, n_states = coef.shape
    by_state = np.ascontiguousarray(coef.T)
    errors = np.empty((n_windows, n_models, n_samples - n_transient))
    states = np.empty(n_states)
    predicted = np.empty(n_models)
    for w in range(n_windows):
        states[:] = 0.0
        for k in range(n_samples):
            if k >= n_transient:
                predicted[:] = 0.0
                for i in range(n_states):
                    for c in range(n_models):
                        predicted[c] += by_state[i, c] * states[i]
                for c in range(n_models):
                    errors[w, c, k - n_transient] = windows[w, 0, k] - predicted[c]
            first = 0
            for channel in range(n_channels):
                last = first + orders[channel]
                advance(states[first:last], windows[w, channel, k], poles[channel])
                first = last
    return errors


@compiled
def free_run(windows, orders, poles, coef, n_start):
    """Simulation on the inputs alone, fed by its own output after the first samples.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs; of the output only the first `n_start` samples are looked at.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    coef : ndarray of shape (n_states,)
        Fourier coefficients of one model.
    n_start : int
        Measured output samples that drive the states before the simulation starts.

    Returns
    -------
    ndarray of shape (n_windows, n_samples)
        coef . x(k).
    """
    n_windows, n_channels, n_samples = windows.shape
    n_states = coef.shape[0]
    simulated = np.empty((n_windows, n_samples))
    states = np.empty(n_states)
    for w in range(n_windows):
        states[:] = 0.0
        for k in range(n_samples):
            output = 0.0
            for i in range(n_states):
                output += coef[i] * states[i]
            simulated[w, k] = output
            advance(states[: orders[0]], windows[w, 0, k] if k < n_start else output, poles[0])
            first = orders[0]
            for channel in range(1, n_channels):
                last = first + orders[channel]
                advance(states[first:last], windows[w, channel, k], poles[channel])
                first = last
    return simulated
