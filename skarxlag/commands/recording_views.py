"""Figures of one recording: signal, spectrum, envelope spectrum, windows over time."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch

from ..decisions.fault_orders import FaultOrderClassifier
from ..kernels.fault_orders import (
    HIGHEST_ORDER,
    NEPER_IN_DB,
    ORDER_STEP,
    fault_comb,
    order_contrast,
)
from ..measures.envelope_spectra import LEAST_REVOLUTIONS
from ..recordings.entries import OpenRecording
from .channels import units_of
from .figures import (
    COLUMNS,
    Axis,
    Figure,
    Mark,
    Rule,
    Strips,
    area,
    curve,
    extremes,
    strip,
    verdict_style,
)
from .messages import counted, listed

#: Samples of the stretch whose spectra are drawn, at most.
STRETCH = 2**20
#: Extremes that are kept of the first block of a signal. A long signal has many blocks.
_FINE = 2_000
#: Samples in a segment of Welch's method.
_SEGMENT = 4096
#: Highest order that is shown without a bearing, and multiples of BPFI with one.
_HIGHEST, _MULTIPLES_OF_INNER = 20.0, 3.3
#: Names of the faults' orders: of the comb, of the field, and multiples that are marked.
_LINES = (
    ("cage", "FTF", 4),
    ("spin", "BSF", 4),
    ("outer", "BPFO", 3),
    ("inner", "BPFI", 3),
)
_COMB_ORDERS = itemgetter("cage", "spin", "inner", "outer")
#: Power relative to the largest of a spectrum that is drawn as its lowest.
_FLOOR = 1e-12

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
    unit : str or None
        Unit of the samples.
    """

    samples: NDArray[Any]
    sampling_rate: float | None
    rpm: Any
    unit: str | None

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
    first : int
        Samples before the stretch.
    samples : ndarray of shape (n_samples,)
        The stretch.
    row : ndarray of shape ([n_channels, ]n_samples)
        Window of the stretch.
    """

    signal: tuple[NDArray[Any], NDArray[Any]]
    unpredicted: tuple[NDArray[Any], NDArray[Any]]
    duration: int
    first: int
    samples: NDArray[Any]
    row: NDArray[Any]


def overview(
    blocks: Iterable[NDArray[Any]], predict: Predict | None, at: int = 0
) -> Overview:
    """Read a recording once, block by block.

    Parameters
    ----------
    blocks : iterable of ndarray of shape (n_windows[, n_channels], n_samples)
        Windows that follow one another.
    predict : callable or None
        As in `unpredicted`.
    at : int, default=0
        Sample that the stretch and its row contain.

    Returns
    -------
    Overview
        Of the output.
    """
    parts: dict[str, list[NDArray[Any]]] = {"signal": [], "unpredicted": []}
    duration = 0
    first = 0
    size = None
    stretch = row = np.empty(0)
    for X in blocks:
        output = X if X.ndim == 2 else X[:, 0]
        length = output.size
        size = size or max(length // _FINE, 1)
        series = {"signal": output, "unpredicted": unpredicted(predict, X, output)}
        for name, values in series.items():
            flat = values.ravel()
            parts[name].append(np.stack(extremes(flat, flat, -(-length // size))))
        if duration <= at < duration + length:
            first = duration + max((at - duration) // STRETCH * STRETCH, 0)
            stretch = output.ravel()[first - duration :][:STRETCH].astype(float)
            row = X[(at - duration) // X.shape[-1]]
        duration += length
    reduced = {
        name: extremes(*np.concatenate(values, axis=1))
        for name, values in parts.items()
    }
    return Overview(**reduced, duration=duration, first=first, samples=stretch, row=row)


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


def signal_figure(
    view: Overview, sampling_rate: float | None, unit: str | None
) -> Figure:
    """Draw the signal over time, and what the model cannot predict of it."""
    seconds = view.duration / (sampling_rate or 1.0)
    x = Axis("Time (samples)" if sampling_rate is None else "Time (s)", 0.0, seconds)
    y = Axis.around(f"Signal ({unit or 'unit not stated'})", *view.signal)
    at = (np.arange(len(view.signal[0])) + 0.5) / len(view.signal[0])
    marks = [Mark(area(at, *map(y.share, view.signal)), "signal", "signal", True)]
    if np.isfinite(view.unpredicted[0]).any():
        around = area(at, *map(y.share, view.unpredicted))
        marks.append(Mark(around, "rest", "not predicted by the model", True))
    return Figure("Signal: smallest and largest values", x, y, marks)


def stretch_of(
    view: Overview, opened: OpenRecording, sampling_rate: float | None
) -> Stretch:
    """Return the stretch of an overview with its speed and its unit.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError
        If the speed cannot be read.
    """
    recording = opened.entry.with_speed()
    rpm = recording.rpm
    if recording.profile is not None and sampling_rate is not None:
        n_samples = len(view.samples)
        rpm = recording.speeds([view.first], n_samples, sampling_rate)[0]
    unit = next(iter(units_of([opened.channels])), None)
    return Stretch(view.samples, sampling_rate, rpm, unit)


def power_spectrum(stretch: Stretch) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return frequencies and the power density in dB, by Welch's method."""
    frequencies, power = welch(
        stretch.samples,
        stretch.sampling_rate or 1.0,
        nperseg=min(_SEGMENT, len(stretch.samples)),
    )
    least = max(_FLOOR * power.max(), np.finfo(float).tiny)
    return frequencies, 10 * np.log10(np.maximum(power, least))


