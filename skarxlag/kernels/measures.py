"""Measures of a signal: log spectra on common bands, by name.

A measure is a function from signals, a segment length and a model order to log spectra
by name, each of shape (n_signals, n_bands). A new one is such a function and its names
in `MEASURES`.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .arrays import Array
from .spectra import autoregressive_log_spectrum, short_time_log_spectra, unit_peak

#: Frequencies at which a signal's own model is evaluated, at least. Their logarithms
#: are averaged over each band, so that a sharp line counts wherever in its band it
#: lies.
_LEAST_CELLS = 252

#: Segments of the short-time spectrum start this share of a segment apart.
_OVERLAP = 8


def own_model(signals: Array, segment: int, order: int) -> dict[str, Any]:
    """Compute the colour: the log spectrum of an autoregressive model identified on each signal.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals as `unit_peak` returns them.
    segment : int
        Length of a segment of the short-time spectrum, which determines the number of
        bands.
    order : int
        Order of the model, at least 1.

    Returns
    -------
    dict of str to ndarray of shape (n_signals, n_bands)
        "spectral_shape".

    Examples
    --------
    >>> noise = np.random.default_rng(0).normal(size=(2, 1200))
    >>> own_model(noise, 128, 16)["spectral_shape"].shape
    (2, 63)
    """
    bands = max(segment // 2 - 1, 1)
    cells = -(-_LEAST_CELLS // bands)
    fine = autoregressive_log_spectrum(signals, order, bands * cells)
    sums = np.einsum("wbc->wb", fine.reshape(-1, bands, cells))
    return {"spectral_shape": sums / cells}


def short_time(signals: Array, segment: int, order: Any) -> dict[str, Any]:
    """Compute the mean and the median power of each band over time, and their ratio.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals as `unit_peak` returns them.
    segment : int
        Samples in the window of the short-time Fourier transform, at most n_samples.
    order : ignored
        Not used. It exists because all measures have the same parameters.

    Returns
    -------
    dict of str to ndarray of shape (n_signals, n_bands)
        "power" is the log mean, "floor" the log median, and "steadiness" is floor minus
        power.

    Examples
    --------
    >>> noise = np.random.default_rng(0).normal(size=(2, 1200))
    >>> sorted(short_time(noise, 128, 16))
    ['floor', 'power', 'steadiness']
    """
    hop = max(segment // _OVERLAP, 1)
    mean, median = short_time_log_spectra(signals, segment, hop)
    return {"power": mean, "floor": median, "steadiness": median - mean}


#: The function that takes each measure.
MEASURES: dict[str, Any] = {
    "spectral_shape": own_model,
    "power": short_time,
    "floor": short_time,
    "steadiness": short_time,
}


def measure(signals: Array, names: Sequence[str], segment: int, order: int) -> Array:
    """Compute the log spectra of each signal by the named measures.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals, in any unit.
    names : sequence of str
        Keys of `MEASURES`.
    segment, order : int
        Parameters of `own_model` and `short_time`.

    Returns
    -------
    ndarray of shape (n_signals, len(names), n_bands)
        Natural logarithms of power, each up to a constant that depends on the signal.

    Examples
    --------
    >>> noise = np.random.default_rng(0).normal(size=(2, 1200))
    >>> measure(noise, ["floor", "spectral_shape"], 128, 16).shape
    (2, 2, 63)
    """
    scaled = unit_peak(signals)
    log_spectra = {}
    for function in dict.fromkeys(MEASURES[name] for name in names):
        log_spectra |= function(scaled, segment, order)
    return np.stack([log_spectra[name] for name in names], axis=1)
