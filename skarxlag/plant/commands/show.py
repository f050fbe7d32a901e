"""Run ``skarxlag show``: draw recordings without a diagnosis."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import kurtosis

from ...core.files import write_atomically
from ...measures.levels import signal_levels
from ...measures.velocity import velocity_rms
from ..pages.drawings import recording_pictures
from ..pages.pages import render
from ..pages.recording_overview import STRETCH, Overview, overview
from ..readers.formats.rates import rates_agree
from ..readers.listing import ListedRecording
from .channels import plain_unit
from .messages import CommandError, as_command_error, printable, show


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    errors = draw(
        args.listed,
        args.output,
        bearing=args.bearing,
        healthy=args.listed_healthy,
        unit=args.unit,
    )
    for error in errors:
        print(error, file=sys.stderr)
    if len(errors) < len(args.listed):
        show(f"Written: {args.output}")
    return 1 if errors else 0


def draw(
    recordings: Sequence[ListedRecording],
    output: Path,
    *,
    bearing: str | None = None,
    healthy: Sequence[ListedRecording] = (),
    unit: str | None = None,
) -> list[str]:
    """Write a page with pictures of recordings, unless none can be read.

    Parameters
    ----------
    recordings : sequence of ListedRecording
        The recordings.
    output : Path
        The page.
    bearing : str or None, default=None
        Bearing whose lines are marked.
    healthy : sequence of ListedRecording, default=()
        Healthy recordings of the same machine.
    unit : str or None, default=None
        Unit of signals whose files state none.

    Returns
    -------
    list of str
        Why recordings could not be read.
    """
    with as_command_error():
        references = [_view(recording, unit).stretch for recording in healthy]
    entries = [_entry(each, bearing, references, unit) for each in recordings]
    failed = [entry for entry in entries if entry["error"]]
    if len(failed) < len(entries):
        page = render("show", entries=entries, bearing=bearing)
        write_atomically(output, page.encode(), follows_links=False)
    return [f"{entry['name']}: {entry['error']}" for entry in failed]


def _entry(recording, bearing, healthy, unit):
    name = printable(recording.name)
    try:
        with as_command_error():
            view = _view(recording, unit)
            figures = _pictures(view, bearing, healthy)
            facts = _facts(view)
    except CommandError as error:
        # The message names the file once or twice.
        reason = printable(error).split(f"{recording.path}: ")[-1]
        return {"name": name, "error": reason, "facts": "", "figures": []}
    return {"name": name, "error": "", "facts": facts, "figures": figures}


def _view(recording: ListedRecording, unit: str | None) -> Overview:
    """Read a recording once."""
    opened = recording.open(STRETCH, reads_speed=True)
    windows = (signal[np.newaxis] for signal in opened.blocks)
    view = overview(opened, windows, opened.sampling_rate)
    stretch = replace(view.stretch, unit=view.stretch.unit or unit)
    return replace(view, stretch=stretch)


def _pictures(view, bearing, healthy) -> list[Any]:
    alike = [
        other
        for other in healthy
        if rates_agree(other.sampling_rate, view.stretch.sampling_rate)
    ]
    return [*recording_pictures(view, bearing, alike)]


def _facts(view):
    """Return duration, rate, speed, levels and impulsiveness of a recording, as one line."""
    stretch = view.stretch
    rate = stretch.sampling_rate
    texts = [f"{view.duration} samples"]
    if rate is not None:
        texts = [f"{view.duration / rate:.4g} s at {rate:g} Hz"]
    if stretch.rpm is not None:
        texts.append(f"{stretch.mean_rpm:.5g} rpm")
    unit = f" {stretch.unit}" if stretch.unit else ""
    levels = signal_levels(stretch.samples)
    texts.append(f"RMS {levels.rms:.3g}{unit}; peak {levels.peak:.3g}{unit}")
    if np.ptp(stretch.samples) > 0:
        texts.append(f"crest factor {levels.crest_factor:.3g}")
        texts.append(f"kurtosis {kurtosis(stretch.samples, fisher=False):.3g}")
    rms = velocity_rms(stretch.samples, rate, plain_unit(stretch.unit or ""))
    if rms is not None:
        texts.append(f"velocity {rms:.3g} mm/s RMS from 10 to 1000 Hz")
    return "; ".join(texts)
