"""ARX-Laguerre models on windows: sums for least squares, innovations, free run.

In all functions, `windows` has the shape (n_windows, n_channels, n_samples), and
channel 0 is the output y. The arrays `orders` and `poles` describe the networks, with
one entry for each channel. The regressor x contains the Laguerre states of channel 0,
then of channel 1, and so on. It is strictly causal: x(k) depends on samples before k
only.
"""

import math
from functools import partial

import numpy as np
from scipy import linalg

from .arrays import Array
from .compiled import compiled
from .laguerre import impulse_responses, network_matrices

#: Windows whose states are advanced together. All go through the same instructions, so
#: no result depends on its lane.
LANES = 16
#: Samples for which the histories of states stay in the fastest memory.
_TILE = 16
#: Samples that lie side by side at a time: their memory does not grow with the windows.
_PART = 64 * _TILE
#: States and models that one pass over a tile takes together.
_STATES = 4
_MODELS = 2
#: Size of responses to a unit impulse that sums in double precision do not show.
_INAUDIBLE = 1e-18
#: Lags from which on correlations by Fourier transforms take less time.
_MANY_LAGS = 2000


def accumulate_sums(
    windows: Array,
    weights: Array,
    orders: Array,
    poles: Array,
    n_transient: int,
) -> tuple[Array, Array, Array]:
    """Compute the weighted sums that `sums_of_products` needs, over samples after the transient.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs. The states start from zero in every window.
    weights : ndarray of shape (n_windows,)
        Weight of each window in the sums.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    n_transient : int
        Number of samples at the start of a window that drive the states but enter no
        sum.

    Returns
    -------
    power : ndarray of shape (n_channels, n_channels)
        Sum w s s' over the signals s.
    driven : ndarray of shape (n_channels, n_states)
        Sum w s x'.
    moved : ndarray of shape (n_states, n_states)
        Change of the sum w x x' if the sum began and ended one sample later.
    """
    windows = np.asarray(windows, dtype=np.float64)
    n_channels, n_samples = windows.shape[1:]
    responses = [
        impulse_responses(order, pole, n_samples)
        for order, pole in zip(orders, poles, strict=True)
    ]
    is_heard = np.abs(np.concatenate(responses)).max(axis=0) > _INAUDIBLE
    n_lags = int(np.flatnonzero(is_heard)[-1]) + 1
    # From the largest lag down to 1, as the samples come.
    backwards = linalg.block_diag(
        *[np.flip(response[:, :n_lags], axis=1).T for response in responses]
    )
    counted = windows[..., n_transient:]
    power = np.tensordot(weights, counted @ counted.transpose(0, 2, 1), axes=1)
    padded = np.pad(windows, [(0, 0), (0, 0), (n_lags, 0)])
    correlate = np.correlate
    if n_lags > _MANY_LAGS:
        # The import takes as long as that of scikit-learn.
        from scipy import signal

        correlate = partial(signal.correlate, method="fft")
    lagged = np.zeros((n_channels, n_channels, n_lags))
    for window, past, weight in zip(counted, padded, weights, strict=True):
        for a, b in np.ndindex(n_channels, n_channels):
            products = correlate(past[b, n_transient:-1], window[a], "valid")
            lagged[a, b] += weight * products
    first, last = (
        padded[..., end : end + n_lags].reshape(len(windows), -1) @ backwards
        for end in (n_transient, n_samples)
    )
    moved = (last.T * weights) @ last - (first.T * weights) @ first
    return power, lagged.reshape(n_channels, -1) @ backwards, moved


