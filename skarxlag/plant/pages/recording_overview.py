"""Recordings read once, block by block: extremes over time, and a stretch of the signal."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.validation import output_of_windows
from ..commands.channels import units_of
from ..readers.entries import OpenRecording
from .figures import extremes

#: Samples of the stretch whose spectra are drawn, at most.
STRETCH = 2**20
#: Extremes that are kept of the first block of a signal. A long signal has many blocks.
_FINE = 2_000

#: Function from windows to predictions of their output.
Predict = Callable[[NDArray[Any]], NDArray[Any]]


@dataclass(frozen=True)
class Stretch:
    """Part of a recording.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        The output.
    sampling_rate : float or None
        In Hz.
    rpm : float, ndarray of shape (n_samples,) or None
        Shaft speed, or that of each sample.
    unit : str or None, default=None
        Unit of the samples.
    """

    samples: NDArray[Any]
    sampling_rate: float | None
    rpm: Any
    unit: str | None = None

    @property
    def mean_rpm(self) -> float | None:
        """Mean shaft speed."""
        return None if self.rpm is None else float(np.mean(self.rpm))


@dataclass(frozen=True)
class Overview:
    """Extremes of the signal and of its unpredictable part, and a stretch of it.

    Parameters
    ----------
    signal, unpredicted : tuple of two ndarrays of shape (n_columns,)
        Smallest and largest values over time. The second is NaN if no model predicts.
    duration : int
        Samples of the recording.
    stretch : Stretch
        Part of the recording.
    first : int
        Samples before the stretch.
    row : ndarray of shape ([n_channels, ]n_samples)
        Window of the stretch.
    """

    signal: tuple[NDArray[Any], NDArray[Any]]
    unpredicted: tuple[NDArray[Any], NDArray[Any]]
    duration: int
    stretch: Stretch
    first: int
    row: NDArray[Any]


def overview(
    opened: OpenRecording,
    blocks: Iterable[NDArray[Any]],
    sampling_rate: float | None,
    predict: Predict | None,
    at: int = 0,
) -> Overview:
    """Read a recording once, block by block.

    Parameters
    ----------
    opened : OpenRecording
        The recording, with its speed if one is stated.
    blocks : iterable of ndarray of shape (n_windows[, n_channels], n_samples)
        Its windows, which follow one another.
    sampling_rate : float or None
        In Hz.
    predict : callable or None
        As in `unpredicted`.
    at : int, default=0
        Sample that the stretch and its row contain.

    Returns
    -------
    Overview
        Of the output.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError
        If the signal cannot be read.
    """
    signal: list[NDArray[Any]] = []
    errors: list[NDArray[Any]] = []
    duration = 0
    first = 0
    samples = row = np.empty(0)
    size = None
    for X in blocks:
        output = output_of_windows(X)
        size = size or max(output.size // _FINE, 1)
        n_parts = -(-output.size // size)
        signal.append(_reduced(output, n_parts))
        errors.append(_reduced(unpredicted(predict, X, output), n_parts))
        if duration <= at < duration + output.size:
            before = max((at - duration) // STRETCH * STRETCH, 0)
            first = duration + before
            samples = output.ravel()[before:][:STRETCH].astype(float)
            row = X[(at - duration) // X.shape[-1]]
        duration += output.size
    recording = opened.entry
    rpm = recording.rpm
    if recording.profile is not None and sampling_rate is not None:
        rpm = recording.speeds([first], len(samples), sampling_rate)[0]
    unit = next(iter(units_of([opened.channels])), None)
    return Overview(
        signal=extremes(*np.concatenate(signal, axis=1)),
        unpredicted=extremes(*np.concatenate(errors, axis=1)),
        duration=duration,
        stretch=Stretch(samples, sampling_rate, rpm, unit),
        first=first,
        row=row,
    )


def _reduced(values, n_parts):
    flat = values.ravel()
    return np.stack(extremes(flat, flat, n_parts))


def unpredicted(
    predict: Predict | None, X: NDArray[Any], output: NDArray[Any]
) -> NDArray[Any]:
    """Return what a model does not predict of the output; NaN if it predicts nothing.

    Parameters
    ----------
    predict : callable or None
        Returns predictions of shape (n_windows, n_predicted), which end with the
        windows.
    X : ndarray of shape (n_windows[, n_channels], n_samples)
        Windows.
    output : ndarray of shape (n_windows, n_samples)
        Their output.

    Returns
    -------
    ndarray of shape (n_windows, n_samples)
        Prediction errors in the unit of the sensor. They are NaN while the model
        settles.
    """
    errors = np.full(output.shape, np.nan)
    if predict is not None:
        # A window may be too short for the model, or hold no numbers.
        with suppress(ValueError):
            predicted = predict(X)
            first = output.shape[1] - predicted.shape[1]
            errors[:, first:] = output[:, first:] - predicted
    return errors
