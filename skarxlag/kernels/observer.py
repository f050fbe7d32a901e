"""Observer loops on innovations (Eqs. 17-20, A-1, A-2) and their stability."""

import math

import numpy as np
from scipy import linalg

from .compiled import compiled


@compiled
def observe(innovations, pole, kp, ki_a, ki_b, gain, exponent, saturation):
    r"""Output error and fault estimate of the extended-state observer, Form A.

    With the fault direction E and the output correction K_p of the full-state observer chosen so
    that both reach the output through :math:`1/(z - \zeta)`, its error depends on the innovations
    alone:

    .. math::

        e &= \varepsilon - c, \qquad c^+ = \zeta c + k_p e + \hat\delta, \qquad
        p^+ = p + k_{Ia} e, \\
        S &= p + k_{Ib} e, \qquad
        \hat\delta^+ = K_c\,(1 + \min(|S|, M)^\kappa)\, p^+ .

    With :math:`K_c = 1` and :math:`M = 0` it is the linear proportional-integral observer.

    Parameters
    ----------
    innovations : ndarray of shape (n_signals, n_samples)
        The innovations of one model on one window in every row.
    pole, kp, ki_a, ki_b, gain, exponent, saturation : float
        The Laguerre pole and the constants above; exponent > 0, saturation >= 0.

    Returns
    -------
    error : ndarray of shape (n_signals, n_samples)
        The output error e.
    fault_estimate : ndarray of shape (n_signals, n_samples)
        The fault estimate before sample k is seen.
    """
    n_signals, n_samples = innovations.shape
    error = np.empty((n_signals, n_samples))
    fault_estimate = np.empty((n_signals, n_samples))
    for signal in range(n_signals):
        correction, integral, estimate = 0.0, 0.0, 0.0
        for k in range(n_samples):
            e = innovations[signal, k] - correction
            error[signal, k] = e
            fault_estimate[signal, k] = estimate
            correction = pole * correction + kp * e + estimate
            surface = min(abs(integral + ki_b * e), saturation)
            integral += ki_a * e
            estimate = gain * (1.0 + surface**exponent) * integral
    return error, fault_estimate


@compiled
def adapt_switching_gain(surface, start, step):
    r"""Switching gain that follows the size of the sliding surface.

    :math:`\ln K_s^+ = \ln K_s + \mathrm{step}\,\mathrm{sgn}(|S| - K_s)` rests where |S| lies above
    and below equally often: at its median.

    Parameters
    ----------
    surface : ndarray of shape (n_signals, n_samples)
        The sliding surface S.
    start : ndarray of shape (n_signals,)
        Gain before the first sample, above 0; rows that start at 0 stay there.
    step : float
        Step of the logarithm, above 0.

    Returns
    -------
    ndarray of shape (n_signals, n_samples)
        The gain after each sample.
    """
    n_signals, n_samples = surface.shape
    gain = np.empty((n_signals, n_samples))
    up, down = math.exp(step), math.exp(-step)
    for signal in range(n_signals):
        k_s = start[signal]
        for k in range(n_samples):
            size = abs(surface[signal, k])
            if size > k_s:
                k_s *= up
            elif size < k_s:
                k_s *= down
            gain[signal, k] = k_s
    return gain


def loop_matrix(pole, kp, ki, gain=1.0):
    """Closed loop of correction and integral for a constant gain from integral to estimate.

    Parameters
    ----------
    pole, kp, ki : float
        Laguerre pole, proportional and integral gain.
    gain : float, default=1.0
        Slope of the map from the integral to the fault estimate.

    Returns
    -------
    ndarray of shape (2, 2)
        Stable where its spectral radius is below 1: by Jury's conditions, with a = pole - kp and
        k = ki gain, where k > 0, a + k < 1 and 2 (1 + a) + k > 0.

    Examples
    --------
    >>> loop_matrix(0.0, 0.5, 0.1, 2.0)
    array([[-0.5,  2. ],
           [-0.1,  1. ]])
    """
    return np.array([[pole - kp, gain], [-ki, 1.0]])


def common_lyapunov(slow, fast):
    r"""Quadratic Lyapunov function shared by two loops, or None where there is none.

    The loops differ in the gain from integral to estimate, so any gain between theirs, changing
    from sample to sample, decreases :math:`V(x) = x^T P x` as well. P solves the Riccati equation
    of the discrete positive-real lemma, the matrix form of the circle criterion; what it returns
    has been checked on both loops.

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
    spread = fast[0, 1] - slow[0, 1]
    if spread == 0:
        if np.abs(linalg.eigvals(slow)).max() >= 1:
            return None
        P = linalg.solve_discrete_lyapunov(slow.T, np.eye(2))
    else:
        enter, leave = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
        slack = 1e-9 * np.eye(2)
        try:
            P = -linalg.solve_discrete_are(slow, enter, -slack, [[2.0]], s=-spread * leave)
        except (linalg.LinAlgError, ValueError):
            return None
    certified = np.linalg.eigvalsh(P)[0] > 0 and all(
        np.linalg.eigvalsh(A.T @ P @ A - P)[-1] < 0 for A in (slow, fast)
    )
    return P if certified else None
