"""Run ``skarxlag show``: draw recordings without a diagnosis."""

import argparse
import sys
from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from scipy.stats import kurtosis

from ..bearings import bearing_orders
from ..core.files import write_atomically
from ..models.identification import ARXLaguerre
from ..recordings.listing import ListedRecording
from ..recordings.rates import rates_agree
from . import recording_views as views
from .channels import plain_unit
from .messages import CommandError, as_command_error, printable
from .pages import render
from .velocity import velocity_rms

#: Order of the model that shows what cannot be predicted, and samples that it is
#: identified on, at most.
_ORDER, _IDENTIFIED = 8, 2**18


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    orders = None if args.bearing is None else bearing_orders(args.bearing)
    with as_command_error():
        healthy = [_view(recording)[1] for recording in args.listed_healthy]
    entries = [_entry(recording, orders, healthy) for recording in args.listed]
    page = render("show", entries=entries, bearing=args.bearing)
    write_atomically(args.output, page.encode())
    failed = [entry for entry in entries if entry["error"]]
    for entry in failed:
        print(f"{entry['name']}: {entry['error']}", file=sys.stderr)
    print(f"Written: {args.output}")
    return 1 if failed else 0


def _entry(recording, orders, healthy):
    name = printable(recording.name)
    try:
        with as_command_error():
            view, stretch = _view(recording)
            figures = [*_figures(view, stretch, orders, healthy)]
            facts = _facts(view, stretch)
    except CommandError as error:
        # The message names the file once or twice.
        reason = printable(error).split(f"{recording.path}: ")[-1]
        return {"name": name, "error": reason, "facts": "", "figures": []}
    return {"name": name, "error": "", "facts": facts, "figures": figures}


def _view(recording: ListedRecording) -> tuple[views.Overview, views.Stretch]:
    """Read a recording once."""
    opened = recording.open(views.STRETCH, reads_speed=True)
    first = next(opened.blocks)
    windows = (signal[np.newaxis] for signal in chain([first], opened.blocks))
    view = views.overview(windows, _predictor(first))
    return view, views.stretch_of(view, opened, opened.sampling_rate)


def _predictor(signal):
    """Return the predictions of a model of the signal; None if there is none."""
    identify = ARXLaguerre(order=_ORDER, bank=False, unit_rms=False)
    try:
        identify.fit(signal[np.newaxis, ..., :_IDENTIFIED])
    except ValueError:
        # The signal is constant or too short.
        return None
    return lambda X: identify.predict_output(X)[:, 0]


def _figures(view, stretch, orders, healthy) -> Iterator[Any]:
    yield views.signal_figure(view, stretch.sampling_rate, stretch.unit)
    yield views.orders_figure(stretch, orders)
    alike = [
        other
        for other in healthy
        if rates_agree(other.sampling_rate, stretch.sampling_rate)
    ]
    yield views.spectrum_figure(stretch, alike, "stated healthy")


def _facts(view, stretch):
    """Return duration, rate, speed, level and impulsiveness of a recording, as one line."""
    rate = stretch.sampling_rate
    texts = [f"{view.duration} samples"]
    if rate is not None:
        texts = [f"{view.duration / rate:.4g} s at {rate:g} Hz"]
    if stretch.rpm is not None:
        texts.append(f"{stretch.mean_rpm:.5g} rpm")
    unit = f" {stretch.unit}" if stretch.unit else ""
    texts.append(f"standard deviation {np.std(stretch.samples):.3g}{unit}")
    if np.ptp(stretch.samples) > 0:
        texts.append(f"kurtosis {kurtosis(stretch.samples, fisher=False):.3g}")
    rms = velocity_rms(stretch.samples, rate, plain_unit(stretch.unit or ""))
    if rms is not None:
        texts.append(f"velocity {rms:.3g} mm/s RMS from 10 to 1000 Hz")
    return "; ".join(texts)
