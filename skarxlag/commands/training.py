"""Training data of ``fit``: windows or stretches of recordings, no more than memory holds."""

import argparse
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import Bunch

from .._answers import answers
from ..diagnosers import make_detector, make_known_conditions
from ..recordings.listing import ListedRecording
from ..recordings.rig import cut_recordings
from .info import calibration_basis
from .messages import CommandError, Progress, as_command_error
from .models import set_threads

DETECTOR = "detector"
STRETCHES = "stretches"
#: Places by the orders of the bearing.
ORDERS = "orders"
_OF_STRETCHES = (STRETCHES, ORDERS)
#: Samples in a window; stretches consist of such windows.
_WINDOW_LENGTH = 1200
#: Samples in a row that the detector takes.
_DETECTOR_LENGTH = 4800
#: Samples of a channel that the windows of all recordings hold together, unless --max-windows says
#: otherwise: a quarter of a GiB, and three times as much while a diagnoser is fitted.
MOST_SAMPLES = 2**25
#: Seconds in a stretch, and turns of the shaft that it holds at least.
_SECONDS, _TURNS = 1.0, 10
#: Stretches that the shortest recording holds at least; where stretches are shorter than they could
#: be, it holds this many.
_FEWEST, _ENOUGH = 2, 4


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
    if is_cut or kind not in (None, DETECTOR, *_OF_STRETCHES):
        default = _DETECTOR_LENGTH if kind == DETECTOR else _WINDOW_LENGTH
        rig = _cut(args, listed, args.window_length or default)
        return rig, kind or "diagnoser", STRETCHES if kind in _OF_STRETCHES else "windows"
    rig = _cut(args, listed, _WINDOW_LENGTH)
    n_windows = stretch_windows(rig)
    if n_windows is not None:
        if rig.available.sum() == len(rig.data):
            return join_windows(rig, n_windows), kind or STRETCHES, STRETCHES
        # Windows that were left out cannot be joined.
        del rig["data"]
        return _cut(args, listed, n_windows * _WINDOW_LENGTH), kind or STRETCHES, STRETCHES
    if kind in _OF_STRETCHES:
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
            resample=args.resample_to,
            note=lambda entry, n_windows: progress.step(
                f"{entry.name}: read", f"{n_windows} windows of {window_length} samples"
            ),
        )
    if args.max_windows is None and rig.available.sum() > len(rig.data):
        rig.DESCR += " (which keeps memory small; --max-windows states another number)"
    return rig


