"""Observer loops on innovations (equations 17-20, A-1, A-2) and their stability."""

from typing import Any

import numpy as np

from .arrays import Array
from .compiled import compiled, inlined
from .lanes import LANES, TILE, deinterleave, interleave

#: Rows of the histories of a loop.
INNOVATION, ERROR, CORRECTION, INTEGRAL, ESTIMATE, POWER = range(6)


def observe(innovations: Array, loop: tuple[Any, ...]) -> tuple[Array, Array]:
    r"""Compute the output error and the fault estimate of the extended-state observer, Form A.

    The fault direction E and the output correction K_p of the full-state observer are
    chosen so that both act on the output through :math:`1/(z - \zeta)`. The error of
    the observer then depends on the innovations alone:

    .. math::

        e &= \varepsilon - c, \qquad c^+ = \zeta c + k_p e + \hat\delta, \\
        p^+ &= p + k_i e, \qquad \hat\delta^+ = (1 + \min(|p^+|, M))\, p^+ .

    With :math:`M = 0`, this is the linear proportional-integral observer.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_models, n_samples)
        The innovations of each model.
    loop : tuple of 4 floats
        :math:`\zeta, k_p, k_i, M \ge 0`.

    Returns
    -------
    error : ndarray of shape (n_windows, n_models, n_samples)
        The output error e.
    fault_estimate : ndarray of shape (n_windows, n_models, n_samples)
        The fault estimate at sample k, computed from the samples before k.
    """
    error = np.empty(innovations.shape)
    fault_estimate = np.empty(innovations.shape)
    _record_trajectories(innovations, loop, loop_histories(), error, fault_estimate)
    return error, fault_estimate


def loop_histories() -> Any:
    """Allocate the histories of the loop's signals and of the sum of e squared, for one block."""
    return np.zeros((POWER + 1, (TILE + 1) * LANES))


@compiled
def _record_trajectories(innovations, loop, histories, error, fault_estimate):
    """Compute `error` and `fault_estimate` block by block, and write them into these arrays."""
    n_windows, n_models, n_samples = innovations.shape
    for w in range(0, n_windows, LANES):
        for c in range(n_models):
            histories[CORRECTION:, :LANES] = 0.0
            for start in range(0, n_samples, TILE):
                observe_block(innovations, w, c, start, loop, histories)
                deinterleave(histories[ERROR], error, w, c, start)
                deinterleave(histories[ESTIMATE], fault_estimate, w, c, start)
                carry_loop(histories, TILE)


@inlined
def observe_block(
    innovations: Any,
    first: int,
    model: int,
    start: int,
    loop: tuple[Any, ...],
    histories: Any,
) -> None:
    """Run the loop through one block of windows, see `lanes`.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_models, n_samples)
        The innovations.
    first, model, start : int
        First window, model and first sample.
    loop : tuple of 4 floats
        As in `observe`.
    histories : ndarray of shape (6, (TILE + 1) * LANES)
        Innovations, error, correction, integral, fault estimate and sum of squared
        errors.
    """
    pole, kp, ki, bound = loop
    interleave(innovations, first, model, start, histories[INNOVATION])
    for i in range(TILE * LANES):
        e = histories[INNOVATION, i] - histories[CORRECTION, i]
        integral = histories[INTEGRAL, i] + ki * e
        correction = pole * histories[CORRECTION, i] + kp * e + histories[ESTIMATE, i]
        histories[ERROR, i] = e
        histories[CORRECTION, i + LANES] = correction
        histories[INTEGRAL, i + LANES] = integral
        histories[ESTIMATE, i + LANES] = integral + min(abs(integral), bound) * integral
        histories[POWER, i + LANES] = histories[POWER, i] + e * e


@inlined
def carry_loop(histories: Any, n_samples: Any) -> None:
    """Copy one sample of the block to the beginning of the histories, for the next block."""
    for row in range(CORRECTION, POWER + 1):
        for lane in range(LANES):
            histories[row, lane] = histories[row, n_samples * LANES + lane]


def spectral_radius(pole: float, kp: float, ki: float) -> float:
    r"""Compute the largest modulus of the poles of the loop for small faults.

    The characteristic polynomial is :math:`z^2 - (1 + a) z + a + k_i` with :math:`a =
    \zeta - k_p`. If :math:`k_i = 0`, the integral has no effect, and its pole at 1 does
    not count.

    Parameters
    ----------
    pole, kp, ki : float
        Laguerre pole, proportional and integral gain.

    Returns
    -------
    float
        The spectral radius. The loop is stable if it is below 1.

    Examples
    --------
    >>> round(spectral_radius(0.3, 0.1, 0.07), 12)
    0.9
    """
    a = pole - kp
    if ki == 0:
        return abs(a)
    return float(np.abs(np.roots([1.0, -1 - a, a + ki])).max())


def meets_circle_criterion(pole: float, kp: Array, ki: Array, bound: Array) -> Array:
    r"""Return whether loops are stable for every sequence of gains up to a bound.

    The gain from the integral to the estimate lies between 1 and :math:`1 + M`. With
    the polynomial :math:`P(z) = (z - a)(z - 1)`, :math:`a = \zeta - k_p`, :math:`l =
    k_i` and :math:`h = k_i (1 + M)`, the discrete circle criterion (Tsypkin) is

    .. math::

        |P|^2 + (h + l)\,\mathrm{Re}\,P + h\,l > 0 \quad\text{for all } |z| = 1 .

    This is a quadratic function of the real part of z, whose least value is known in
    closed form. The criterion holds if and only if the loops with the gains l and h
    have a common quadratic Lyapunov function.

    Parameters
    ----------
    pole : float
        The Laguerre pole :math:`\zeta`.
    kp, ki, bound : ndarray
        Gains, and the bound M. The loop must be stable for small faults.

    Returns
    -------
    ndarray of bool
        True for loops that meet the criterion.

    Examples
    --------
    >>> meets_circle_criterion(0.3, 0.1, 0.05, np.array([1.0, 20.0]))
    array([ True, False])
    """
    a = pole - np.asarray(kp)
    low = np.asarray(ki, dtype=np.float64)
    high = low * (1 + np.asarray(bound))
    both = low + high
    square = 4 * a + 2 * both
    slope = -2 * (1 + a) ** 2 - both * (1 + a)
    constant = 2 * (1 + a**2) + both * (a - 1) + low * high
    is_bowl = square > 0
    bottom = np.divide(-slope, 2 * square, out=np.zeros_like(slope), where=is_bowl)
    places = np.stack(
        [np.full_like(slope, -1.0), np.full_like(slope, 1.0), np.clip(bottom, -1, 1)]
    )
    return ((square * places + slope) * places + constant > 0).all(axis=0)
