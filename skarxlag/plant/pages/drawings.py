"""Pictures of a recording for the pages, as SVG that matplotlib draws."""

import io
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, welch

from ...diagnosers import make_fault_order_classifier
from ...measures.envelope_spectra import envelope_spectrum
from ...plotting import EnvelopeSpectrumDisplay, OrderSpectrumDisplay, condition_styles
from ...plotting._style import ANY_PAGE, LEGEND
from ..commands.messages import counted, listed
from .recording_overview import Overview, Stretch, extremes

#: Samples in a segment of Welch's method.
_SEGMENT = 4096
#: Highest order, in multiples of the shaft's frequency, of the spectrum of low
#: frequencies and of the envelope spectrum without a bearing.
_LOW_ORDERS = 10
_HIGHEST_ORDER = 20
#: Hum of the mains in Hz.
_MAINS = (50.0, 60.0)
#: Peaks in a list.
_N_PEAKS = 5
#: Samples from which on spectra are drawn.
_FEWEST_SAMPLES = 64
#: Power relative to the largest of a spectrum that is drawn as its lowest.
_FLOOR = 1e-12
#: Settings of matplotlib: text stays text, and equal pictures are equal files.
_SETTINGS = ANY_PAGE | {"svg.fonttype": "none", "svg.hashsalt": "skarxlag"}
_COLOURS = {
    name: style["color"]
    for name, style in condition_styles(
        ["healthy", "signal", "unpredicted", "fault", "alarm"]
    ).items()
}


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


def _picture(title: str, draw: Callable[[Any], str | None]) -> Picture:
    """Return the picture that a function draws into axes; the function returns its text."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(_SETTINGS):
        figure = Figure(figsize=(7.0, 2.3), layout="constrained")
        text = draw(figure.subplots()) or ""
        return Picture(title, text, _embedded(figure))


def _embedded(figure):
    """Return the address of a figure, which holds the figure itself."""
    content = io.BytesIO()
    figure.savefig(content, format="svg", metadata={"Date": None, "Creator": None})
    return f"data:image/svg+xml;base64,{b64encode(content.getvalue()).decode()}"


def recording_pictures(
    view: Overview,
    bearing: str | None,
    healthy: Sequence[Stretch] = (),
) -> Iterator[Picture | str]:
    """Yield pictures of a recording, and sentences on those that cannot be drawn.

    Parameters
    ----------
    view : Overview
        The recording.
    bearing : str or None
        Bearing whose lines are marked.
    healthy : sequence of Stretch, default=()
        Parts of healthy recordings, of the same sampling rate.
    """
    yield signal_picture(view)
    stretch = view.stretch
    if np.ptp(stretch.samples) == 0:
        yield "Spectra: the signal is constant."
        return
    if len(stretch.samples) < _FEWEST_SAMPLES:
        yield f"Spectra: {len(stretch.samples)} samples are too few."
        return
    yield envelope_picture(stretch, bearing)
    if stretch.sampling_rate is not None:
        yield low_frequency_picture(stretch)
    yield spectrum_picture(stretch, healthy)


def signal_picture(view: Overview) -> Picture:
    """Draw the signal over time, and the part of it that its own model cannot predict."""
    rate = view.stretch.sampling_rate
    unit = view.stretch.unit or "unit not stated"

    def draw(ax):
        for values, name in (
            (view.signal, "signal"),
            (view.unpredicted, "unpredicted"),
        ):
            if values is not None:
                time = np.linspace(0, view.duration / (rate or 1), len(values[0]))
                ax.fill_between(time, *values, color=_COLOURS[name], label=name)
        ax.set(xlabel=_time_label(rate), ylabel=f"Signal ({unit})")
        ax.margins(x=0)
        ax.legend(loc="upper right", ncols=2, **LEGEND)
        text = f"Smallest and largest values, less the mean of {view.mean:.4g}."
        if view.unpredicted is None:
            return f"{text} It is too short for a model of what can be predicted."
        return (
            f"{text} Unpredicted: the part that an autoregressive model of the recording "
            "itself does not predict. Impacts stay in it, steady tones do not."
        )

    return _picture("Signal", draw)


def _time_label(sampling_rate):
    return "Time (samples)" if sampling_rate is None else "Time (s)"


def power_spectrum(
    stretch: Stretch, segment: int = _SEGMENT
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return frequencies and the power density in dB, by Welch's method."""
    # Squares of very large and very small samples are no numbers.
    scale = np.abs(stretch.samples).max()
    frequencies, power = welch(
        stretch.samples / scale,
        stretch.sampling_rate or 1.0,
        nperseg=min(segment, len(stretch.samples)),
    )
    return frequencies, _in_decibel(power) + 20 * np.log10(scale)


def _in_decibel(power):
    return 10 * np.log10(np.maximum(power, _FLOOR * power.max()))


def _draw_spectrum(ax, stretch, frequencies, level, **labels):
    """Draw the largest values of equal parts of a spectrum, so that no line is lost."""
    unit = "1/sample" if stretch.sampling_rate is None else "Hz"
    density = "Power density (dB)"
    if stretch.unit is not None and stretch.sampling_rate is not None:
        density = f"Power density (dB re 1 ({stretch.unit})²/Hz)"
    points = extremes(frequencies)[0], extremes(level)[1]
    ax.plot(*points, color=_COLOURS["signal"], linewidth=0.8, label="this recording")
    ax.set(**{"xlabel": f"Frequency ({unit})", "ylabel": density} | labels)
    ax.margins(x=0)


