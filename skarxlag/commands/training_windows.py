"""What ``fit`` calibrates on: windows or stretches of recordings, no more than memory holds."""

import argparse

from sklearn.utils import Bunch

from ..recordings.listing import ListedRecording
from ..recordings.rig import cut_recordings
from .errors import CommandError, as_command_error
from .progress import Progress
from .stretches import join_windows, stretch_windows

DETECTOR = "detector"
STRETCHES = "stretches"
#: Samples in a window; stretches consist of such windows.
_WINDOW_LENGTH = 1200
#: Samples in a row that the detector takes.
_DETECTOR_LENGTH = 4800
#: Samples of a channel that the windows of all recordings hold together, unless --max-windows says
#: otherwise: a quarter of a GiB, and three times as much while a diagnoser is fitted.
MOST_SAMPLES = 2**25


def training_windows(
    args: argparse.Namespace, listed: list[ListedRecording]
) -> tuple[Bunch, str, str]:
    """Windows or stretches of the recordings, and which diagnoser they are for.

    A detector takes stretches, too, where the recordings are long enough: rows of a second show
    faults that windows miss.

    Parameters
    ----------
    args : argparse.Namespace
        Of `fit`.
    listed : list of ListedRecording
        The recordings.

    Returns
    -------
    rig : Bunch
        As `load_recordings` returns it.
    kind : str
        Name of the diagnoser.
    rows : {"windows", "stretches"}
        What the rows of the rig are.

    Raises
    ------
    CommandError
        If a recording cannot be read, or stretches are asked for and it is too short.
    """
    kind = args.diagnoser
    is_cut = (args.window_length, args.hop, args.max_windows) != (None, None, None)
    if is_cut or kind not in (None, STRETCHES, DETECTOR):
        default = _DETECTOR_LENGTH if kind == DETECTOR else _WINDOW_LENGTH
        rig = _cut(args, listed, args.window_length or default)
        return rig, kind or "diagnoser", STRETCHES if kind == STRETCHES else "windows"
    rig = _cut(args, listed, _WINDOW_LENGTH)
    n_windows = stretch_windows(rig)
    if n_windows is not None:
        if rig.available.sum() == len(rig.data):
            return join_windows(rig, n_windows), kind or STRETCHES, STRETCHES
        # Windows that were left out cannot be joined.
        del rig["data"]
        return _cut(args, listed, n_windows * _WINDOW_LENGTH), kind or STRETCHES, STRETCHES
    if kind == STRETCHES:
        raise CommandError(
            f"{args.table}: the shortest recording is too short for two stretches of a second, or "
            "of ten turns; use --diagnoser diagnoser"
        )
    if kind == DETECTOR:
        return _cut(args, listed, _DETECTOR_LENGTH), kind, "windows"
    return rig, "diagnoser", "windows"


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
            resample=args.resample,
            note=lambda entry, n_windows: progress.step(
                f"{entry.name}: read", f"{n_windows} windows of {window_length} samples"
            ),
        )
    if args.max_windows is None and rig.available.sum() > len(rig.data):
        rig.DESCR += " (which keeps memory small; --max-windows states another number)"
    return rig
