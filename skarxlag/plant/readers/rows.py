"""Rows of several windows, and their speeds."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.speeds import speed_errors
from .cutting import mean_speeds

#: Share by which the speed of a row varies before order tracking is needed. In rows of
#: a second or two, combs at the mean speed are lost from 1 to 2 % on.
_LEAST_CHANGE = 0.005
#: Entries that have a value for each row.
_OF_ROWS = ("target", "specimen", "load", "rpm", "recording", "start")


def join_windows(rig: Bunch, n_windows: int) -> Bunch:
    """Join consecutive windows of recordings to rows, as if they had been cut in rows.

    Parameters
    ----------
    rig : Bunch
        Result of `cut_recordings` that holds all windows of each recording, without a
        hop. Its data are overwritten.
    n_windows : int
        Windows in a row. The last windows of a recording that do not fill a row are
        left out.

    Returns
    -------
    Bunch
        The rows, as `cut_recordings` returns them.

    Examples
    --------
    >>> rig = Bunch(data=np.arange(10.0).reshape(5, 2), start=np.array([0, 2, 4, 0, 2]), rpm=None,
    ...             recording=np.array(["a", "a", "a", "b", "b"]), available=np.array([3, 2]))
    >>> rows = join_windows(rig, 2)
    >>> rows.data.tolist(), rows.start.tolist(), rows.recording.tolist(), rows.available.tolist()
    ([[0.0, 1.0, 2.0, 3.0], [6.0, 7.0, 8.0, 9.0]], [0, 0], ['a', 'b'], [1, 1])
    """
    n_old, *n_channels, window_length = rig.data.shape
    position = rig.start // window_length
    n_of_recording = np.repeat(rig.available, rig.available)
    is_whole = position + n_windows <= n_of_recording
    first = np.flatnonzero((position % n_windows == 0) & is_whole)
    windows = rig.data.reshape(n_old, -1)
    for row, start in enumerate(first):
        # Memory would hold all windows twice, were they not moved within it.
        joined = np.moveaxis(rig.data[start : start + n_windows], 0, -2)
        place = row * n_windows
        windows[place : place + n_windows] = joined.reshape(n_windows, -1)
    data = windows[: len(first) * n_windows].reshape(len(first), *n_channels, -1)
    rows = Bunch(**rig | {"data": data, "available": rig.available // n_windows})
    for name in {*_OF_ROWS} & rig.keys():
        rows[name] = None if rig[name] is None else rig[name][first]
    for name, profile in rig.get("profiles", {}).items():
        is_of_recording = rows.recording == name
        rows.rpm[is_of_recording] = mean_speeds(
            profile, rows.start[is_of_recording], data.shape[-1], rig.sampling_rate
        )
    return rows


def speeds_of_samples(
    rig: Bunch, least_revolutions: float = 0
) -> tuple[NDArray[Any] | None, NDArray[Any]]:
    """Return the speed of each row, or at each sample if it varies within a row.

    Parameters
    ----------
    rig : Bunch
        Result of `cut_recordings`.
    least_revolutions : float, default=0
        Revolutions of the shaft that a row needs.

    Returns
    -------
    rpm : ndarray of shape (n_rows,) or (n_rows, n_samples), or None
        Two-dimensional if the speed of a row varies by more than 0.5 %.
    errors : ndarray of str of shape (n_rows,)
        Why a row cannot be used: there is no speed above 0, it varies too much, or the
        row has too few revolutions.
    """
    n_rows = len(rig.data)
    n_samples = rig.data.shape[-1]
    if not rig.profiles:
        return rig.rpm, np.full(n_rows, "", dtype=object)
    rpm = np.repeat(rig.rpm[:, np.newaxis], n_samples, axis=1)
    for name, profile in rig.profiles.items():
        is_of_recording = rig.recording == name
        rpm[is_of_recording] = profile.rows(
            rig.start[is_of_recording], n_samples, rig.sampling_rate
        )
    errors = speed_errors(rpm, n_rows)
    is_short = n_samples * rpm.mean(axis=1) < least_revolutions * 60 * rig.sampling_rate
    errors[(errors == "") & is_short] = (
        f"the row has less than {least_revolutions} revolutions"
    )
    varies = np.ptp(rpm, axis=1) > _LEAST_CHANGE * rig.rpm
    return rpm if varies.any() else rig.rpm, errors
