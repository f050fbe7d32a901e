"""Observer loops on innovations (equations 17-20, A-1, A-2) and their stability."""

import math
from typing import Any

import numpy as np

from .arrays import Array
from .compiled import compiled
from .scaling import root_mean_square


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
    shape = innovations.shape
    fault_estimate = np.empty((shape[-1], math.prod(shape[:-1])))
    error, _ = _run_loops(innovations, loop, fault_estimate)
    return error.T.reshape(shape), fault_estimate.T.reshape(shape)


def power_levels(innovations: Array, loop: tuple[Any, ...]) -> Array:
    """Compute the root mean square of the output error.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_models, n_samples)
        The innovations.
    loop : tuple of 4 floats
        As in `observe`.

    Returns
    -------
    ndarray of shape (n_windows, n_models)
        Levels, in the unit of the innovations.
    """
    *shape, n_samples = innovations.shape
    error, power = _run_loops(innovations, loop, np.empty((0, 0)))
    levels = np.sqrt(power / n_samples)
    # Squares of extreme windows may have overflowed or underflowed.
    is_extreme = ~((levels > 1e-140) & (levels < 1e140))
    levels[is_extreme] = root_mean_square(error.T[is_extreme])
    return levels.reshape(shape)


def _run_loops(innovations, loop, fault_estimate):
    """Return errors of shape (n_samples, n_signals), and the sum of their squares."""
    # Signals side by side are worked on together.
    signals = innovations.reshape(-1, innovations.shape[-1])
    error = signals.T.astype(np.float64, order="C")
    state = np.zeros((4, error.shape[1]))
    _replace_by_error(error, *loop, state, fault_estimate)
    return error, state[3]


@compiled
def _replace_by_error(error, pole, kp, ki, bound, state, fault_estimate):
    """Replace innovations by the output error, and fill the fault estimate.

    `state` holds correction, integral, estimate and sum of squares of each signal.
    """
    n_samples, n_signals = error.shape
    for k in range(n_samples):
        if k < len(fault_estimate):
            for i in range(n_signals):
                fault_estimate[k, i] = state[2, i]
        for i in range(n_signals):
            e = error[k, i] - state[0, i]
            integral = state[1, i] + ki * e
            state[0, i] = pole * state[0, i] + kp * e + state[2, i]
            state[1, i] = integral
            state[2, i] = integral + min(abs(integral), bound) * integral
            state[3, i] += e * e
            error[k, i] = e


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
