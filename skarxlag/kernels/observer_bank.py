"""A bank of observers over frequency: levels of each member's fault estimate.

Every member runs the recursion of `observer.observe` on the same innovations, with its
own gains. The members are independent, so the loops over them use vector instructions.
They compute in single precision. A fault estimate is the output of a filter with two
poles, and the relative rounding error of this filter is less than 1e-5.
"""

import numpy as np

from .arrays import Array
from .compiled import compiled, inlined
from .spectra import frequency_grid

#: Members that are worked on together: each has to wait for its own sample before, and
#: the state of so many fits in the fastest memory.
_TOGETHER = 64
#: Samples between loads and stores of the state.
_AT_ONCE = 4
#: Groups of `_AT_ONCE` samples in which the switching gain settles: it can cross 11
#: decades of power at a step of 0.05.
_SETTLING = 64
#: Groups after which sums of steps go to double precision. Sums of so many samples are
#: exact.
_EXACT = 4096
#: Share of the innovations' power by which the square of every estimate is raised: an
#: estimate that is nothing but rounding is steady.
_FLOOR = 1e-12
#: Limits of the largest sample. Beyond them, the bound has no effect or is reached at
#: once, and single precision has no room.
_SMALLEST = 1e-9
_LARGEST = 1e9


def member_gains(pole: float, n_members: int, radius: float) -> tuple[Array, Array]:
    r"""Compute the gains that give member m the closed-loop poles :math:`\rho\,e^{\pm j\omega_m}`.

    The loop has the characteristic polynomial :math:`z^2 - (1 + a) z + a + k_i` with
    :math:`a = \zeta - k_p`. Hence

    .. math::

        k_p = 1 + \zeta - 2\rho\cos\omega_m, \qquad k_i = \rho^2 - \zeta + k_p .

    Parameters
    ----------
    pole : float
        Laguerre pole :math:`\zeta`, in (-1, 1).
    n_members : int
        Number M of members.
    radius : float
        The spectral radius :math:`\rho` of every member, in [0, 1).

    Returns
    -------
    kp, ki : ndarray of shape (n_members,)
        Gains of each member.

    Examples
    --------
    >>> kp, ki = member_gains(0.3, 2, 0.9)
    >>> loop = np.array([[0.3 - kp[0], 1.0], [-ki[0], 1.0]])
    >>> np.abs(np.linalg.eigvals(loop))
    array([0.9, 0.9])
    """
    kp = 1 + pole - 2 * radius * np.cos(frequency_grid(n_members))
    return kp, radius**2 - pole + kp