def sums_of_products(
    power: Array,
    driven: Array,
    moved: Array,
    orders: Array,
    poles: Array,
) -> Array:
    r"""Compute the sums for least squares of y(k) on x(k).

    The sums D of the products of states need not be formed sample by sample. The
    product of :math:`x^+ = A x + B s` with itself, summed over time, gives

    .. math::

        D + M = A D A^T + A C B^T + B C^T A^T + B R B^T

    Here C are the sums of x s' and R those of s s'. M is the change of D if the sum
    began and ended one sample later. This is a discrete Lyapunov equation, and A is
    stable, so it has one solution.

    Parameters
    ----------
    power, driven, moved : ndarray
        R, C' and M, as `accumulate_sums` returns them.
    orders, poles : ndarray of shape (n_channels,)
        The networks.

    Returns
    -------
    ndarray of shape (n_states + 1, n_states + 1)
        Sum w [x; y][x; y]'.
    """
    A, B = network_matrices(orders, poles)
    mixed = A @ driven.T @ B.T
    constant = mixed + mixed.T + B @ power @ B.T - moved
    of_states = linalg.solve_discrete_lyapunov(A, constant)
    with_output = driven[0]
    return np.block(
        [[of_states, with_output[:, np.newaxis]], [with_output, power[0, 0]]]
    )


