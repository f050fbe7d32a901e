"""The orthonormal Laguerre filter network (equations 4-6, 11-15 of the paper)."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import block_diag, toeplitz

from .arrays import Array


def laguerre_matrices(order: int, pole: float) -> tuple[Array, Array]:
    r"""Return the state space of one Laguerre network, Eqs. (13)-(15).

    :math:`x(k+1) = A x(k) + b s(k)` realises the filters :math:`L_n(z) =
    \frac{\sqrt{1-\zeta^2}}{z-\zeta}\left(\frac{1-\zeta z}{z-\zeta}\right)^n` for n = 0
    .. order - 1. The exponent in the corner of the printed matrix is wrong by one. Here
    :math:`A_{nj} = (-\zeta)^{n-j-1}(1-\zeta^2)` for n > j. The network is
    input-balanced: :math:`A A^T + b b^T = I`.

    Parameters
    ----------
    order : int
        Number of filters N, at least 1.
    pole : float
        The shared pole :math:`\zeta`, in (-1, 1).

    Returns
    -------
    A : ndarray of shape (order, order)
        Lower triangular, `pole` on the diagonal.
    b : ndarray of shape (order,)
        Input vector.

    Examples
    --------
    >>> A, b = laguerre_matrices(3, 0.5)
    >>> A
    array([[ 0.5  ,  0.   ,  0.   ],
           [ 0.75 ,  0.5  ,  0.   ],
           [-0.375,  0.75 ,  0.5  ]])
    """
    powers = (-pole) ** np.arange(order)
    below_diagonal = (1 - pole**2) * powers[: order - 1]
    first_column = np.concatenate(([pole], below_diagonal))
    first_row = pole * np.eye(order)[0]
    A = toeplitz(first_column, first_row)
    b = math.sqrt(1 - pole**2) * powers
    return A, b


def network_matrices(orders: Sequence[int], poles: Any) -> tuple[Array, Array]:
    """Return the state space of several parallel networks, Eq. (12).

    Parameters
    ----------
    orders : sequence of int, of length n_channels
        Number of filters on each channel.
    poles : sequence of float, of length n_channels
        Pole of each channel.

    Returns
    -------
    A : ndarray of shape (n_states, n_states)
        Block diagonal.
    b : ndarray of shape (n_states, n_channels)
        Input matrix with one column for each channel, which is zero outside the
        channel's block.

    Examples
    --------
    >>> network_matrices([1, 1], [0.0, 0.6])[1]
    array([[1. , 0. ],
           [0. , 0.8]])
    """
    networks = [
        laguerre_matrices(order, pole)
        for order, pole in zip(orders, poles, strict=True)
    ]
    A = block_diag(*[A for A, _ in networks])
    B = block_diag(*[b[:, np.newaxis] for _, b in networks])
    return A, B


def impulse_responses(order: int, pole: float, n_samples: int) -> Array:
    """Return the states of a network after an impulse, as a cascade of all-passes.

    Parameters
    ----------
    order : int
        Number of filters N.
    pole : float
        The shared pole, in (-1, 1).
    n_samples : int
        Number of samples, the first of which follows the impulse.

    Returns
    -------
    ndarray of shape (order, n_samples)
        The states.

    Examples
    --------
    >>> impulse_responses(2, 0.6, 2)
    array([[ 0.8  ,  0.48 ],
           [-0.48 ,  0.224]])
    """
    impulse = np.zeros(n_samples)
    impulse[0] = math.sqrt(1 - pole**2)
    # No other function needs this package, which takes long to import.
    from scipy.signal import lfilter

    responses = [lfilter([1.0], [1.0, -pole], impulse)]
    for _ in range(1, order):
        responses.append(lfilter([-pole, 1.0], [1.0, -pole], responses[-1]))
    return np.array(responses)


def settling_length(order: int, pole: float) -> int:
    r"""Return the length of the transient that the zero initial states of a network cause.

    The length is the largest group delay of the network over all frequencies,
    :math:`N (1 + |\zeta|)/(1 - |\zeta|)`, rounded up.

    Parameters
    ----------
    order : int
        Number of filters N.
    pole : float
        The shared pole, in (-1, 1).

    Returns
    -------
    int
        Number of samples.

    Examples
    --------
    >>> settling_length(64, 0.0), settling_length(32, -0.5)
    (64, 96)
    """
    size = abs(pole)
    return math.ceil(order * (1 + size) / (1 - size) - 1e-9)
