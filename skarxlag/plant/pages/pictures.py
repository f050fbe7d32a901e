"""Pictures of a recording, as SVG that matplotlib draws."""

import io
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, welch

from ...core.validation import output_of_windows
from ...diagnosers import make_fault_order_classifier
from ...measures.envelope_spectra import envelope_spectrum
from ...measures.mains_hum import MAINS
from ...models.identification import ARXLaguerre
from ...plotting import EnvelopeSpectrumDisplay, OrderSpectrumDisplay
from ...plotting._style import ANY_PAGE, LEGEND, PALETTE
from ..commands.messages import counted, printable, sentence, speeds_as_text
from ..readers.entries import OpenRecording

#: Samples of a block, and of those whose spectra are drawn, at most.
STRETCH = 2**20
#: Points of a curve over time, at most.
_MOST_POINTS = 600
#: Order of the model that shows the part of a signal that cannot be predicted, and
#: samples that it is identified on, at least and at most.
_ORDER = 8
_FEWEST_SAMPLES = 64
_IDENTIFIED = 2**18
#: Samples in a segment of Welch's method.
_SEGMENT = 4096
#: Highest order, in multiples of the shaft's frequency, of the spectrum of low
#: frequencies and of the envelope spectrum without a bearing.
_LOW_ORDERS = 10
_HIGHEST_ORDER = 20
#: Peaks in a list.
_N_PEAKS = 5
#: Power relative to the largest of a spectrum that is drawn as its lowest.
_FLOOR = 1e-12
#: Settings of matplotlib: text stays text, and equal pictures are equal files.
_SETTINGS = ANY_PAGE | {"svg.fonttype": "none", "svg.hashsalt": "skarxlag"}
_HEALTHY, _SIGNAL, _UNPREDICTED, _FAULT, _MAINS_COLOUR = PALETTE[:5]


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
    """Recording as it is drawn: its extremes over time, and a stretch of its samples.

    Parameters
    ----------
    signal : tuple of two ndarrays of shape (n_points,)
        Smallest and largest values over time, less the mean of the signal.
    unpredicted : tuple of two ndarrays of shape (n_points,), or None
        The same of the part that a model of the recording does not predict. None if no
        model can be identified.
    mean : float
        Mean of the signal.
    duration : int
        Samples of the recording.
    samples : ndarray of shape (n_samples,)
        A stretch of the output.
    row : ndarray of shape ([n_channels, ]n_samples)
        A window of the stretch.
    sampling_rate : float or None
        In Hz.
    rpm, row_rpm : float, ndarray or None
        Speed of the stretch and of the row, or that of each sample.
    unit : str or None
        Unit of the samples.
    """

    signal: tuple[NDArray[Any], NDArray[Any]]
    unpredicted: tuple[NDArray[Any], NDArray[Any]] | None
    mean: float
    duration: int
    samples: NDArray[Any]
    row: NDArray[Any]
    sampling_rate: float | None
    rpm: Any
    row_rpm: Any
    unit: str | None

    @property
    def shaft(self) -> float | None:
        """Mean frequency of the shaft in Hz."""
        return None if self.rpm is None else float(np.mean(self.rpm)) / 60


