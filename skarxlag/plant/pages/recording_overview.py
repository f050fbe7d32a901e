"""Recordings read once, block by block: extremes over time, and a stretch of the signal."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.validation import output_of_windows
from ...models.identification import ARXLaguerre
from ..commands.channels import units_of
from ..readers.entries import OpenRecording

#: Samples of a block, and of the stretch whose spectra are drawn, at most.
STRETCH = 2**20
#: Points of a curve, at most, and extremes that are kept of a block.
_MOST_POINTS = 600
#: Order of the model that shows the part of a signal that cannot be predicted, and
#: samples that it is identified on, at least and at most.
_ORDER = 8
_FEWEST_IDENTIFIED = 64
_IDENTIFIED = 2**18


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

    @property
    def shaft(self) -> float | None:
        """Mean frequency of the shaft in Hz."""
        return None if self.rpm is None else self.mean_rpm / 60


@dataclass(frozen=True)
class Overview:
    """Extremes of a signal and of its unpredictable part, and a stretch of it.

    Parameters
    ----------
    signal : tuple of two ndarrays of shape (n_points,)
        Smallest and largest values over time, less the mean of the signal.
    unpredicted : tuple of two ndarrays of shape (n_points,), or None
        The same of what a model of the recording does not predict. None if no model
        can be identified.
    mean : float
        Mean of the signal.
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
    unpredicted: tuple[NDArray[Any], NDArray[Any]] | None
    mean: float
    duration: int
    stretch: Stretch
    first: int
    row: NDArray[Any]


def overview(
    opened: OpenRecording,
    blocks: Iterable[NDArray[Any]],
    sampling_rate: float | None,
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
    model: ARXLaguerre | None = None
    duration = 0
    sums = 0.0
    first = 0
    samples = row = np.empty(0)
    for number, X in enumerate(blocks):
        output = output_of_windows(X)
        if number == 0:
            model = _model_of(output)
        signal.append(extremes(output.ravel()))
        if model is not None:
            errors.append(extremes(_unpredicted(model, output)))
        if duration <= at < duration + output.size:
            before = max((at - duration) // STRETCH * STRETCH, 0)
            first = duration + before
            samples = output.ravel()[before:][:STRETCH].astype(float)
            row = X[(at - duration) // X.shape[-1]]
        duration += output.size
        sums += output.mean() * output.size
    mean = sums / duration
    recording = opened.entry
    rpm = recording.rpm
    if recording.profile is not None and sampling_rate is not None:
        rpm = recording.speeds([first], len(samples), sampling_rate)[0]
    unit = next(iter(units_of([opened.channels])), None)
    low, high = _joined(signal)
    return Overview(
        signal=(low - mean, high - mean),
        unpredicted=_joined(errors) if errors else None,
        mean=float(mean),
        duration=duration,
        stretch=Stretch(samples, sampling_rate, rpm, unit),
        first=first,
        row=row,
    )


def extremes(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the smallest and the largest values of at most 600 equal parts of a series.

    Examples
    --------
    >>> low, high = extremes(np.arange(1200.0))
    >>> low[:3], high[:3]
    (array([0., 2., 4.]), array([1., 3., 5.]))
    """
    n_points = min(_MOST_POINTS, len(values))
    edges = np.linspace(0, len(values), n_points, endpoint=False).astype(int)
    return np.fmin.reduceat(values, edges), np.fmax.reduceat(values, edges)


def _joined(parts):
    """Return the extremes of parts that follow one another."""
    low, high = (np.concatenate(side) for side in zip(*parts, strict=True))
    return extremes(low)[0], extremes(high)[1]


def _model_of(output):
    """Return an autoregressive model of a signal; None if it is too short."""
    if output.size < _FEWEST_IDENTIFIED:
        return None
    identify = ARXLaguerre(order=_ORDER, bank=False, unit_rms=False)
    # Windows of several channels, or of one in this form, may have any length.
    return identify.fit(output.reshape(1, 1, -1)[..., :_IDENTIFIED])


def _unpredicted(model, output):
    """Return the prediction errors of a block; they are missing while the model settles."""
    signal = output.ravel()
    predicted = model.predict_output(signal[np.newaxis, np.newaxis])[0, 0]
    return signal[-len(predicted) :] - predicted
