"""Pictures of a recording, as SVG that matplotlib draws."""

import io
from base64 import b64encode
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from ...core.validation import output_of_windows
from ...diagnosers import make_fault_order_classifier
from ...measures.envelope_spectra import envelope_spectrum
from ...plotting import EnvelopeSpectrumDisplay, OrderSpectrumDisplay
from ...plotting._style import ANY_PAGE, PALETTE
from ..commands.messages import printable, sentence
from ..readers.entries import OpenRecording

#: Points of a curve over time, at most, and samples of a recording that has spectra.
_MOST_POINTS = 600
_FEWEST_SAMPLES = 64
#: Samples in a segment of Welch's method.
_SEGMENT = 4096
#: Highest order of the envelope spectrum without a bearing, and multiples of the shaft
#: that are marked.
_HIGHEST_ORDER = 20
_MARKED = (1, 2)
#: Power relative to the largest of a spectrum that is drawn as its lowest.
_FLOOR = 1e-12
#: Settings of matplotlib: text stays text, and equal pictures are equal files.
_SETTINGS = ANY_PAGE | {"svg.fonttype": "none", "svg.hashsalt": "skarxlag"}
_SIGNAL, _SHAFT = PALETTE[1], PALETTE[3]


class Picture(NamedTuple):
    """Picture of a page.

    Parameters
    ----------
    title : str
        Caption.
    text : str
        Sentences below it, also for those who cannot see it.
    source : str
        Address that holds the SVG itself.
    """

    title: str
    text: str
    source: str


@dataclass(frozen=True)
class RecordingView:
    """Stretch of a recording as it is drawn.

    Parameters
    ----------
    samples : ndarray of shape ([n_channels, ]n_samples)
        The stretch.
    start, duration : int
        First sample of the stretch, and samples of the whole recording.
    sampling_rate : float or None
        In Hz.
    rpm : float, ndarray of shape (n_samples,) or None
        Its speed, or that of each sample.
    unit : str or None
        Unit of the samples.
    """

    samples: NDArray[Any]
    start: int
    duration: int
    sampling_rate: float | None
    rpm: Any
    unit: str | None

    @property
    def output(self) -> NDArray[Any]:
        """Samples of the first channel."""
        return output_of_windows(self.samples[np.newaxis])[0].astype(float)

    @property
    def shaft(self) -> float | None:
        """Mean frequency of the shaft in Hz."""
        return None if self.rpm is None else float(np.mean(self.rpm)) / 60

    def row(self, start: int, n_samples: int) -> tuple[NDArray[Any], Any]:
        """Return a row of the stretch, and its speed."""
        part = slice(start - self.start, start - self.start + n_samples)
        rpm = self.rpm if np.ndim(self.rpm) == 0 else self.rpm[part]
        return self.samples[..., part], rpm


def view_recording(
    opened: OpenRecording,
    sampling_rate: float | None,
    *,
    at: int = 0,
    unit: str | None = None,
) -> RecordingView:
    """Read a recording, and keep the block that holds a sample.

    Parameters
    ----------
    opened : OpenRecording
        The recording, with its speed if one is stated.
    sampling_rate : float or None
        In Hz.
    at : int, default=0
        Position of the sample.
    unit : str or None, default=None
        Unit of the signal if the file states none.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError
        If the signal cannot be read.
    """
    duration = 0
    for block in opened.blocks:
        if duration <= at:
            start, samples = duration, block
        duration += block.shape[-1]
    rpm = opened.entry.speeds([start], samples.shape[-1], sampling_rate)
    # The speeds of a profile are an array with a row.
    rpm = rpm if np.ndim(rpm) == 0 else rpm[0]
    unit = opened.channels[0][1] or unit
    return RecordingView(samples, start, duration, sampling_rate, rpm, unit)


def recording_pictures(
    view: RecordingView, bearing: str | None
) -> Iterator[Picture | str]:
    """Yield pictures of a recording, and sentences on those that cannot be drawn.

    Parameters
    ----------
    view : RecordingView
        The recording.
    bearing : str or None
        Bearing whose lines are marked.
    """
    yield _picture("Signal", _draw_signal, view)
    if np.ptp(view.output) == 0:
        yield "Spectra: the signal is constant."
        return
    if len(view.output) < _FEWEST_SAMPLES:
        yield f"Spectra: {len(view.output)} samples are too few."
        return
    title = "Envelope spectrum"
    if view.sampling_rate is None:
        yield f"{title}: the sampling rate is not known; state it with --sampling-rate."
    elif bearing is None or view.rpm is None:
        yield _picture(title, _draw_envelope, view)
    else:
        try:
            name = f"{title} and lines of bearing {bearing}"
            yield _picture(name, _draw_combs, view, bearing)
        except ValueError as error:
            yield f"{title}: {error}"
    yield _picture("Spectrum", _draw_spectrum, view)