def stretch_windows(rig: Bunch) -> int | None:
    """Windows that make up a stretch.

    A stretch takes a second, or ten turns of the slowest shaft where these take longer. Where a
    recording would hold less than four such stretches, a stretch takes a quarter of the shortest
    recording, but not less than half of that.

    Parameters
    ----------
    rig : Bunch
        Of `load_recordings`.

    Returns
    -------
    int or None
        None if the recordings are too short.

    Examples
    --------
    >>> rig = Bunch(data=np.zeros((12, 500)), available=np.array([12, 40]), rpm=None,
    ...             sampling_rate=1_000.0)
    >>> stretch_windows(rig)
    2
    >>> rig.rpm = np.full(12, 300.0)
    >>> stretch_windows(rig)
    3
    >>> rig.rpm = np.full(12, 50.0)
    >>> stretch_windows(rig)
    """
    length = rig.data.shape[-1]
    seconds = _SECONDS
    if rig.rpm is not None:
        seconds = max(seconds, 60 * _TURNS / rig.rpm.min())
    wanted = seconds * rig.sampling_rate / length
    shortest = rig.available.min()
    n_windows = int(np.ceil(min(wanted, max(shortest // _ENOUGH, wanted / 2))))
    return n_windows if shortest >= _FEWEST * n_windows else None


def join_windows(rig: Bunch, n_windows: int) -> Bunch:
    """Join consecutive windows of each recording to stretches.

    Parameters
    ----------
    rig : Bunch
        Of `load_recordings`.
    n_windows : int
        Windows in a stretch. Those at the end of a recording that fill no stretch are left out.

    Returns
    -------
    Bunch
        The same rig, with stretches for rows.

    Examples
    --------
    >>> rig = Bunch(data=np.arange(10).reshape(5, 2), recording=np.array(list("aaabb")),
    ...             start=np.array([0, 2, 4, 0, 2]), target=None, rpm=None)
    >>> joined = join_windows(rig, 2)
    >>> joined.data.tolist(), joined.recording.tolist()
    ([[0, 1, 2, 3], [6, 7, 8, 9]], ['a', 'b'])
    """
    groups = []
    for name in np.unique(rig.recording):
        rows = np.flatnonzero(rig.recording == name)
        rows = rows[np.argsort(rig.start[rows])]
        groups.append(rows[: len(rows) // n_windows * n_windows].reshape(-1, n_windows))
    groups = np.concatenate(groups)
    groups = groups[np.argsort(groups[:, 0])]
    joined = np.concatenate([rig.data[column] for column in groups.T], axis=-1)
    per_row = {
        name: value[groups[:, 0]]
        for name, value in rig.items()
        if name != "data" and isinstance(value, np.ndarray) and len(value) == len(rig.data)
    }
    return Bunch(**rig | per_row | {"data": joined})


def fit_quietly(
    model: Any,
    X: NDArray[Any],
    y: NDArray[Any] | None,
    rpm: NDArray[Any] | None,
    args: argparse.Namespace,
) -> list[str]:
    """Fit a model with the threads of ``--n-jobs``, and return the messages of its warnings."""
    set_threads(model, args.n_jobs)
    speeds = {} if rpm is None else {"rpm": rpm}
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always", UserWarning)
        model.fit(X, y, **speeds)
    # The number of threads belongs to this machine, not to the file.
    set_threads(model, None)
    return [str(warning.message) for warning in warned]


def fit_known_conditions(
    X: NDArray[Any], y: NDArray[Any], rpm: NDArray[Any] | None, args: argparse.Namespace
) -> tuple[Any, str]:
    """Fit the known conditions on the rows of a diagnoser.

    Returns
    -------
    known : Pipeline or None
        None if there are too few rows.
    line : str
        Message to the user.
    """
    known = make_known_conditions()
    try:
        fit_quietly(known, X, y, rpm, args)
    except ValueError as error:
        return None, f"The verdict 'none of these' is not possible: {error}"
    left_out = sorted(set(y) - set(known[-1].classes_))
    if left_out:
        return None, (
            "The verdict 'none of these' is not possible: fewer than two windows at one speed of "
            f"{', '.join(left_out)}"
        )
    fewest = min(np.unique(y, return_counts=True)[1])
    at = "of unknown speed" if rpm is None else "at other speeds"
    return known, (
        f"The verdict is 'none of these' if the p-value of the nearest condition is below "
        f"{answers(known).stated_rate:g}, from {fewest} rows a condition or more. Recordings {at} "
        "are rarely rejected"
    )


def fit_healthy_limits(
    X: NDArray[Any], is_healthy: NDArray[Any], rpm: NDArray[Any] | None, args: argparse.Namespace
) -> tuple[Any, str]:
    """Fit a detector on the healthy rows of a diagnoser.

    Returns
    -------
    detector : Pipeline or None
        None if there are too few rows; then the detection threshold of the diagnoser counts.
    line : str
        Message to the user.
    """
    detector = make_detector(false_alarm_rate=args.false_alarm_rate)
    try:
        fit_quietly(detector, X[is_healthy], None, None if rpm is None else rpm[is_healthy], args)
    except ValueError as error:
        return None, f"No healthy limits: {error}"
    return detector, (
        f"Limits for a false-alarm rate of {args.false_alarm_rate:g} from "
        f"{calibration_basis(detector[-1], 'windows')}"
    )