def spectrum_figure(
    stretch: Stretch, healthy: Sequence[Stretch], reason: str = "healthy"
) -> Figure | str:
    """Draw the spectrum of a stretch next to the range of healthy recordings.

    Parameters
    ----------
    stretch : Stretch
        At least one sample.
    healthy : sequence of Stretch
        Parts of healthy recordings, of the same sampling rate.
    reason : str, default="healthy"
        Why they count as healthy, in the legend.

    Returns
    -------
    Figure or str
        The figure, or why there is none.
    """
    if np.ptp(stretch.samples) == 0:
        return "Spectrum: the signal is constant."
    frequencies, level = power_spectrum(stretch)
    x_label = (
        "Frequency (1/sample)" if stretch.sampling_rate is None else "Frequency (Hz)"
    )
    x = Axis(x_label, 0.0, float(frequencies[-1]) or 1.0)
    references = [np.interp(frequencies, *power_spectrum(other)) for other in healthy]
    y = Axis.around("Power density (dB)", level, *references)
    marks = []
    if references:
        low = np.min(references, axis=0)
        high = np.max(references, axis=0)
        at = x.share(_columns(frequencies))
        lowest, highest = extremes(low, high)
        label = f"{reason}: {counted(len(healthy), 'recording')}"
        around = area(at, y.share(lowest), y.share(highest))
        marks.append(Mark(around, "reference", label, True))
    marks.append(_peaks(frequencies, level, x, y, "this recording"))
    note = ""
    if references:
        speeds = {other.mean_rpm for other in healthy if other.rpm is not None}
        note = f"Healthy recordings at {listed(sorted(speeds))} rpm." if speeds else ""
    return Figure("Spectrum", x, y, marks, note=note)


def _columns(values):
    return extremes(values, values)[0]


def _peaks(across, heights, x, y, label):
    """Return the curve of the largest values of the columns, so that no line is lost."""
    highest = extremes(heights, heights)[1]
    return Mark(curve(x.share(_columns(across)), y.share(highest)), "signal", label)