def view_recording(
    opened: OpenRecording,
    blocks: Iterable[NDArray[Any]],
    sampling_rate: float | None,
    *,
    at: int = 0,
    unit: str | None = None,
) -> RecordingView:
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
        First sample of the row, which the stretch contains.
    unit : str or None, default=None
        Unit of the signal if the file states none.

    Raises
    ------
    FileNotFoundError, ImportError, ValueError
        If the signal cannot be read.
    """
    signal: list[Any] = []
    errors: list[Any] = []
    duration = 0
    total = 0.0
    for X in blocks:
        output = output_of_windows(X).ravel()
        if not signal:
            model = _identified(output)
        signal.append(_extremes(output))
        if model is not None:
            predicted = model.predict_output(output[np.newaxis, np.newaxis])[0, 0]
            # Predictions are missing while the model settles.
            errors.append(_extremes(output[-len(predicted) :] - predicted))
        if duration <= at < duration + len(output):
            first = duration
            samples = output[:STRETCH].astype(float)
            row = X[(at - first) // X.shape[-1]]
        duration += len(output)
        total += output.sum()
    mean = float(total / duration)
    low, high = _joined(signal)
    speeds = [
        opened.entry.speeds([start], part.shape[-1], sampling_rate)
        for start, part in ((first, samples), (at, row))
    ]
    # The speeds of a profile are an array with a row.
    rpm, row_rpm = (speed if np.ndim(speed) == 0 else speed[0] for speed in speeds)
    return RecordingView(
        signal=(low - mean, high - mean),
        unpredicted=_joined(errors) if errors else None,
        mean=mean,
        duration=duration,
        samples=samples,
        row=row,
        sampling_rate=sampling_rate,
        rpm=rpm,
        row_rpm=row_rpm,
        unit=opened.channels[0][1] or unit,
    )


def _identified(output):
    """Return an autoregressive model of a signal; None if it is too short."""
    if len(output) < _FEWEST_SAMPLES:
        return None
    identify = ARXLaguerre(order=_ORDER, bank=False, unit_rms=False)
    # Windows of several channels, or of one in this form, may have any length.
    return identify.fit(output[np.newaxis, np.newaxis, :_IDENTIFIED])


def _extremes(low, high=None):
    """Return the smallest and the largest values of equal parts of a series."""
    n_points = min(_MOST_POINTS, len(low))
    edges = np.linspace(0, len(low), n_points, endpoint=False).astype(int)
    high = low if high is None else high
    return np.fmin.reduceat(low, edges), np.fmax.reduceat(high, edges)


def _joined(parts):
    """Return the extremes of parts that follow one another."""
    return _extremes(*(np.concatenate(side) for side in zip(*parts, strict=True)))


def recording_pictures(
    view: RecordingView,
    bearing: str | None,
    healthy: Sequence[RecordingView] = (),
) -> Iterator[Picture | str]:
    """Yield pictures of a recording, and sentences on those that cannot be drawn.

    Parameters
    ----------
    view : RecordingView
        The recording.
    bearing : str or None
        Bearing whose lines are marked.
    healthy : sequence of RecordingView, default=()
        Healthy recordings of the same sampling rate.
    """
    yield _picture("Signal", _draw_signal, view)
    if np.ptp(view.samples) == 0:
        yield "Spectra: the signal is constant."
        return
    if len(view.samples) < _FEWEST_SAMPLES:
        yield f"Spectra: {len(view.samples)} samples are too few."
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
    if view.sampling_rate is not None:
        yield _picture("Spectrum of low frequencies", _draw_low_frequencies, view)
    yield _picture("Spectrum", _draw_spectrum, view, healthy)


def order_pictures(
    diagnoser: Any, view: RecordingView, orders: dict[str, float] | None
) -> Iterator[Picture]:
    """Yield the order spectrum of the row next to those of the nearest conditions.

    Nothing is drawn of a diagnoser that compares no order spectra.
    """
    from matplotlib import pyplot, rc_context

    with rc_context(_SETTINGS):
        try:
            shown = OrderSpectrumDisplay.from_estimator(
                diagnoser, view.row, rpm=view.row_rpm, fault_orders=orders
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
    """Draw the signal over time, and the part of it that its own model cannot predict."""
    text = f"Smallest and largest values, less the mean of {view.mean:.4g}."
    curves = {"signal": (view.signal, _SIGNAL)}
    if view.unpredicted is None:
        text += " It is too short for a model of what can be predicted."
    else:
        curves["unpredicted"] = view.unpredicted, _UNPREDICTED
        text += (
            " Unpredicted: the part that an autoregressive model of the recording "
            "itself does not predict. Impacts stay in it, steady tones do not."
        )
    rate = view.sampling_rate
    for name, (values, colour) in curves.items():
        time = np.linspace(0, view.duration / (rate or 1), len(values[0]))
        ax.fill_between(time, *values, color=colour, label=name)
    ax.set(
        xlabel=f"Time ({'samples' if rate is None else 's'})",
        ylabel=f"Signal ({printable(view.unit or 'unit not stated')})",
    )
    ax.margins(x=0)
    ax.legend(loc="upper right", ncols=2, **LEGEND)
    return text


def _draw_combs(ax, view, bearing):
    """Draw the envelope spectrum over orders with the lines of a bearing; return its peaks."""
    classifier = make_fault_order_classifier(
        bearing=bearing, sampling_rate=view.sampling_rate
    )
    classifier.fit(view.samples[np.newaxis])
    shown = EnvelopeSpectrumDisplay.from_estimator(
        classifier, view.samples, rpm=view.rpm, ax=ax
    )
    ax.set_title("")
    _mark_shaft(ax, 1, 2)
    orders, contrast = shown.line_.get_data()
    peaks = _highest_peaks(orders * view.shaft, contrast, view.shaft)
    return f"{sentence(shown.evidence)} {peaks}"


def _draw_envelope(ax, view):
    """Draw the spectrum of the squared envelope of all frequencies; return its peaks."""
    frequencies, power = envelope_spectrum(view.samples, view.sampling_rate)
    shaft = view.shaft
    highest = frequencies[-1] if shaft is None else _HIGHEST_ORDER * shaft
    is_shown = (frequencies > 0) & (frequencies <= highest)
    frequencies, level = frequencies[is_shown], _in_decibel(power)[is_shown]
    peaks = _highest_peaks(frequencies, level, shaft)
    text = f"Squared envelope of all frequencies, prewhitened. {peaks}"
    if shaft is None:
        _draw_line(ax, frequencies, level, "Frequency (Hz)", "Power (dB)")
        return f"The speed is not known (--rpm). {text}"
    _draw_line(ax, frequencies / shaft, level, "Order of the shaft", "Power (dB)")
    _mark_shaft(ax, 1, 2)
    return text


def _draw_low_frequencies(ax, view):
    """Draw low frequencies with the lines of the shaft and the mains; return their peaks."""
    frequencies, level = _power_spectrum(view, len(view.samples))
    shaft = view.shaft
    highest = max(2.5 * max(MAINS), _LOW_ORDERS * (shaft or 0.0))
    is_shown = frequencies <= highest
    frequencies, level = frequencies[is_shown], level[is_shown]
    _draw_line(ax, frequencies, level, *_spectrum_labels(view))
    ax.set_ylim(level.max() - 80, level.max() + 5)
    for mains in MAINS:
        _mark(ax, mains, f"{mains:g} Hz mains", _MAINS_COLOUR)
    if shaft is not None:
        _mark_shaft(ax, shaft, 3)
    return _highest_peaks(frequencies, level, shaft)


def _draw_spectrum(ax, view, healthy):
    """Draw the spectrum, next to the range of healthy recordings."""
    frequencies, level = _power_spectrum(view, _SEGMENT)
    _draw_line(ax, frequencies, level, *_spectrum_labels(view))
    if not healthy:
        return ""
    references = [
        np.interp(frequencies, *_power_spectrum(other, _SEGMENT)) for other in healthy
    ]
    label = f"stated healthy: {counted(len(healthy), 'recording')}"
    low, high = np.min(references, axis=0), np.max(references, axis=0)
    ax.fill_between(frequencies, low, high, color=_HEALTHY, alpha=0.4, label=label)
    ax.legend(loc="upper right", **LEGEND)
    speeds = {60 * other.shaft for other in healthy if other.rpm is not None}
    of_speeds = f" at {speeds_as_text(sorted(speeds))} rpm" if speeds else ""
    return f"{label}{of_speeds}."


def _power_spectrum(view, segment):
    """Return frequencies and the power density in dB, by Welch's method."""
    # Squares of very large and very small samples are no numbers.
    scale = np.abs(view.samples).max()
    frequencies, power = welch(
        view.samples / scale,
        view.sampling_rate or 1.0,
        nperseg=min(segment, len(view.samples)),
    )
    return frequencies, _in_decibel(power) + 20 * np.log10(scale)


