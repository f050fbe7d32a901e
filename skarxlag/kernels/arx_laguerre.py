"""ARX-Laguerre models on windows: sums for least squares, innovations, free run.

In all functions, `windows` has the shape (n_windows, n_channels, n_samples), and
channel 0 is the output y. The arrays `orders` and `poles` describe the networks, with
one entry for each channel. The regressor x contains the Laguerre states of channel 0,
then of channel 1, and so on. It is strictly causal: x(k) depends on samples before k
only.
"""

import math

import numpy as np
from scipy import linalg

from .arrays import Array
from .compiled import compiled, inlined
from .laguerre import TOGETHER, advance_block, impulse_responses, network_matrices
from .lanes import LANES, TILE, deinterleave, interleave

#: Models whose predictions one pass over a block takes together.
_MODELS = 2


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
    transient = windows[..., :n_transient]
    counted = windows[..., n_transient:]
    power = np.tensordot(weights, counted @ counted.transpose(0, 2, 1), axes=1)
    lagged = _lagged_products(windows, weights)
    if n_transient > 0:
        lagged[..., :n_transient] -= _lagged_products(transient, weights)
    driven = np.concatenate(
        [
            lagged[:, channel, 1:] @ responses[channel][:, :-1].T
            for channel in range(n_channels)
        ],
        axis=1,
    )
    first = _states_after(transient, responses)
    last = _states_after(windows, responses)
    moved = (last.T * weights) @ last - (first.T * weights) @ first
    return power, driven, moved


def _lagged_products(signals, weights):
    """Return the sums over windows and k of w s_a(k) s_b(k - lag), by channels a and b and lag."""
    n_samples = signals.shape[2]
    # SciPy's transform of long rows takes twice as long.
    spectra = np.fft.rfft(signals, 2 * n_samples)
    weighted = spectra * weights[:, np.newaxis, np.newaxis]
    # A new array would take as long as the sum.
    conjugates = np.conjugate(spectra, out=spectra)
    sums = np.einsum("waf,wbf->abf", weighted, conjugates)
    return np.fft.irfft(sums, 2 * n_samples)[..., :n_samples]


def _states_after(signals, responses):
    """Return the states after the last sample of signals."""
    n_samples = signals.shape[2]
    of_channels = [
        signals[:, channel] @ np.flip(response[:, :n_samples].T, axis=0).copy()
        for channel, response in enumerate(responses)
    ]
    return np.concatenate(of_channels, axis=1)


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
    # Coefficients of zero for models and states that are not there fill the last pass.
    filled = -(-orders // TOGETHER) * TOGETHER
    padded = np.zeros((-(-len(coef) // _MODELS) * _MODELS, filled.sum()))
    begin = first = 0
    for channel, order in enumerate(orders.tolist()):
        # The networks are driven by the signals themselves, so their gain is that of
        # the coefficients.
        gain = math.sqrt(1 - poles[channel] ** 2)
        of_channel = coef[:, begin : begin + order]
        padded[: len(coef), first : first + order] = gain * of_channel
        begin += order
        first += filled[channel]
    windows = np.require(windows, dtype=np.float64, requirements=["C", "W"])
    states = np.zeros((filled.sum(), LANES))
    histories = np.zeros((TOGETHER, (TILE + 1) * LANES))
    blocks = np.zeros((1 + len(padded), TILE * LANES))
    networks = (filled, poles, padded)
    _subtract_predictions(
        windows, *networks, n_transient, out, states, histories, blocks
    )
    return out


@compiled
def _subtract_predictions(
    windows, orders, poles, coef, n_transient, errors, states, histories, blocks
):
    """Fill `errors` with the innovations, block by block.

    `orders` and `coef` are padded. The last three arrays are working memory, of which
    the fastest holds all but the states. The caller allocates them, because their
    allocation in here would take as long to compile as the rest of the function.
    """
    drive = blocks[0]
    remaining = blocks[1:]
    n_windows, n_channels, n_samples = windows.shape
    _, n_models, _ = errors.shape
    for w in range(0, n_windows, LANES):
        states[:] = 0.0
        for start in range(0, n_samples, TILE):
            first = 0
            for channel in range(n_channels):
                interleave(windows, w, channel, start, drive)
                if channel == 0:
                    for c in range(len(remaining)):
                        for i in range(TILE * LANES):
                            remaining[c, i] = drive[i]
                for _ in range(0, orders[channel], TOGETHER):
                    advance_block(states[first:], drive, poles[channel], histories)
                    _subtract_block(coef, first, histories, remaining)
                    first += TOGETHER
            if start + TILE > n_transient:
                for c in range(n_models):
                    deinterleave(remaining[c], errors, w, c, start - n_transient)


@inlined
def _subtract_block(coef, n, histories, errors):
    """Subtract what some states add to the predictions."""
    for c in range(0, len(coef), _MODELS):
        a0 = coef[c, n]
        a1 = coef[c, n + 1]
        a2 = coef[c, n + 2]
        a3 = coef[c, n + 3]
        b0 = coef[c + 1, n]
        b1 = coef[c + 1, n + 1]
        b2 = coef[c + 1, n + 2]
        b3 = coef[c + 1, n + 3]
        for i in range(TILE * LANES):
            x0 = histories[0, i]
            x1 = histories[1, i]
            x2 = histories[2, i]
            x3 = histories[3, i]
            errors[c, i] = errors[c, i] - a0 * x0 - a1 * x1 - a2 * x2 - a3 * x3
            errors[c + 1, i] = errors[c + 1, i] - b0 * x0 - b1 * x1 - b2 * x2 - b3 * x3


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