def orders_figure(stretch: Stretch, orders: dict[str, float] | None) -> Figure | str:
    """Draw the contrast of envelope spectra over shaft orders, with the bearing's lines.

    Parameters
    ----------
    stretch : Stretch
        The signal.
    orders : dict of str to float or None
        As `skarxlag.bearing_orders` returns them; None: no lines.

    Returns
    -------
    Figure or str
        The figure, or why there is none.
    """
    title = "Envelope spectrum over shaft orders"
    if np.ptp(stretch.samples) == 0:
        return f"{title}: the signal is constant."
    if stretch.rpm is None:
        return f"{title}: the speed of the shaft is not known; state it with --rpm."
    if stretch.sampling_rate is None:
        return (
            f"{title}: the sampling rate is not known; state it with --sampling-rate."
        )
    turn = 60 * stretch.sampling_rate / np.asarray(stretch.rpm, dtype=float)
    n_revolutions = len(stretch.samples) / float(np.mean(turn))
    if not (n_revolutions >= LEAST_REVOLUTIONS and np.min(turn) >= 2):
        return f"{title}: {n_revolutions:.2g} revolutions are too few."
    contrast = order_contrast(
        stretch.samples, turn if turn.ndim else float(turn), stretch.sampling_rate
    )
    highest = _HIGHEST
    if orders is not None:
        highest = min(max(_MULTIPLES_OF_INNER * orders["inner"], 10.0), HIGHEST_ORDER)
    shown = NEPER_IN_DB * contrast[: int(highest / ORDER_STEP) + 1]
    x = Axis("Shaft order", 0.0, highest)
    y = Axis("Contrast (dB)", 0.0, max(1.1 * float(shown.max()), 1.0))
    at = ORDER_STEP * np.arange(len(shown))
    rules = [] if orders is None else _fault_lines(contrast, orders, x)
    note = f"Mean speed {stretch.mean_rpm:.5g} rpm."
    if rules:
        note += " Each line stands where it fits best, within the error of the speed and slip."
    return Figure(title, x, y, [_peaks(at, shown, x, y, "contrast")], rules, note)


def _fault_lines(contrast, orders, x):
    defaults = FaultOrderClassifier()
    nominal = np.array(_COMB_ORDERS(orders))
    comb = fault_comb(contrast, nominal, defaults.speed_tolerance, defaults.slip)
    of_comb = {"cage": 0, "spin": 0, "inner": 1, "outer": 2}
    rules = []
    for name, label, multiples in _LINES:
        factor = comb.factors[of_comb[name]]
        lines = orders[name] * factor * np.arange(1, multiples + 1)
        positions = 100 * x.share(lines[lines <= x.high])
        legend = f"{label} ({name}) {orders[name]:.3f}, {100 * (factor - 1):+.1f} %"
        if name != "cage":
            score = NEPER_IN_DB * comb.scores[of_comb[name]]
            legend += f", comb {score:.0f} dB"
        rules.append(Rule(positions.round(2).tolist(), label.lower(), label, legend))
    return rules


def windows_figure(
    windows: pd.DataFrame, window_length: int, sampling_rate: float | None, healthy: Any
) -> Strips | None:
    """Draw verdicts and alarms of windows over time, or return None for a single window.

    Parameters
    ----------
    windows : DataFrame
        As `window_verdicts` returns them, with the column ``start``.
    window_length : int
        Samples in a window.
    sampling_rate : float or None
        In Hz.
    healthy : label or None
        The healthy condition.
    """
    n = len(windows)
    if n < 2:
        return None
    n_columns = min(n, COLUMNS // 2)
    columns = np.arange(n) * n_columns // n
    verdicts = windows["verdict"].astype(str).str.partition(":")[0]
    counts = verdicts.value_counts()
    styles = {name: verdict_style(name, str(healthy)) for name in counts.index}
    # The styles are in the order of the strips.
    names = sorted(counts.index, key=lambda name: (styles[name], -counts[name]))
    strips = [
        strip(
            verdicts == name,
            columns,
            n_columns,
            styles[name],
            f"{name}: {counts[name]} of {n} windows",
        )
        for name in names
    ]
    if windows["alarm"].notna().any():
        alarm = windows["alarm"] == 1
        label = f"exceeds the healthy limits: {int(alarm.sum())} of {n} windows"
        strips.append(strip(alarm, columns, n_columns, "fault", label))
    end = float(windows["start"].iloc[-1] + window_length) / (sampling_rate or 1.0)
    start = float(windows["start"].iloc[0]) / (sampling_rate or 1.0)
    unit = "samples" if sampling_rate is None else "s"
    return Strips("Windows over time", Axis(f"Time ({unit})", start, end), strips)
