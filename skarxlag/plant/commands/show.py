"""Run ``skarxlag show``: draw recordings without a diagnosis."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.stats import kurtosis

from ...measures.levels import signal_levels
from ...measures.velocity import velocity_rms
from ...persistence.files import write_atomically
from ..pages import render
from ..pages.pictures import recording_pictures, view_recording
from ..readers.listing import ListedRecording
from .messages import CommandError, as_command_error, keywords, printable, show
from .training_facts import plain_unit

#: Samples at the beginning of a recording that are drawn, at most.
_STRETCH = 2**20


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    errors = draw(**keywords(draw, args))
    for error in errors:
        print(error, file=sys.stderr)
    if len(errors) < len(args.recordings):
        show(f"Written: {args.output}")
    return 1 if errors else 0


def draw(
    recordings: Sequence[ListedRecording],
    output: Path,
    *,
    bearing: str | None = None,
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
    unit : str or None, default=None
        Unit of signals whose files state none.

    Returns
    -------
    list of str
        Why recordings could not be read.
    """
    entries = [_entry(recording, bearing, unit) for recording in recordings]
    failed = [entry for entry in entries if entry["error"]]
    if len(failed) < len(entries):
        page = render("show", entries=entries, bearing=bearing)
        write_atomically(output, page.encode(), follows_links=False)
    return [f"{entry['name']}: {entry['error']}" for entry in failed]


def _entry(recording, bearing, unit):
    """Return the section of a recording, or the reason why there is none."""
    entry = {"name": printable(recording.name), "error": "", "facts": "", "figures": []}
    try:
        with as_command_error():
            opened = recording.open(_STRETCH, reads_speed=True)
            view = view_recording(opened, opened.sampling_rate, unit=unit)
            figures = [*recording_pictures(view, bearing)]
            return entry | {"facts": "; ".join(_facts(view)), "figures": figures}
    except CommandError as error:
        # The message names the file once or twice.
        return entry | {"error": printable(error).split(f"{recording.path}: ")[-1]}


def _facts(view):
    """Yield duration, rate, speed, levels and impulsiveness of a recording."""
    rate = view.sampling_rate
    if rate is None:
        yield f"{view.duration} samples"
    else:
        yield f"{view.duration / rate:.4g} s at {rate:g} Hz"
    if view.rpm is not None:
        yield f"{60 * view.shaft:.5g} rpm"
    unit = f" {view.unit}" if view.unit else ""
    levels = signal_levels(view.output)
    yield f"RMS {levels.rms:.3g}{unit}; peak {levels.peak:.3g}{unit}"
    if np.ptp(view.output) > 0:
        yield f"crest factor {levels.crest_factor:.3g}"
        yield f"kurtosis {kurtosis(view.output, fisher=False):.3g}"
    rms = velocity_rms(view.output, rate, plain_unit(view.unit or ""))
    if rms is not None:
        yield f"velocity {rms:.3g} mm/s RMS from 10 to 1000 Hz"
