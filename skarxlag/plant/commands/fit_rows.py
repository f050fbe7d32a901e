"""Rows of ``skarxlag fit``: windows or stretches, as long as the recordings allow."""

from typing import Any

import numpy as np
import pandas as pd
from sklearn.utils import Bunch

from ..readers.cutting import cut_recordings
from ..readers.entries import ListedRecording
from ..readers.rows import join_windows
from .messages import CommandError, Reporter, as_command_error
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


def training_rows(
    recordings: list[ListedRecording],
    source: Any,
    *,
    kind: str | None = None,
    window_length: int | None = None,
    hop: int | None = None,
    max_windows: int | None = None,
    resample_to: float | None = None,
    reporter: Reporter | None = None,
) -> tuple[Bunch, str]:
    """Return the rows of recordings as a rig, and whether they are windows or stretches.

    Parameters
    ----------
    recordings : list of ListedRecording
        The recordings.
    source : path-like
        Named in messages.
    kind : str or None, default=None
        Kind of the diagnoser. None: as the recordings allow.
    window_length, hop, max_windows, resample_to
        As in ``skarxlag fit``.
    reporter : Reporter or None, default=None
        Counts the recordings that are read.

    Raises
    ------
    CommandError
        If a recording cannot be read, or is too short.
    """
    reporter = reporter or Reporter()

    def cut(length):
        reporter.start(len(recordings))
        n_values = length * np.size(recordings[0].channel) * len(recordings)
        with as_command_error():
            return cut_recordings(
                recordings,
                source,
                length,
                hop=hop,
                max_windows=max_windows or max(MOST_SAMPLES // n_values, 2),
                resample=resample_to,
                note=lambda entry, n_windows: reporter.step(
                    f"{entry.name}: read", f"{n_windows} windows of {length} samples"
                ),
            )

    def in_rows(rig, n_windows):
        # Only recordings of which some windows are missing are read again.
        is_whole = len(rig.data) == rig.available.sum()
        if is_whole and rig.available.min() >= n_windows:
            return join_windows(rig, n_windows)
        length = n_windows * rig.data.shape[-1]
        del rig["data"]
        return cut(length)

    if window_length or hop or max_windows or kind in DIAGNOSERS:
        usual_length = _DETECTOR_LENGTH if kind == "detector" else _WINDOW_LENGTH
        rig = cut(window_length or usual_length)
        return rig, "stretches" if kind == "stretches" else "windows"
    rig = cut(_WINDOW_LENGTH)
    n_windows = _stretch_windows(rig)
    if n_windows is not None:
        return in_rows(rig, n_windows), "stretches"
    if kind == "stretches":
        raise CommandError(
            f"{source}: the shortest recording is too short for two stretches; use "
            "--diagnoser diagnoser"
        )
    if kind == "detector":
        rig = in_rows(rig, _DETECTOR_LENGTH // _WINDOW_LENGTH)
    return rig, "windows"


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
