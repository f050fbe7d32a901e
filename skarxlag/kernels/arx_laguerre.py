"""ARX-Laguerre models on windows: sums for least squares, innovations, free run.

Everywhere `windows` is (n_windows, n_channels, n_samples) with channel 0 the output y, and a
network layout is a pair of arrays (orders, poles), one entry a channel. The regressor x holds the
Laguerre states of channel 0, then of channel 1, and so on; it is strictly causal.
"""

import math

import numpy as np

from .compiled import compiled
from .laguerre import advance, advance_block
from .lanes import LANES, TILE, carry, deinterleave, interleave

#: Samples whose states are held at once while sums are formed.
_SUMMED = 4096
#: States and models that one pass over a block of predictions takes together.
_STATES, _MODELS = 4, 2


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
        Sum w [x; y][x; y]'.
    """
    n_samples = windows.shape[2]
    n_rows = int(orders.sum()) + 1
    sums = np.zeros((n_rows, n_rows))
    histories = np.empty((n_rows, min(_SUMMED, n_samples) + 1))
    for window, weight in zip(windows, weights, strict=True):
        histories[:, 0] = 0.0
        for start in range(0, n_samples, _SUMMED):
            length = min(_SUMMED, n_samples - start)
            continue_states(window, start, length, orders, poles, histories)
            regressors = histories[:, max(n_transient - start, 0) : length]
            sums += weight * (regressors @ regressors.T)
            histories[:, 0] = histories[:, length]
    return sums


@compiled
def continue_states(window, start, length, orders, poles, histories):
    """States of all networks through some samples of one window, and its output below them.

    Parameters
    ----------
    window : ndarray of shape (n_channels, n_samples)
        Output and inputs.
    start, length : int
        First sample, and how many.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    histories : ndarray of shape (n_states + 1, at least length + 1)
        Column 0 holds the states at `start`; the others are written.
    """
    for k in range(length):
        first = 0
        for channel in range(window.shape[0]):
            pole, sample = poles[channel], window[channel, start + k]
            before = histories[first, k]
            state = pole * before + math.sqrt(1.0 - pole * pole) * sample
            histories[first, k + 1] = state
            for n in range(first + 1, first + orders[channel]):
                held = histories[n, k]
                state = pole * (held - state) + before
                histories[n, k + 1] = state
                before = held
            first += orders[channel]
        histories[first, k] = window[0, start + k]


def innovations(windows, orders, poles, coef, n_transient, out):
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
    out : ndarray of shape (n_windows, n_models, n_samples - n_transient)
        Where to write them.

    Returns
    -------
    ndarray
        `out`: the innovations, in the unit of the output.
    """
    n_models, n_states = coef.shape
    # Coefficients of zero for models and states that are not there fill the last pass.
    padded = np.zeros((-(-n_models // _MODELS) * _MODELS, -(-n_states // _STATES) * _STATES))
    padded[:n_models, :n_states] = coef
    # Whatever comes in, the kernel is compiled for one kind of array only.
    windows = np.require(windows, dtype=np.float64, requirements=["C", "W"])
    errors = np.require(out, dtype=np.float64, requirements=["C", "W"])
    subtract_predictions(
        windows,
        orders,
        poles,
        padded,
        n_transient,
        errors,
        np.zeros((padded.shape[1], (TILE + 1) * LANES)),
        np.zeros((windows.shape[1], TILE * LANES)),
        np.zeros((len(padded), TILE * LANES)),
    )
    if errors is not out:
        out[...] = errors
    return out


@compiled
def subtract_predictions(
    windows, orders, poles, coef, n_transient, errors, histories, signals, block
):
    """Fill `errors` with the innovations, block by block.

    `coef` is padded, the last three arrays are for blocks of states, signals and predictions; made
    in here, they would cost as much to compile as all else.
    """
    n_windows, n_channels, n_samples = windows.shape
    n_models = errors.shape[1]
    for w in range(0, n_windows, LANES):
        for n in range(coef.shape[1]):
            for lane in range(LANES):
                histories[n, lane] = 0.0
        for start in range(0, n_samples, TILE):
            length = min(TILE, n_samples - start)
            first = 0
            for channel in range(n_channels):
                interleave(windows, w, channel, start, signals[channel])
                last = first + orders[channel]
                advance_block(histories[first:last], signals[channel], poles[channel])
                first = last
            dropped = max(n_transient - start, 0)
            if dropped < length:
                _subtract_block(coef, histories, signals[0], block)
                for c in range(n_models):
                    deinterleave(block[c], dropped, errors, w, c, start + dropped - n_transient)
            for n in range(coef.shape[1]):
                carry(histories[n], length)


@compiled
def _subtract_block(coef, histories, output, errors):
    """Output less predictions on one block; several states and models a pass spare memory."""
    for c in range(0, coef.shape[0], _MODELS):
        for i in range(TILE * LANES):
            errors[c, i] = output[i]
            errors[c + 1, i] = output[i]
        for n in range(0, coef.shape[1], _STATES):
            a0, a1, a2, a3 = coef[c, n], coef[c, n + 1], coef[c, n + 2], coef[c, n + 3]
            b0, b1 = coef[c + 1, n], coef[c + 1, n + 1]
            b2, b3 = coef[c + 1, n + 2], coef[c + 1, n + 3]
            for i in range(TILE * LANES):
                x0, x1 = histories[n, i], histories[n + 1, i]
                x2, x3 = histories[n + 2, i], histories[n + 3, i]
                errors[c, i] -= a0 * x0 + a1 * x1 + a2 * x2 + a3 * x3
                errors[c + 1, i] -= b0 * x0 + b1 * x1 + b2 * x2 + b3 * x3


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
