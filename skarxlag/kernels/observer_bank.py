"""A bank of observers over frequency: levels of each member's fault estimate.

Every member runs the recursion of `observer.observe` on the same innovations, with its own gains.
The members are independent, so the loops over them use vector instructions. They compute in single
precision. A fault estimate is the output of a filter with two poles, and the relative rounding
error of this filter is less than 1e-5.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled, inlined
from .spectra import frequency_grid

#: Members that are worked on together. Two vectors of them are under way at the same time, since
#: each has to wait for its own sample before.
_TOGETHER = 32
#: Share of the innovations' power by which the square of every estimate is raised: an estimate that
#: is nothing but rounding is steady.
_FLOOR = 1e-12


def member_gains(
    pole: float, n_members: int, bandwidth: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    r"""Compute the gains that give member m the closed-loop poles :math:`\rho\,e^{\pm j\omega_m}`.

    The matrix `observer.loop_matrix` has the characteristic polynomial
    :math:`z^2 - (1 + a) z + a + k_i` with :math:`a = \zeta - k_p`. Hence

    .. math::

        k_p = 1 + \zeta - 2\rho\cos\omega_m, \qquad k_i = \rho^2 - \zeta + k_p, \qquad
        \rho = e^{-b \pi / 2M} .

    Parameters
    ----------
    pole : float
        Laguerre pole :math:`\zeta`, in (-1, 1).
    n_members : int
        Number M of members.
    bandwidth : float
        The bandwidth b, above 0. At b = 1, the power of a member's response has fallen to one half
        at the boundary to its neighbour's cell.

    Returns
    -------
    kp, ki : ndarray of shape (n_members,)
        Gains of each member.

    Examples
    --------
    >>> kp, ki = member_gains(0.3, 2, 1.0)
    >>> loop = np.array([[0.3 - kp[0], 1.0], [-ki[0], 1.0]])
    >>> np.abs(np.linalg.eigvals(loop)) / np.exp(-np.pi / 4)
    array([1., 1.])
    """
    radius = np.exp(-bandwidth * np.pi / (2 * n_members))
    kp = 1 + pole - 2 * radius * np.cos(frequency_grid(n_members))
    return kp, radius**2 - pole + kp


def bank_levels(
    innovations: NDArray[Any],
    pole: float,
    kp: NDArray[Any],
    ki: NDArray[Any],
    bound: NDArray[Any],
    step: float,
) -> tuple[NDArray[Any], NDArray[Any]]:
    r"""Compute the power and the switching gain of each member's fault estimate.

    A member has the error e, the integral p and the fault estimate d:

    .. math::

        e = \varepsilon - c, \qquad c^+ = \zeta c + k_p e + d, \qquad p^+ = p + k_i e, \qquad
        d^+ = (1 + \min(|p^+|, M))\,p^+ ,

    This is the extended-state observer with two equal integral gains. With :math:`M = 0` it is
    linear. The fault estimate is the sliding surface: :math:`\ln K` changes by
    ``step * sign(|d| - K)`` per sample. The gain K starts at the root mean square of d. It settles
    in a first pass over the window, and is averaged in a second pass.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_samples)
        Innovations.
    pole : float
        The Laguerre pole :math:`\zeta`.
    kp, ki, bound : ndarray of shape (n_members,)
        Gains and bound of each member. The bound is in the unit of the innovations.
    step : float
        Step of the gain's logarithm per sample, above 0.

    Returns
    -------
    power, switching_gain : ndarray of shape (n_windows, n_members)
        Natural logarithms of the mean of :math:`d^2` and of the square of K, in units of the
        window's largest value. They are not below -27.6, which stands for no power.
    """
    n_windows, n_samples = innovations.shape
    peak = np.max(np.abs(innovations), axis=1)
    unit = np.where(peak > 0, peak, 1.0)
    signals = (innovations / unit[:, np.newaxis]).astype(np.float32)
    # A bound far above whatever an estimate can reach is none.
    unit = np.minimum(unit, 1e30).astype(np.float32)
    n_blocks = -(-len(kp) // _TOGETHER)
    # A member with gains of zero does nothing: such members fill the last block.
    gains = np.zeros((4, n_blocks * _TOGETHER), dtype=np.float32)
    gains[:, : len(kp)] = pole - kp, kp, ki, bound
    gains = gains.reshape(4, n_blocks, _TOGETHER).transpose(1, 0, 2).reshape(n_blocks, -1)
    levels = np.empty((2, n_windows, n_blocks, _TOGETHER))
    ratios = np.exp([2 * step, -2 * step]).astype(np.float32)
    squares, state = (np.empty(n * _TOGETHER, dtype=np.float32) for n in (n_samples, 4))
    _fill_levels(signals, unit, np.ascontiguousarray(gains), ratios, squares, state, levels)
    power, steps = levels.reshape(2, n_windows, -1)[..., : len(kp)]
    power = np.log(power)
    return power, power + 2 * step * steps


@compiled
def _fill_levels(signals, unit, gains, ratios, squares, state, levels):
    """Write the mean square, and the mean number of steps of the gain above its start."""
    n_windows, n_samples = signals.shape
    inverse = np.float32(1.0 / n_samples)
    for w in range(n_windows):
        for block in range(len(gains)):
            state[:] = 0.0
            _estimate(signals[w], unit[w], gains[block], squares, state)
            for i in range(_TOGETHER):
                state[i] = state[i + 3 * _TOGETHER] * inverse
                levels[0, w, block, i] = state[i]
            state[_TOGETHER : 2 * _TOGETHER] = 0.0
            # The steps of the settling pass count for where the second one begins.
            for _ in range(2):
                state[2 * _TOGETHER : 3 * _TOGETHER] = 0.0
                _vote(squares, ratios, state)
            for i in range(_TOGETHER):
                levels[1, w, block, i] = state[i + 2 * _TOGETHER] * inverse


@inlined
def _estimate(signal, unit, gains, squares, state):
    """Compute the squares of the fault estimates, and their sum.

    `state` holds correction, integral, estimate and sum of `_TOGETHER` members. `gains` holds
    their feedback of the correction, kp, ki and bound. The loop processes four samples at a time,
    which saves loads and stores.
    """
    n, floor = _TOGETHER, np.float32(_FLOOR)
    whole = len(signal) - len(signal) % 4
    for k in range(0, whole, 4):
        x0, x1, x2, x3 = signal[k], signal[k + 1], signal[k + 2], signal[k + 3]
        out = squares[k * n : (k + 4) * n]
        for i in range(n):
            c, p, d = state[i], state[i + n], state[i + 2 * n]
            a, kp, ki, bound = gains[i], gains[i + n], gains[i + 2 * n], gains[i + 3 * n]
            c, p, d, s0 = _one_sample(x0, c, p, d, a, kp, ki, bound, unit, floor)
            c, p, d, s1 = _one_sample(x1, c, p, d, a, kp, ki, bound, unit, floor)
            c, p, d, s2 = _one_sample(x2, c, p, d, a, kp, ki, bound, unit, floor)
            c, p, d, s3 = _one_sample(x3, c, p, d, a, kp, ki, bound, unit, floor)
            out[i] = s0
            out[i + n] = s1
            out[i + 2 * n] = s2
            out[i + 3 * n] = s3
            state[i + 3 * n] += (s0 + s1) + (s2 + s3)
            state[i] = c
            state[i + n] = p
            state[i + 2 * n] = d
    for k in range(whole, len(signal)):
        for i in range(n):
            c, p, d = state[i], state[i + n], state[i + 2 * n]
            a, kp, ki, bound = gains[i], gains[i + n], gains[i + 2 * n], gains[i + 3 * n]
            c, p, d, s0 = _one_sample(signal[k], c, p, d, a, kp, ki, bound, unit, floor)
            squares[k * n + i] = s0
            state[i + 3 * n] += s0
            state[i] = c
            state[i + n] = p
            state[i + 2 * n] = d


@inlined
def _one_sample(x, c, p, d, a, kp, ki, bound, unit, floor):
    p = p + ki * (x - c)
    c = a * c + kp * x + d
    d = (np.float32(1.0) + min(unit * abs(p), bound)) * p
    return c, p, d, d * d + floor


@inlined
def _vote(squares, ratios, state):
    """Run the switching gains over the window once.

    `state` holds the squared gain, the number of steps up minus steps down, and the sum of this
    number over time.
    """
    n = _TOGETHER
    up, down = ratios[0], ratios[1]
    n_samples = len(squares) // n
    whole = n_samples - n_samples % 4
    for k in range(0, whole, 4):
        sizes = squares[k * n : (k + 4) * n]
        for i in range(n):
            gain, steps, total = state[i], state[i + n], state[i + 2 * n]
            s0, s1, s2, s3 = sizes[i], sizes[i + n], sizes[i + 2 * n], sizes[i + 3 * n]
            gain, steps, total = _one_vote(s0, gain, steps, total, up, down)
            gain, steps, total = _one_vote(s1, gain, steps, total, up, down)
            gain, steps, total = _one_vote(s2, gain, steps, total, up, down)
            gain, steps, total = _one_vote(s3, gain, steps, total, up, down)
            state[i] = gain
            state[i + n] = steps
            state[i + 2 * n] = total
    for k in range(whole, n_samples):
        for i in range(n):
            gain, steps, total = state[i], state[i + n], state[i + 2 * n]
            gain, steps, total = _one_vote(squares[k * n + i], gain, steps, total, up, down)
            state[i] = gain
            state[i + n] = steps
            state[i + 2 * n] = total


@inlined
def _one_vote(size, gain, steps, total, up, down):
    above = size > gain
    steps = steps + (np.float32(1.0) if above else np.float32(-1.0))
    return gain * (up if above else down), steps, total + steps