def spectrum_picture(stretch: Stretch, healthy: Sequence[Stretch]) -> Picture:
    """Draw the spectrum of a stretch next to the range of healthy recordings."""
    frequencies, level = power_spectrum(stretch)
    references = [np.interp(frequencies, *power_spectrum(other)) for other in healthy]

    def draw(ax):
        _draw_spectrum(ax, stretch, frequencies, level)
        if not references:
            return None
        low = extremes(np.min(references, axis=0))[0]
        high = extremes(np.max(references, axis=0))[1]
        label = f"stated healthy: {counted(len(healthy), 'recording')}"
        style = {"color": _COLOURS["healthy"], "alpha": 0.4, "label": label}
        ax.fill_between(extremes(frequencies)[0], low, high, **style)
        ax.legend(loc="upper right", ncols=2, **LEGEND)
        speeds = {other.mean_rpm for other in healthy if other.rpm is not None}
        of_speeds = f" at {listed(sorted(speeds))} rpm" if speeds else ""
        return f"{label}{of_speeds}."

    return _picture("Spectrum", draw)


def low_frequency_picture(stretch: Stretch) -> Picture:
    """Draw the spectrum of low frequencies, with the lines of the shaft and the mains."""
    frequencies, level = power_spectrum(stretch, len(stretch.samples))
    highest = 2.5 * max(_MAINS)
    if stretch.shaft is not None:
        highest = max(highest, _LOW_ORDERS * stretch.shaft)
    is_shown = frequencies <= highest
    frequencies, level = frequencies[is_shown], level[is_shown]

    def draw(ax):
        lowest = level.max() - 80
        _draw_spectrum(ax, stretch, frequencies, level, ylim=(lowest, level.max() + 5))
        for mains in _MAINS:
            _mark(ax, mains, f"{mains:g} Hz mains", "alarm")
        if stretch.shaft is not None:
            _mark_shaft(ax, stretch.shaft, 3)
        return _highest_peaks(frequencies, level, stretch.shaft)

    return _picture("Spectrum of low frequencies", draw)


def _mark_shaft(ax, shaft, n_multiples):
    for multiple in range(1, n_multiples + 1):
        _mark(ax, multiple * shaft, f"{multiple}x shaft", "fault")


def _mark(ax, position, label, colour):
    """Draw a line across the axes, with its name at the upper end, if it is within them."""
    if position <= ax.dataLim.x1:
        ax.axvline(position, color=_COLOURS[colour], linestyle="--", zorder=0)
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


def envelope_picture(stretch: Stretch, bearing: str | None) -> Picture | str:
    """Draw the envelope spectrum over shaft orders, with the bearing's lines if it is given.

    Without a speed, it is drawn over frequency.
    """
    title = "Envelope spectrum"
    rate = stretch.sampling_rate
    if rate is None:
        return (
            f"{title}: the sampling rate is not known; state it with --sampling-rate."
        )
    if bearing is None or stretch.rpm is None:
        why = "" if stretch.rpm is not None else "The speed is not known (--rpm). "
        return _picture(title, lambda ax: f"{why}{_draw_envelope(ax, stretch)}")

    def draw(ax):
        row = stretch.samples
        classifier = make_fault_order_classifier(bearing=bearing, sampling_rate=rate)
        classifier.fit(row[np.newaxis])
        shown = EnvelopeSpectrumDisplay.from_estimator(
            classifier, row, rpm=stretch.rpm, ax=ax
        )
        ax.set_title("")
        _mark_shaft(ax, 1, 2)
        orders, contrast = shown.line_.get_data()
        peaks = _highest_peaks(orders * stretch.shaft, contrast, stretch.shaft)
        return f"{shown.evidence[:1].upper()}{shown.evidence[1:]}. {peaks}"

    try:
        return _picture(f"{title} and lines of bearing {bearing}", draw)
    except ValueError as error:
        return f"{title}: {error}"


def _draw_envelope(ax, stretch):
    """Draw the spectrum of the squared envelope of all frequencies; return its peaks."""
    frequencies, power = envelope_spectrum(stretch.samples, stretch.sampling_rate)
    shaft = stretch.shaft
    highest = frequencies[-1] if shaft is None else _HIGHEST_ORDER * shaft
    is_shown = (frequencies > 0) & (frequencies <= highest)
    frequencies, level = frequencies[is_shown], _in_decibel(power)[is_shown]
    if shaft is None:
        _draw_spectrum(ax, stretch, frequencies, level, ylabel="Power (dB)")
    else:
        labels = {"xlabel": "Order of the shaft", "ylabel": "Power (dB)"}
        _draw_spectrum(ax, stretch, frequencies / shaft, level, **labels)
        _mark_shaft(ax, 1, 2)
    peaks = _highest_peaks(frequencies, level, shaft)
    return f"Squared envelope of all frequencies, prewhitened. {peaks}"


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