def innovations(
    windows: Array,
    orders: Array,
    poles: Array,
    coef: Array,
    n_transient: int,
    out: Array,
) -> Array:
    """Compute the innovations, the prediction errors of each model: y(k) - coef_c . x(k).

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs.
    orders, poles : ndarray of shape (n_channels,)
        The networks, shared by all models.
    coef : ndarray of shape (n_models, n_states)
        Fourier coefficients of each model.
    n_transient : int
        Number of samples at the start of every window for which no innovation is
        returned.
    out : ndarray of shape (n_windows, n_models, n_samples - n_transient)
        Array that receives the innovations.

    Returns
    -------
    ndarray
        `out`: the innovations, in the unit of the output.
    """
    n_windows, n_channels, n_samples = windows.shape
    # Coefficients of zero for models and states that are not there fill the last pass.
    filled = -(-orders // _STATES) * _STATES
    n_filled = -(-len(coef) // _MODELS) * _MODELS
    padded = np.zeros((n_filled, filled.sum()))
    begin = first = 0
    for channel, order in enumerate(orders.tolist()):
        # The networks are driven by the signals themselves, so their gain is that of
        # the coefficients.
        gain = math.sqrt(1 - poles[channel] ** 2)
        of_channel = coef[:, begin : begin + order]
        padded[: len(coef), first : first + order] = gain * of_channel
        begin += order
        first += filled[channel]
    most_tiles = -(-min(n_samples, _PART) // _TILE)
    signals = np.zeros((n_channels, most_tiles, _TILE * LANES))
    errors = np.zeros((n_filled, most_tiles, _TILE * LANES))
    states = np.empty((filled.sum(), LANES))
    drive = np.empty(_TILE * LANES)
    histories = np.empty((_STATES, (_TILE + 1) * LANES))
    by_sample = signals.reshape(n_channels, -1, LANES)
    errors_by_sample = errors.reshape(n_filled, -1, LANES)
    for first_window in range(0, n_windows, LANES):
        rows = slice(first_window, first_window + LANES)
        states[:] = 0.0
        for start in range(0, n_samples, _PART):
            part = windows[rows, :, start : start + _PART]
            n_lanes, _, n_values = part.shape
            by_sample[:, :n_values, :n_lanes] = part.transpose(1, 2, 0)
            errors[: len(coef)] = signals[0]
            n_tiles = -(-n_values // _TILE)
            _subtract_predictions(
                signals,
                n_tiles,
                filled,
                poles,
                padded,
                states,
                drive,
                histories,
                errors,
            )
            n_skipped = min(max(n_transient - start, 0), n_values)
            place = start + n_skipped - n_transient
            for c in range(len(coef)):
                of_model = errors_by_sample[c, n_skipped:n_values, :n_lanes]
                out[rows, c, place : start + n_values - n_transient] = of_model.T
    return out


@compiled
def _subtract_predictions(
    signals, n_tiles, orders, poles, coef, states, drive, histories, errors
):
    r"""Subtract the predictions from the first tiles of `errors`, of `_TILE` samples each.

    `LANES` signals lie side by side, sample by sample, so that vector instructions can
    run the recursions over time. Each state n follows :math:`x_n(k+1) = \zeta x_n(k) +
    d_n(k)`, with the drive :math:`d_{n+1}(k) = x_n(k) - \zeta x_n(k+1)`. The first
    drive is the signal itself, so the states are those of the network divided by
    :math:`\sqrt{1-\zeta^2}`. A history begins with the last sample before the tile.

    Rows of arrays are not held in variables: the compiler could not know that they are
    apart, and would use no vector instructions.
    """
    for tile in range(n_tiles):
        first = 0
        for channel in range(len(signals)):
            pole = poles[channel]
            for i in range(_TILE * LANES):
                drive[i] = signals[channel, tile, i]
            last = first + orders[channel]
            for n in range(first, last, _STATES):
                for m in range(_STATES):
                    for lane in range(LANES):
                        histories[m, lane] = states[n + m, lane]
                for i in range(_TILE * LANES):
                    histories[0, i + LANES] = pole * histories[0, i] + drive[i]
                for m in range(1, _STATES):
                    for i in range(_TILE * LANES):
                        driven = (
                            histories[m - 1, i] - pole * histories[m - 1, i + LANES]
                        )
                        histories[m, i + LANES] = pole * histories[m, i] + driven
                for i in range(_TILE * LANES):
                    before = histories[_STATES - 1, i]
                    drive[i] = before - pole * histories[_STATES - 1, i + LANES]
                for m in range(_STATES):
                    for lane in range(LANES):
                        states[n + m, lane] = histories[m, _TILE * LANES + lane]
                for c in range(0, len(coef), _MODELS):
                    a0 = coef[c, n]
                    a1 = coef[c, n + 1]
                    a2 = coef[c, n + 2]
                    a3 = coef[c, n + 3]
                    b0 = coef[c + 1, n]
                    b1 = coef[c + 1, n + 1]
                    b2 = coef[c + 1, n + 2]
                    b3 = coef[c + 1, n + 3]
                    for i in range(_TILE * LANES):
                        x0 = histories[0, i]
                        x1 = histories[1, i]
                        x2 = histories[2, i]
                        x3 = histories[3, i]
                        errors[c, tile, i] = (
                            errors[c, tile, i] - a0 * x0 - a1 * x1 - a2 * x2 - a3 * x3
                        )
                        errors[c + 1, tile, i] = (
                            errors[c + 1, tile, i]
                            - b0 * x0
                            - b1 * x1
                            - b2 * x2
                            - b3 * x3
                        )
            first = last


def free_run(
    windows: Array,
    orders: Array,
    poles: Array,
    coef: Array,
    n_start: int,
) -> Array:
    """Simulate the output from the inputs; after the first samples the model feeds on its output.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs. Only the first `n_start` samples of the output are used.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    coef : ndarray of shape (n_models, n_states)
        Fourier coefficients of each model.
    n_start : int
        Number of measured output samples that drive the states before the simulation
        starts.

    Returns
    -------
    ndarray of shape (n_windows, n_models, n_samples)
        Simulated output, coef_c . x(k).
    """
    A, B = network_matrices(orders, poles)
    n_windows, _, n_samples = windows.shape
    n_models = len(coef)
    simulated = np.empty((n_windows, n_models, n_samples))
    states = np.zeros((n_windows, *coef.shape))
    signals = np.repeat(windows[:, np.newaxis], n_models, axis=1)
    for k in range(n_samples):
        simulated[..., k] = np.einsum("wcn,cn->wc", states, coef)
        if k >= n_start:
            signals[..., 0, k] = simulated[..., k]
        states = states @ A.T + signals[..., k] @ B.T
    return simulated
