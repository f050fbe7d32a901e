"""Figures of one recording: signal, spectrum, envelope spectrum, windows over time."""

from collections.abc import Sequence
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch

from ...decisions.fault_orders import FaultOrderClassifier
from ...kernels.fault_orders import (
    HIGHEST_ORDER,
    NEPER_IN_DB,
    ORDER_STEP,
    fault_comb,
    order_contrast,
)
from ...measures.envelope_spectra import LEAST_REVOLUTIONS
from ..commands.messages import counted, listed
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
    verdict_strips,
)
from .recording_overview import Overview, Stretch

#: Samples in a segment of Welch's method.
_SEGMENT = 4096
#: Highest order that is shown without a bearing.
_HIGHEST = 20.0
#: Multiples of BPFI that are shown with a bearing.
_MULTIPLES_OF_INNER = 3.3
#: Lines of the faults: names of their orders here and in the field, multiples that are
#: marked, and number of the comb that they belong to.
_LINES = (
    ("cage", "FTF", 4, 0),
    ("spin", "BSF", 4, 0),
    ("outer", "BPFO", 3, 2),
    ("inner", "BPFI", 3, 1),
)
_COMB_ORDERS = itemgetter("cage", "spin", "inner", "outer")
#: Power relative to the largest of a spectrum that is drawn as its lowest.
_FLOOR = 1e-12


def signal_figure(view: Overview) -> Figure:
    """Draw the signal over time, and what the model cannot predict of it."""
    rate = view.stretch.sampling_rate
    unit = view.stretch.unit or "unit not stated"
    x = Axis(_time_label(rate), 0.0, view.duration / (rate or 1.0))
    y = Axis.around(f"Signal ({unit})", *view.signal)
    n_columns = len(view.signal[0])
    across = (np.arange(n_columns) + 0.5) / n_columns
    marks = [Mark(area(across, *map(y.share, view.signal)), "signal", "signal", True)]
    if np.isfinite(view.unpredicted[0]).any():
        around = area(across, *map(y.share, view.unpredicted))
        marks.append(Mark(around, "rest", "not predicted by the model", True))
    return Figure("Signal: smallest and largest values", x, y, marks)


def _time_label(sampling_rate):
    return "Time (samples)" if sampling_rate is None else "Time (s)"


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
    unit = "1/sample" if stretch.sampling_rate is None else "Hz"
    x = Axis(f"Frequency ({unit})", 0.0, float(frequencies[-1]) or 1.0)
    references = [np.interp(frequencies, *power_spectrum(other)) for other in healthy]
    y = Axis.around(f"Power density ({_decibel(stretch)})", level, *references)
    marks = [_peaks(frequencies, level, x, y, "this recording")]
    note = ""
    if references:
        lowest, highest = extremes(
            np.min(references, axis=0), np.max(references, axis=0)
        )
        across = x.share(_column_starts(frequencies))
        label = f"{reason}: {counted(len(healthy), 'recording')}"
        around = area(across, y.share(lowest), y.share(highest))
        marks.insert(0, Mark(around, "reference", label, True))
        speeds = {other.mean_rpm for other in healthy if other.rpm is not None}
        note = f"Healthy recordings at {listed(sorted(speeds))} rpm." if speeds else ""
    return Figure("Spectrum", x, y, marks, note=note)


def _decibel(stretch):
    """Return the unit of a power density, as far as that of the samples is known."""
    if stretch.unit is None or stretch.sampling_rate is None:
        return "dB"
    return f"dB re 1 ({stretch.unit})²/Hz"


def _column_starts(ascending):
    return extremes(ascending, ascending)[0]


def _peaks(across, heights, x, y, label):
    """Return the curve of the largest values of the columns, so that no line is lost."""
    highest = extremes(heights, heights)[1]
    path = curve(x.share(_column_starts(across)), y.share(highest))
    return Mark(path, "signal", label)


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
    y = Axis(
        "Contrast (dB over the surroundings)", 0.0, max(1.1 * float(shown.max()), 1.0)
    )
    shown_orders = ORDER_STEP * np.arange(len(shown))
    rules = [] if orders is None else _fault_lines(contrast, orders, x)
    note = f"Mean speed {stretch.mean_rpm:.5g} rpm."
    if rules:
        note += (
            " Each line stands where it fits best, within the error of the speed and "
            "slip. A comb is the mean contrast of the lines of a fault, less a cost of "
            "slip."
        )
    return Figure(
        title, x, y, [_peaks(shown_orders, shown, x, y, "contrast")], rules, note
    )


def _fault_lines(contrast, orders, x):
    defaults = FaultOrderClassifier()
    nominal = np.array(_COMB_ORDERS(orders))
    comb = fault_comb(contrast, nominal, defaults.speed_tolerance, defaults.slip)
    rules = []
    for name, label, multiples, number in _LINES:
        factor = comb.factors[number]
        lines = orders[name] * factor * np.arange(1, multiples + 1)
        positions = 100 * x.share(lines[lines <= x.high])
        legend = f"{label} ({name}) {orders[name]:.3f}, {100 * (factor - 1):+.1f} %"
        if name != "cage":
            legend += f", comb {NEPER_IN_DB * comb.scores[number]:.0f} dB"
        rules.append(Rule(positions.round(2).tolist(), label.lower(), label, legend))
    return rules


def windows_figure(
    windows: pd.DataFrame, sampling_rate: float | None, healthy: Any
) -> Strips:
    """Draw verdicts and alarms of windows over time.

    Parameters
    ----------
    windows : DataFrame
        As `window_verdicts` returns them, with the column ``start``: two or more.
    sampling_rate : float or None
        In Hz.
    healthy : label or None
        The healthy condition.
    """
    n = len(windows)
    n_parts = min(n, COLUMNS // 2)
    strips = verdict_strips(
        windows,
        str(healthy),
        np.arange(n) * n_parts // n,
        n_parts,
        "windows",
        "exceeds the healthy limits",
    )
    starts = windows["start"].to_numpy(dtype=float)
    end = starts[-1] + (starts[-1] - starts[-2])
    rate = sampling_rate or 1.0
    x = Axis(_time_label(sampling_rate), starts[0] / rate, end / rate)
    return Strips("Windows over time", x, strips)