def order_pictures(
    diagnoser: Any, row: NDArray[Any], rpm: Any, orders: dict[str, float] | None
) -> Iterator[Picture]:
    """Yield the order spectrum of a row next to those of the nearest conditions.

    Nothing is drawn of a diagnoser that compares no order spectra.
    """
    from matplotlib import pyplot, rc_context

    with rc_context(_SETTINGS):
        try:
            shown = OrderSpectrumDisplay.from_estimator(
                diagnoser, row, rpm=rpm, fault_orders=orders
            )
        except ValueError:
            return
        text = "; ".join(ax.get_title() for ax in shown.axes_)
        title = "Order spectrum of a row next to those of the model"
        shown.figure_.set_size_inches(7.0, 4.0)
        picture = Picture(title, f"{text}.", _embedded(shown.figure_))
        pyplot.close(shown.figure_)
    yield picture


def _picture(title: str, draw: Callable[..., str], *args: Any) -> Picture:
    """Return the picture that a function draws into axes; the function returns its text."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(_SETTINGS):
        figure = Figure(figsize=(7.0, 2.3), layout="constrained")
        text = draw(figure.subplots(), *args)
        return Picture(title, text, _embedded(figure))


def _embedded(figure):
    """Return the address of a figure, which holds the figure itself."""
    content = io.BytesIO()
    figure.savefig(content, format="svg", metadata={"Date": None, "Creator": None})
    return f"data:image/svg+xml;base64,{b64encode(content.getvalue()).decode()}"


def _draw_signal(ax, view):
    """Draw the smallest and the largest values of equal parts of the signal."""
    mean = view.output.mean()
    n_points = min(_MOST_POINTS, len(view.output))
    edges = np.linspace(0, len(view.output), n_points, endpoint=False).astype(int)
    extremes = [
        extreme.reduceat(view.output - mean, edges) for extreme in (np.fmin, np.fmax)
    ]
    rate = view.sampling_rate
    time = (view.start + edges) / (rate or 1)
    ax.fill_between(time, *extremes, color=_SIGNAL)
    ax.set(
        xlabel=f"Time ({'samples' if rate is None else 's'})",
        ylabel=f"Signal ({printable(view.unit or 'unit not stated')})",
    )
    ax.margins(x=0)
    return f"Smallest and largest values, less the mean of {mean:.4g}."


def _draw_combs(ax, view, bearing):
    """Draw the envelope spectrum over orders with the lines of a bearing."""
    classifier = make_fault_order_classifier(
        bearing=bearing, sampling_rate=view.sampling_rate
    )
    classifier.fit(view.output[np.newaxis])
    shown = EnvelopeSpectrumDisplay.from_estimator(
        classifier, view.output, rpm=view.rpm, ax=ax
    )
    ax.set_title("")
    _mark_shaft(ax)
    return sentence(shown.evidence)


def _draw_envelope(ax, view):
    """Draw the spectrum of the squared envelope of all frequencies."""
    frequencies, power = envelope_spectrum(view.output, view.sampling_rate)
    text = "Squared envelope of all frequencies, prewhitened."
    label = "Frequency (Hz)"
    highest = frequencies[-1]
    if view.shaft is None:
        text = f"The speed is not known (--rpm). {text}"
    else:
        frequencies = frequencies / view.shaft
        label = "Order of the shaft"
        highest = _HIGHEST_ORDER
    is_shown = (frequencies > 0) & (frequencies <= highest)
    _draw_level(ax, frequencies[is_shown], power[is_shown])
    ax.set(xlabel=label, ylabel="Power (dB)")
    if view.shaft is not None:
        _mark_shaft(ax)
    return text


def _draw_spectrum(ax, view):
    """Draw the power density, by Welch's method."""
    # Squares of very large and very small samples are no numbers.
    scale = np.abs(view.output).max()
    frequencies, power = welch(
        view.output / scale,
        view.sampling_rate or 1.0,
        nperseg=min(_SEGMENT, len(view.output)),
    )
    _draw_level(ax, frequencies, power, 20 * np.log10(scale))
    unit = "Hz" if view.sampling_rate else "1/sample"
    reference = ""
    if view.unit is not None and view.sampling_rate:
        reference = f" re 1 ({printable(view.unit)})²/Hz"
    ax.set(xlabel=f"Frequency ({unit})", ylabel=f"Power density (dB{reference})")
    return ""


def _draw_level(ax, x, power, offset=0.0):
    level = 10 * np.log10(np.maximum(power, _FLOOR * power.max())) + offset
    ax.plot(x, level, color=_SIGNAL, linewidth=0.8)
    ax.margins(x=0)


def _mark_shaft(ax):
    """Draw lines at multiples of the speed of the shaft, with their names above."""
    for multiple in _MARKED:
        ax.axvline(multiple, color=_SHAFT, linestyle="--", zorder=0)
        place = {"transform": ax.get_xaxis_transform(), "fontsize": "x-small"}
        ax.text(multiple, 1, f"{multiple}x shaft", rotation=30, **place)
