"""Residual evaluation: one number for each signal (equations 21, 22 and the innovations test)."""

import math

import numpy as np

from .arrays import Array
from .compiled import compiled
from .scaling import root_mean_square

#: Share of a window over which the switching gain is averaged, at its end, once it has
#: settled.
_SETTLED = 0.5


def sliding_surface(error: Array, slope: float) -> Array:
    r"""Return the surface :math:`S(k) = \lambda e(k) + (e(k) - e(k-1))`, with e(-1) = e(0).

    Parameters
    ----------
    error : ndarray of shape (..., n_samples)
        The output error e.
    slope : float
        The slope :math:`\lambda`, at least 0.

    Returns
    -------
    ndarray of shape (..., n_samples)
        The surface, in the unit of the error.

    Examples
    --------
    >>> sliding_surface(np.array([1.0, 3.0, 2.0]), slope=0.5)
    array([0.5, 3.5, 0. ])
    """
    surface = (slope + 1) * error
    surface[..., 1:] -= error[..., :-1]
    surface[..., 0] -= error[..., 0]
    return surface


def switching_gain(surface: Array, step: float) -> Array:
    """Compute the trajectory of the adapted switching gain, which starts at the surface's RMS.

    Parameters
    ----------
    surface : ndarray of shape (n_signals, n_samples)
        The sliding surface.
    step : float
        Step of the gain's logarithm a sample, above 0.

    Returns
    -------
    ndarray of shape (n_signals, n_samples)
        The gain, in the unit of the surface.
    """
    # Signals side by side in memory are worked on together.
    gain = np.abs(surface.T, order="C")
    adapt_switching_gain(gain, root_mean_square(surface), step)
    return gain.T


@compiled
def adapt_switching_gain(sizes: Array, gain: Array, step: float) -> None:
    r"""Replace the sizes of the sliding surface by the switching gain, which follows them.

    The gain changes by :math:`\ln K_s^+ = \ln K_s + \mathrm{step}\,\mathrm{sgn}(|S| -
    K_s)`. It settles at the median of :math:`|S|`, where :math:`|S|` is above and below
    the gain equally often.

    Parameters
    ----------
    sizes : ndarray of shape (n_samples, n_signals)
        Sizes :math:`|S|` of the sliding surface. Receives the gain after each sample.
    gain : ndarray of shape (n_signals,)
        Gain before the first sample, above 0. A gain that starts at 0 stays at 0.
        Receives the gain after the last sample.
    step : float
        Step of the logarithm, above 0.
    """
    up = math.exp(step)
    down = math.exp(-step)
    for k in range(len(sizes)):
        row = sizes[k]
        for signal in range(len(gain)):
            size = row[signal]
            k_s = gain[signal]
            # A selection, because branches that depend on noise are mispredicted.
            k_s *= up if size > k_s else (down if size < k_s else 1.0)
            gain[signal] = k_s
            row[signal] = k_s


def settled_level(gain: Array) -> Array:
    """Return the geometric mean of a gain over the last half of the window; 0 if the gain is 0."""
    tail = gain[:, int(_SETTLED * gain.shape[1]) :]
    with np.errstate(divide="ignore"):
        # A sum's order follows the order in memory, and may not depend on the number of
        # signals.
        return np.exp(np.mean(np.log(tail, order="C"), axis=1))
