"""Rows of ``skarxlag fit``: windows or stretches, as long as the recordings allow."""

import argparse

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from ..readers.cutting import cut_recordings
from ..readers.entries import ListedRecording
from ..readers.rows import join_windows
from .messages import CommandError, Progress, as_command_error
from .models import DIAGNOSERS

#: Samples of a channel that the windows of all recordings hold together, unless
#: --max-windows says otherwise: a quarter of a GiB. The fits of companions copy the
#: healthy ones.
MOST_SAMPLES = 2**25
#: Seconds in a stretch, and revolutions of the shaft that it holds at least.
SECONDS = 1.0
REVOLUTIONS = 10
#: Samples in a window, of which stretches consist, and in a window of a detector.
_WINDOW_LENGTH = 1200
_DETECTOR_LENGTH = 4800
#: Stretches that the shortest recording holds at least, and those that are enough.
_FEWEST = 2
_ENOUGH = 4


def cuts_windows(args: argparse.Namespace) -> bool:
    """Return whether an option asks for windows instead of stretches."""
    of_windows = args.window_length or args.hop or args.max_windows
    return bool(of_windows or args.diagnoser in DIAGNOSERS)


def training_rows(
    args: argparse.Namespace, listed: list[ListedRecording]
) -> tuple[Bunch, str]:
    """Return the rows of recordings as a rig, and whether they are windows or stretches."""
    kind = args.diagnoser
    if cuts_windows(args):
        usual_length = _DETECTOR_LENGTH if kind == "detector" else _WINDOW_LENGTH
        rig = _cut(args, listed, args.window_length or usual_length)
        return rig, "stretches" if kind == "stretches" else "windows"
    rig = _cut(args, listed, _WINDOW_LENGTH)
    n_windows = _stretch_windows(rig)
    if n_windows is not None:
        return _in_rows(args, listed, rig, n_windows), "stretches"
    if kind == "stretches":
        raise CommandError(
            f"{args.table}: the shortest recording is too short for two stretches; use "
            "--diagnoser diagnoser"
        )
    if kind == "detector":
        rig = _in_rows(args, listed, rig, _DETECTOR_LENGTH // _WINDOW_LENGTH)
    return rig, "windows"


def _in_rows(args, listed, rig, n_windows):
    """Return rows of several windows. Only recordings of which some are missing are read again."""
    if len(rig.data) == rig.available.sum() and rig.available.min() >= n_windows:
        return join_windows(rig, n_windows)
    length = n_windows * rig.data.shape[-1]
    del rig["data"]
    return _cut(args, listed, length)


def _cut(args, listed, window_length):
    n_values = window_length * np.size(listed[0].channel) * len(listed)
    progress = Progress(len(listed), args)

    def note(entry, n_windows):
        progress.step(
            f"{entry.name}: read", f"{n_windows} windows of {window_length} samples"
        )

    with as_command_error():
        return cut_recordings(
            listed,
            args.table,
            window_length,
            hop=args.hop,
            max_windows=args.max_windows or max(MOST_SAMPLES // n_values, 2),
            resample=args.resample_to,
            note=note,
        )


def _stretch_windows(rig: Bunch) -> int | None:
    """Return the number of windows in a stretch, or None if the recordings are too short.

    A stretch takes a second, or ten revolutions at the slowest mean speed if they take
    longer. If one would hold less than four such stretches, a stretch takes a quarter
    of the shortest recording, but not less than half of that.

    >>> rig = Bunch(data=np.zeros((12, 500)), available=np.array([12, 40]), rpm=None,
    ...             sampling_rate=1_000.0, recording=np.repeat("run", 12))
    >>> _stretch_windows(rig)
    2
    >>> rig.rpm = np.full(12, 300.0)
    >>> _stretch_windows(rig)
    3
    >>> rig.rpm = np.full(12, 50.0)
    >>> _stretch_windows(rig)
    """
    seconds = SECONDS
    if rig.rpm is not None:
        # A run-up may begin at rest.
        slowest = pd.Series(rig.rpm).groupby(rig.recording).mean().min()
        seconds = max(SECONDS, 60 * REVOLUTIONS / slowest)
    usual = seconds * rig.sampling_rate / rig.data.shape[-1]
    shortest = rig.available.min()
    n_windows = int(np.ceil(min(usual, max(shortest // _ENOUGH, usual / 2))))
    return n_windows if shortest >= _FEWEST * n_windows else None