def _in_decibel(power):
    return 10 * np.log10(np.maximum(power, _FLOOR * power.max()))


def _spectrum_labels(view):
    if view.sampling_rate is None:
        return "Frequency (1/sample)", "Power density (dB)"
    reference = "" if view.unit is None else f" re 1 ({printable(view.unit)})²/Hz"
    return "Frequency (Hz)", f"Power density (dB{reference})"


def _draw_line(ax, x, level, xlabel, ylabel):
    ax.plot(x, level, color=_SIGNAL, linewidth=0.8)
    ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.margins(x=0)


def _mark_shaft(ax, shaft, n_multiples):
    for multiple in range(1, n_multiples + 1):
        _mark(ax, multiple * shaft, f"{multiple}x shaft", _FAULT)


def _mark(ax, position, label, colour):
    """Draw a line across the axes, with its name at the upper end, if it is within them."""
    if position <= ax.dataLim.x1:
        ax.axvline(position, color=colour, linestyle="--", zorder=0)
        where = ax.get_xaxis_transform()
        ax.text(position, 1, label, transform=where, fontsize="x-small", rotation=30)


def _highest_peaks(frequencies, heights, shaft):
    """Return a sentence on the five highest peaks: frequency in Hz, order and height."""
    peaks, _ = find_peaks(heights)
    texts = []
    for place in peaks[np.argsort(heights[peaks])[::-1][:_N_PEAKS]]:
        order = "" if shaft is None else f" (order {frequencies[place] / shaft:.2f})"
        texts.append(f"{frequencies[place]:.4g} Hz{order} {heights[place]:.0f} dB")
    return f"Highest peaks: {', '.join(texts)}." if texts else ""
