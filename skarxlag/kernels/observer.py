"""Observer loops on innovations (equations 17-20, A-1, A-2) and their stability."""

from typing import Any

import numpy as np
from scipy import linalg

from .arrays import Array
from .compiled import compiled, inlined
from .lanes import LANES, TILE, aligned_zeros, deinterleave, interleave

#: Rows of the histories of a loop.
INNOVATION, ERROR, CORRECTION, INTEGRAL, ESTIMATE, POWER = range(6)


def observe(innovations: Array, loop: tuple[Any, ...]) -> tuple[Array, Array]:
    r"""Compute the output error and the fault estimate of the extended-state observer, Form A.

    The fault direction E and the output correction K_p of the full-state observer are
    chosen so that both act on the output through :math:`1/(z - \zeta)`. The error of
    the observer then depends on the innovations alone:

    .. math::

        e &= \varepsilon - c, \qquad c^+ = \zeta c + k_p e + \hat\delta, \qquad
        p^+ = p + k_{Ia} e, \\
        S &= p + k_{Ib} e, \qquad
        \hat\delta^+ = K_c\,(1 + \min(|S|, M)^\kappa)\, p^+ .

    With :math:`K_c = 1` and :math:`M = 0`, this is the linear proportional-integral
    observer.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_models, n_samples)
        The innovations of each model.
    loop : tuple of 7 floats
        :math:`\zeta, k_p, k_{Ia}, k_{Ib}, K_c, \kappa > 0, M \ge 0`.

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
    return aligned_zeros(POWER + 1, (TILE + 1) * LANES)


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
    loop : tuple of 7 floats
        As in `observe`.
    histories : ndarray of shape (6, (TILE + 1) * LANES)
        Innovations, error, correction, integral, fault estimate and sum of squared
        errors.
    """
    _, _, _, _, _, exponent, _ = loop
    interleave(innovations, first, model, start, histories[INNOVATION])
    if exponent == 1.0:
        for i in range(TILE * LANES):
            surface = _surface(histories, i, loop)
            _close_loop(histories, i, surface, loop)
    else:
        # A power in a loop, even one that is never taken, keeps it from running on
        # vectors.
        for i in range(TILE * LANES):
            surface = _surface(histories, i, loop) ** exponent
            _close_loop(histories, i, surface, loop)


@inlined
def _surface(histories, i, loop):
    _, _, _, ki_b, _, _, saturation = loop
    e = histories[INNOVATION, i] - histories[CORRECTION, i]
    return min(abs(histories[INTEGRAL, i] + ki_b * e), saturation)


@inlined
def _close_loop(histories, i, surface, loop):
    pole, kp, ki_a, _, gain, _, _ = loop
    e = histories[INNOVATION, i] - histories[CORRECTION, i]
    integral = histories[INTEGRAL, i] + ki_a * e
    correction = pole * histories[CORRECTION, i] + kp * e + histories[ESTIMATE, i]
    histories[ERROR, i] = e
    histories[CORRECTION, i + LANES] = correction
    histories[INTEGRAL, i + LANES] = integral
    histories[ESTIMATE, i + LANES] = gain * (1.0 + surface) * integral
    histories[POWER, i + LANES] = histories[POWER, i] + e * e


@inlined
def carry_loop(histories: Any, n_samples: Any) -> None:
    """Copy one sample of the block to the beginning of the histories, for the next block."""
    for row in range(CORRECTION, POWER + 1):
        for lane in range(LANES):
            histories[row, lane] = histories[row, n_samples * LANES + lane]


def loop_matrix(pole: float, kp: float, ki: float, gain: float = 1.0) -> Array:
    """Return the closed-loop matrix of correction and integral, for a constant gain.

    Parameters
    ----------
    pole, kp, ki : float
        Laguerre pole, proportional and integral gain.
    gain : float, default=1.0
        Gain from the integral to the fault estimate.

    Returns
    -------
    ndarray of shape (2, 2)
        The matrix. The loop is stable if its spectral radius is below 1. With a = pole
        - kp and k = ki gain, Jury's conditions for this are k > 0, a + k < 1 and 2 (1 +
        a) + k > 0.

    Examples
    --------
    >>> loop_matrix(0.0, 0.5, 0.1, 2.0)
    array([[-0.5,  2. ],
           [-0.1,  1. ]])
    """
    return np.array([[pole - kp, gain], [-ki, 1.0]], dtype=np.float64)


def common_lyapunov(slow: Array, fast: Array) -> Array | None:
    r"""Find a quadratic Lyapunov function that two loops share, or None if there is none.

    The loops differ in the gain from integral to estimate. A common function
    :math:`V(x) = x^T P x` also decreases for any gain between theirs, even if the gain
    changes from sample to sample. P solves the Riccati equation of the discrete
    positive-real lemma, which is the matrix form of the circle criterion. The function
    checks P on both loops before it returns it.

    Parameters
    ----------
    slow, fast : ndarray of shape (2, 2)
        `loop_matrix` at the smallest and at the largest gain.

    Returns
    -------
    ndarray of shape (2, 2) or None
        Positive definite P with A'PA - P negative definite for both A.

    Examples
    --------
    >>> P = common_lyapunov(loop_matrix(0.0, 0.5, 0.1), loop_matrix(0.0, 0.5, 0.1, 2.0))
    >>> bool((np.linalg.eigvalsh(P) > 0).all())
    True
    >>> common_lyapunov(loop_matrix(0.0, 0.5, 0.1), loop_matrix(0.0, 0.5, 0.1, 20.0)) is None
    True
    """
    if np.abs(np.linalg.eigvals([slow, fast])).max() >= 1:
        return None
    spread = fast[0, 1] - slow[0, 1]
    if spread == 0:
        P = linalg.solve_discrete_lyapunov(slow.T, np.eye(2))
    else:
        enter = np.array([[1.0], [0.0]])
        leave = np.array([[0.0], [1.0]])
        slack = 1e-9 * np.eye(2)
        try:
            P = -linalg.solve_discrete_are(
                slow, enter, -slack, [[2.0]], s=-spread * leave
            )
        except (linalg.LinAlgError, ValueError):
            return None
    for A in (slow, fast):
        change = A.T @ P @ A - P
        if not np.linalg.eigvalsh(change)[-1] < 0:
            return None
    return P
