"""The work on one recording: read it, cut it, diagnose it. A worker does this by itself."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd

from .._answers import answers
from ..recordings.listing import ListedRecording
from ..recordings.rates import rates_agree, resampled_blocks
from ..recordings.windows import block_length, cut_blocks
from ..verdicts import recording_verdict, window_verdicts
from .errors import CommandError
from .models import SavedModel, cached_model
from .order_view import OrderView
from .remarks import verdict_remarks
from .runner import cancelled
from .spectrum_view import SpectrumView

#: Windows, or stretches, of a recording that carry a signal and may be drawn.
_MOST_DRAWN = 256


@dataclass(frozen=True)
class Diagnosis:
    """What came of one recording.

    Parameters
    ----------
    verdict : dict
        As `recording_verdict` returns it; empty if the recording failed.
    windows : DataFrame or None
        One row for each window; None if the recording failed.
    sampling_rate : float or None
        In Hz, where it is known.
    remarks : tuple of str
        What to know before the verdict is used.
    spectrum : dict or None
        As `SpectrumView.drawn` gives it.
    orders : dict or None
        As `OrderView.drawn` gives it.
    error : str or None
        Why there is no verdict.
    """

    verdict: dict[str, Any]
    windows: pd.DataFrame | None
    sampling_rate: float | None = None
    remarks: tuple[Any, ...] = ()
    spectrum: dict[str, Any] | None = None
    orders: dict[str, Any] | None = None
    error: str | None = None

    @classmethod
    def failed(cls, reason: object) -> Self:
        """A recording without a verdict, and why."""
        return cls({}, None, error=" ".join(str(reason).split()))


@dataclass(frozen=True)
class Task:
    """A recording and the model to diagnose it with, small enough to be sent to a worker.

    Parameters
    ----------
    recording : ListedRecording or similar
        With ``name``, ``path``, ``rpm`` and ``blocks``.
    model : tuple
        Arguments of `cached_model`.
    resample : bool
        Whether to bring the recording to the model's sampling rate.
    draw : bool
        Whether a report will be drawn.
    """

    recording: object
    model: tuple[Any, ...]
    resample: bool = False
    draw: bool = False

    def __call__(self) -> Any:
        """Diagnose the recording; what is wrong with it is told, not raised."""
        try:
            model = cached_model(*self.model)
            return diagnose_recording(self.recording, model, self.resample, self.draw)
        except (OSError, ValueError, ImportError, MemoryError, CommandError) as error:
            return Diagnosis.failed(error)


def diagnose_recording(
    recording: ListedRecording, model: SavedModel, resample: bool = False, draw: bool = False
) -> Diagnosis:
    """Diagnose one recording, read part by part.

    Parameters
    ----------
    recording : ListedRecording or similar
        With ``name``, ``rpm`` and ``blocks``.
    model : SavedModel
        The diagnoser.
    resample : bool, default=False
        Whether to bring the recording to the model's sampling rate.
    draw : bool, default=False
        Whether to keep what the report draws.

    Returns
    -------
    Diagnosis
        With a verdict.
    """
    length, sampling_rate, old_rates = model.window_length, None, []
    rpm = _speed(recording, model)

    def signals():
        nonlocal sampling_rate
        blocks = recording.blocks(block_length(length))
        if resample:
            blocks = resampled_blocks(blocks, model.sampling_rate, note=old_rates.append)
        for signal, sampling_rate in blocks:
            if cancelled.is_set():
                raise KeyboardInterrupt
            _check_fits(recording.name, signal, sampling_rate, model)
            yield signal

    parts, views = [], [SpectrumView(model), OrderView(model, rpm)] if draw else []
    n_seen = n_drawn = 0
    for X in cut_blocks(signals(), recording.name, length):
        parts.append(window_verdicts(model.diagnoser, X, model.conditions, rpm, model.known))
        good = np.flatnonzero(parts[-1]["quality"] == "good")[: _MOST_DRAWN - n_drawn]
        if len(good) > 0:
            for view in views:
                view.add(X[good], n_seen + good)
        n_seen, n_drawn = n_seen + len(X), n_drawn + len(good)
    windows = pd.concat(parts, ignore_index=True)
    windows.insert(0, "start", np.arange(len(windows)) * length)
    rate = () if model.known is None else (answers(model.known).stated_rate,)
    verdict = recording_verdict(windows, model.conditions, *rate)
    remarks = verdict_remarks(windows, verdict, model.conditions)
    remarks += [f"Resampled from {r:g} to {model.sampling_rate:g} Hz." for r in old_rates]
    return Diagnosis(
        verdict, windows, sampling_rate, tuple(remarks), *_drawn(views, windows, model.conditions)
    )


def _drawn(views, windows, conditions):
    """Spectrum and order spectrum of the same row of the recording, or nothing."""
    if not views:
        return None, None
    spectra, orders = views
    spectrum = spectra.drawn(windows, conditions)
    place = None if spectrum is None else spectrum["place"]
    return spectrum, orders.drawn(windows, conditions, place)


def _speed(recording, model):
    """Speed of a recording, which a detector that was fitted with speeds must know."""
    can = answers(model.diagnoser)
    if can.needs_rpm and recording.rpm is None:
        listed = ", ".join(f"{speed:g}" for speed in can.speeds)
        raise CommandError(
            f"{recording.name}: its speed is not stated, but {model.path} was fitted at {listed} "
            "rpm; give --rpm or a column rpm"
        )
    return recording.rpm


def _check_fits(name, signal, sampling_rate, model):
    n_channels = 1 if signal.ndim == 1 else len(signal)
    if n_channels != model.n_channels:
        raise CommandError(
            f"{name}: {n_channels} channels, but {model.path} was fitted on {model.n_channels}"
        )
    if not rates_agree(sampling_rate, model.sampling_rate):
        raise CommandError(
            f"{name}: sampled at {sampling_rate:g} Hz, but {model.path} was fitted at "
            f"{model.sampling_rate:g} Hz; --resample brings it to that"
        )
