"""Levels of a signal: RMS, peak and crest factor."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.scaling import centred, root_mean_square


class Levels(NamedTuple):
    """Levels of windows, or of a recording, about its mean.

    Parameters
    ----------
    rms : ndarray or float
        Root of the mean square, in the unit of the signal.
    peak : ndarray or float
        Largest distance from the mean, in the unit of the signal.
    crest_factor : ndarray or float
        Peak over RMS; NaN if the signal is constant.
    """

    rms: Any
    peak: Any
    crest_factor: Any


def signal_levels(X: NDArray[Any]) -> Levels:
    r"""Compute RMS, peak and crest factor of windows.

    With the samples :math:`y_t` of a window and their mean :math:`\bar y`, the RMS is
    :math:`\sqrt{\langle (y_t - \bar y)^2 \rangle}` and the peak is :math:`\max_t |y_t -
    \bar y|`.

    Parameters
    ----------
    X : ndarray of shape (..., n_samples)
        Windows in any unit.

    Returns
    -------
    Levels
        Arrays of shape (...); NaN for a window with a sample that is not finite.

    Examples
    --------
    >>> sine = 2 + 3 * np.sin(np.arange(0, 2 * np.pi, np.pi / 50))
    >>> np.round(signal_levels(sine), 3).tolist()
    [2.121, 3.0, 1.414]
    """
    with np.errstate(invalid="ignore", over="ignore"):
        deviations, unit = centred(X)
        rms = np.sqrt(np.square(deviations).mean(axis=-1))
        peak = np.abs(deviations).max(axis=-1)
        return _levels(rms * unit[..., 0], peak * unit[..., 0])


def joined_levels(rms: NDArray[Any], peak: NDArray[Any]) -> Levels:
    """Compute the levels of a recording from those of its windows of equal length.

    Parameters
    ----------
    rms, peak : ndarray of shape (n_windows,)
        Levels of the windows. Windows with NaN are left out.

    Returns
    -------
    Levels
        Of the recording, as numbers; NaN if no window has levels.

    Examples
    --------
    >>> joined_levels(np.array([3.0, 4.0, np.nan]), np.array([5.0, 7.0, np.nan]))
    Levels(rms=3.5355339059327378, peak=7.0, crest_factor=1.979898987322333)
    """
    is_known = ~np.isnan(rms)
    if not is_known.any():
        return Levels(np.nan, np.nan, np.nan)
    levels = _levels(root_mean_square(rms[is_known]), peak[is_known].max())
    return Levels(*map(float, levels))


def _levels(rms, peak):
    is_moving = rms > 0
    crest_factor = np.where(is_moving, peak / np.where(is_moving, rms, 1.0), np.nan)
    return Levels(rms, peak, crest_factor[()])
