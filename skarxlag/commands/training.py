"""Training data of ``fit``: windows or stretches of recordings, no more than memory holds."""

import argparse

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from ..recordings.listing import ListedRecording
from ..recordings.rig import cut_recordings
from .messages import CommandError, Progress, as_command_error
from .models import DIAGNOSERS

#: Samples of a channel that the windows of all recordings hold together, unless --max-windows says
#: otherwise: a quarter of a GiB, and three times as much while a diagnoser is fitted.
MOST_SAMPLES = 2**25
#: Samples in a window. Stretches consist of such windows.
_WINDOW_LENGTH = 1200
#: Samples in a window of a detector.
_DETECTOR_LENGTH = 4800
#: Seconds in a stretch, and turns of the shaft that it holds at least.
_SECONDS, _TURNS = 1.0, 10
#: Stretches that the shortest recording holds at least, and those that are enough.
_FEWEST, _ENOUGH = 2, 4


def training_rows(args: argparse.Namespace, listed: list[ListedRecording]) -> tuple[Bunch, str]:
    """Return the rows of recordings as a rig, and whether they are windows or stretches."""
    needs_stretches = args.diagnoser == "stretches"
    length = _DETECTOR_LENGTH if args.diagnoser == "detector" else _WINDOW_LENGTH
    if args.window_length or args.hop or args.max_windows or args.diagnoser in DIAGNOSERS:
        rig = _cut(args, listed, args.window_length or length)
        return rig, "stretches" if needs_stretches else "windows"
    rig = _cut(args, listed, _WINDOW_LENGTH)
    n_windows = stretch_windows(rig)
    if n_windows is None and needs_stretches:
        raise CommandError(
            f"{args.table}: the shortest recording is too short for two stretches of a second, or "
            "of ten turns; use --diagnoser diagnoser"
        )
    kind = "windows" if n_windows is None else "stretches"
    length = length if n_windows is None else n_windows * _WINDOW_LENGTH
    if length == _WINDOW_LENGTH:
        return rig, kind
    del rig["data"]
    return _cut(args, listed, length), kind


def _cut(args, listed, window_length):
    channel = listed[0].channel
    n_channels = len(channel) if isinstance(channel, list) else 1
    most = max(MOST_SAMPLES // (window_length * n_channels * len(listed)), 2)
    with as_command_error(), Progress(len(listed), "recordings", args) as progress:
        rig = cut_recordings(
            listed,
            args.table,
            window_length=window_length,
            hop=args.hop,
            max_windows=args.max_windows or most,
            resample=args.resample_to,
            note=lambda entry, n_windows: progress.step(
                f"{entry.name}: read", f"{n_windows} windows of {window_length} samples"
            ),
        )
    if args.max_windows is None and rig.available.sum() > len(rig.data):
        rig.DESCR += " (which keeps memory small; --max-windows states another number)"
    return rig


def stretch_windows(rig: Bunch) -> int | None:
    """Return the number of windows in a stretch, or None if the recordings are too short.

    A stretch takes a second, or ten turns at the slowest mean speed if they take longer. If one
    would hold less than four such stretches, a stretch takes a quarter of the shortest recording,
    but not less than half of that.

    >>> rig = Bunch(data=np.zeros((12, 500)), available=np.array([12, 40]), rpm=None,
    ...             sampling_rate=1_000.0, recording=np.repeat("run", 12))
    >>> stretch_windows(rig)
    2
    >>> rig.rpm = np.full(12, 300.0)
    >>> stretch_windows(rig)
    3
    >>> rig.rpm = np.full(12, 50.0)
    >>> stretch_windows(rig)
    """
    seconds = _SECONDS
    if rig.rpm is not None:
        # A run-up may begin at rest.
        slowest = pd.Series(rig.rpm).groupby(rig.recording).mean().min()
        seconds = max(_SECONDS, 60 * _TURNS / slowest)
    wanted = seconds * rig.sampling_rate / rig.data.shape[-1]
    shortest = rig.available.min()
    n_windows = int(np.ceil(min(wanted, max(shortest // _ENOUGH, wanted / 2))))
    return n_windows if shortest >= _FEWEST * n_windows else None
