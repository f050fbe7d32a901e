"""Run ``skarxlag show``: draw recordings without a diagnosis."""

import argparse
import sys
from typing import Any

import numpy as np
from scipy.stats import kurtosis

from ...core.files import write_atomically
from ..pages.drawings import recording_pictures
from ..pages.pages import render
from ..pages.recording_overview import STRETCH, Overview, overview
from ..readers.listing import ListedRecording
from ..readers.rates import rates_agree
from .channels import plain_unit
from .messages import CommandError, as_command_error, printable
from .velocity import velocity_rms


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    with as_command_error():
        healthy = [_view(recording).stretch for recording in args.listed_healthy]
    entries = [_entry(recording, args.bearing, healthy) for recording in args.listed]
    page = render("show", entries=entries, bearing=args.bearing)
    write_atomically(args.output, page.encode())
    failed = [entry for entry in entries if entry["error"]]
    for entry in failed:
        print(f"{entry['name']}: {entry['error']}", file=sys.stderr)
    print(f"Written: {args.output}")
    return 1 if failed else 0


def _entry(recording, bearing, healthy):
    name = printable(recording.name)
    try:
        with as_command_error():
            view = _view(recording)
            figures = _pictures(view, bearing, healthy)
            facts = _facts(view)
    except CommandError as error:
        # The message names the file once or twice.
        reason = printable(error).split(f"{recording.path}: ")[-1]
        return {"name": name, "error": reason, "facts": "", "figures": []}
    return {"name": name, "error": "", "facts": facts, "figures": figures}


def _view(recording: ListedRecording) -> Overview:
    """Read a recording once."""
    opened = recording.open(STRETCH, reads_speed=True)
    windows = (signal[np.newaxis] for signal in opened.blocks)
    return overview(opened, windows, opened.sampling_rate)


def _pictures(view, bearing, healthy) -> list[Any]:
    alike = [
        other
        for other in healthy
        if rates_agree(other.sampling_rate, view.stretch.sampling_rate)
    ]
    return [*recording_pictures(view, bearing, alike, "stated healthy")]


def _facts(view):
    """Return duration, rate, speed, level and impulsiveness of a recording, as one line."""
    stretch = view.stretch
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