def bank_levels(
    innovations: Array,
    pole: float,
    kp: Array,
    ki: Array,
    bound: Array,
    step: float,
) -> tuple[Array, Array]:
    r"""Compute the power and the switching gain of each member's fault estimate.

    A member has the error e, the integral p and the fault estimate d:

    .. math::

        e = \varepsilon - c, \qquad c^+ = \zeta c + k_p e + d, \qquad p^+ = p + k_i e, \qquad
        d^+ = (1 + \min(|p^+|, M))\,p^+ .

    With :math:`M = 0` it is linear. The loop computes c by way of the error, since all
    members then share the terms in the innovations:

    .. math::

        e^+ = (\varepsilon^+ - \zeta\varepsilon) + (\zeta - k_p)\,e - d .

    The fault estimate is the sliding surface: :math:`\ln K` changes by ``step *
    sign(|d| - K)`` per sample. The gain K starts at the root mean square of d. It
    settles in a first pass over 253 to 256 samples, or over a shorter window, and is
    averaged in a second pass over all samples.

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
        Natural logarithms of the mean of :math:`d^2` and of the square of K, in units
        of the window's largest value. They are not below -27.6, which stands for no
        power.
    """
    n_windows, n_samples = innovations.shape
    peak = np.abs(innovations).max(axis=1)
    size = np.minimum(np.maximum(peak, _SMALLEST), _LARGEST)
    scale = size / np.maximum(peak, np.finfo(np.float64).tiny)
    floor = (_FLOOR * size**2).astype(np.float32)
    members = _blocks_of_members(pole - kp, ki, bound)
    # Zeros before the first sample leave a member at rest. They make the last group
    # whole.
    padding = -n_samples % _AT_ONCE
    signal = np.zeros(padding + n_samples, dtype=np.float32)
    n_states = members.shape[1]
    n_squares = len(signal) * _TOGETHER
    work = np.empty(n_states + n_squares + 16, dtype=np.float32)
    # Vectors that lie in two cache lines take longer to store.
    work = work[-work.ctypes.data % 64 // 4 :]
    squares = work[n_states : n_states + n_squares].reshape(-1, _AT_ONCE * _TOGETHER)
    logs_of_ratios = 2 * step * np.array([1, -1, padding])
    ratios = np.exp(logs_of_ratios).astype(np.float32)
    levels = np.empty((3, n_windows, len(members), _TOGETHER))
    _fill_levels(
        innovations,
        pole,
        scale,
        floor,
        members,
        ratios,
        signal,
        work[:n_states],
        squares,
        levels,
    )
    levels = levels.reshape(3, n_windows, -1)[..., : len(kp)]
    power, settled = np.log(levels[:2] / size[:, np.newaxis] ** 2)
    sum_of_steps = levels[2]
    return power, settled + 2 * step * sum_of_steps / n_samples


def _blocks_of_members(a, ki, bound):
    """Return rows of `_TOGETHER` members: zeros for their four states, then their three gains."""
    # A member with gains of zero does nothing: such members fill the last block.
    n_members = len(ki)
    members = np.zeros((7, n_members + -n_members % _TOGETHER), dtype=np.float32)
    members[4, :n_members] = a
    members[5, :n_members] = ki
    members[6, :n_members] = bound
    blocks = members.reshape(7, -1, _TOGETHER).swapaxes(0, 1)
    return blocks.reshape(-1, 7 * _TOGETHER)


@compiled
def _fill_levels(
    innovations, pole, scale, floor, members, ratios, signal, state, squares, levels
):
    """Write the mean square, the square of the settled gain, and the sum of the steps from there.

    The sum is over all samples, of the number of steps up minus that of steps down.
    """
    n = _TOGETHER
    n_samples = innovations.shape[1]
    up = ratios[0]
    down = ratios[1]
    lift = ratios[2]
    padding = len(signal) - n_samples
    for w in range(len(innovations)):
        before = 0.0
        for k in range(n_samples):
            sample = scale[w] * innovations[w, k]
            signal[padding + k] = sample - pole * before
            before = sample
        for block in range(len(members)):
            for i in range(len(state)):
                state[i] = members[block, i]
            _estimate(signal, floor[w], state, squares)
            for i in range(n):
                state[i] = (state[i + 3 * n] - padding * floor[w]) / n_samples
                levels[0, w, block, i] = state[i]
            for sizes in (squares[:_SETTLING], squares):
                for i in range(n):
                    levels[1, w, block, i] = state[i]
                    # The zeros before the first sample vote, too: these steps make up
                    # for them.
                    state[i] *= lift
                    state[i + n] = padding
                    levels[2, w, block, i] = -padding * (padding - 1) / 2
                for group in range(0, len(sizes), _EXACT):
                    for i in range(n):
                        state[i + 2 * n] = 0.0
                    _vote(sizes[group : group + _EXACT], up, down, state)
                    for i in range(n):
                        levels[2, w, block, i] += state[i + 2 * n]


@inlined
def _estimate(signal, floor, state, squares):
    """Compute the squares of the fault estimates, and their sum.

    `state` holds, of `_TOGETHER` members each: the next error but for its sample,
    integral, estimate and sum; feedback of the error, ki and bound.
    """
    n = _TOGETHER
    for group in range(len(squares)):
        k = group * _AT_ONCE
        samples = (signal[k], signal[k + 1], signal[k + 2], signal[k + 3])
        out = squares[group]
        for i in range(n):
            rest = state[i]
            p = state[i + n]
            d = state[i + 2 * n]
            total = state[i + 3 * n]
            a = state[i + 4 * n]
            ki = state[i + 5 * n]
            bound = state[i + 6 * n]
            for j in range(_AT_ONCE):
                e = samples[j] + rest
                rest = a * e - d
                p = p + ki * e
                d = p + min(abs(p), bound) * p
                size = d * d + floor
                total = total + size
                out[i + j * n] = size
            state[i] = rest
            state[i + n] = p
            state[i + 2 * n] = d
            state[i + 3 * n] = total


@inlined
def _vote(squares, up, down, state):
    """Run the switching gains over `squares` once.

    `state` holds the squared gain, its steps up minus its steps down, and the sum of
    these over the samples.
    """
    n = _TOGETHER
    for group in range(len(squares)):
        sizes = squares[group]
        for i in range(n):
            gain = state[i]
            steps = state[i + n]
            total = state[i + 2 * n]
            for j in range(_AT_ONCE):
                above = sizes[i + j * n] > gain
                gain = gain * (up if above else down)
                steps = steps + np.float32(1.0 if above else -1.0)
                total = total + steps
            state[i] = gain
            state[i + n] = steps
            state[i + 2 * n] = total
