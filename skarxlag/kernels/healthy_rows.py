"""Features of rows, where each row is a stretch that is cut into windows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import spectra
from .arrays import Array
from .scaling import centred, root_mean_square
from .short_time import LENGTH

#: Order of a window's own autoregressive model.
SPECTRUM_ORDER = 128
#: Cosine coefficients of the spectral shape that are kept.
N_COEFFICIENTS = 48
#: Impulsiveness of Gaussian noise is ln 2, less what the mean of few segments hides.
GAUSSIAN_IMPULSIVENESS = 0.36
#: Added to what impulsiveness lies above that of noise, so that its logarithm is finite.
LEAST_IMPULSIVENESS = 0.02


class Rows(NamedTuple):
    """Features of rows, where each row is a stretch of n_windows windows.

    Attributes
    ----------
    spectral_shape : ndarray of shape (n_rows, n_frequencies)
        Mean log spectrum of the windows.
    steadiness : ndarray of shape (n_rows, n_bands)
        Mean logarithm of the ratio of median power to mean power.
    cepstra : ndarray of shape (n_rows, n_windows, n_features)
        Cepstra of the single windows.
    values : ndarray of shape (n_rows, n_values)
        Log impulsiveness, and log level if the level is used.
    """

    spectral_shape: np.ndarray
    steadiness: np.ndarray
    cepstra: np.ndarray
    values: np.ndarray

    def take(self, is_taken: NDArray[np.bool_]) -> "Rows":
        """Return some of the rows."""
        return Rows(*(part[is_taken] for part in self))


def log_spectra_cepstra(spectral_shape: Array, steadiness: Array) -> Array:
    """Compute the cosine coefficients of spectral shape and steadiness from the first on.

    Parameters
    ----------
    spectral_shape : ndarray of shape (n_signals, n_frequencies)
        Log spectra; 48 coefficients are kept.
    steadiness : ndarray of shape (n_signals, n_bands)
        Logarithms of median over mean power; all coefficients are kept.

    Returns
    -------
    ndarray of shape (n_signals, n_features)
        Coefficients of spectral shape and of steadiness, in nepers of power.
    """
    of_shape = spectra.cepstrum(spectral_shape)[:, :N_COEFFICIENTS]
    of_steadiness = spectra.cepstrum(steadiness)
    return np.concatenate([of_shape, of_steadiness], axis=1)


def number_of_cepstra(window_length: int) -> int:
    """Return the number of features of `log_spectra_cepstra` for windows of a given length.

    Examples
    --------
    >>> number_of_cepstra(4800)
    110
    """
    n_bands = max(min(LENGTH, window_length) // 2 - 1, 1)
    return N_COEFFICIENTS + n_bands - 1


def log_impulsiveness(steadiness: Array) -> Array:
    """Compute the log impulsiveness: how far bands deviate from steady Gaussian noise.

    Impulsiveness is the mean logarithm of mean over median power in short time, above
    that of Gaussian noise.

    Parameters
    ----------
    steadiness : ndarray of shape (n_rows, n_bands)
        Mean logarithm of median over mean power.

    Returns
    -------
    ndarray of shape (n_rows,)
        Finite.

    Examples
    --------
    >>> log_impulsiveness(np.log([[0.7, 0.7], [0.4, 0.4]])).round(2)
    array([-3.91, -0.55])
    """
    above = np.maximum(-steadiness.mean(axis=1) - GAUSSIAN_IMPULSIVENESS, 0.0)
    return np.log(above + LEAST_IMPULSIVENESS)


def measure_rows(signals: Array, n_windows: int, *, with_level: bool) -> Rows:
    """Compute the features of rows.

    Parameters
    ----------
    signals : ndarray of shape (n_rows, n_samples)
        Rows in any unit, with any mean.
    n_windows : int
        Number of windows that each row is cut into, at most n_samples.
    with_level : bool
        Whether `values` contains the level.

    Returns
    -------
    Rows
        One entry for each row.
    """
    length = signals.shape[1] // n_windows
    unit, peak = centred(signals[:, : n_windows * length])
    windows = spectra.unit_peak(unit.reshape(-1, length))
    spectral_shape = spectra.autoregressive_log_spectrum(
        windows, SPECTRUM_ORDER, spectra.LOG_SPECTRUM_CELLS
    )
    segment = min(LENGTH, length)
    steadiness = spectra.steadiness(windows, segment, max(segment // 8, 1))
    cepstra = log_spectra_cepstra(spectral_shape, steadiness)

    def by_row(features):
        return features.reshape(len(unit), n_windows, features.shape[1])

    mean_steadiness = by_row(steadiness).mean(axis=1)
    values = [log_impulsiveness(mean_steadiness)]
    if with_level:
        rms = np.maximum(root_mean_square(unit), np.finfo(np.float64).tiny)
        values.append(np.log(rms) + np.log(peak[:, 0]))
    return Rows(
        spectral_shape=by_row(spectral_shape).mean(axis=1),
        steadiness=mean_steadiness,
        cepstra=by_row(cepstra),
        values=np.column_stack(values),
    )
