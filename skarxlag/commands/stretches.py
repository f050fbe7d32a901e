"""How long the rows are that `fit` calibrates on: stretches of several turns, or windows."""

import numpy as np
from sklearn.utils import Bunch

#: Seconds in a stretch, and turns of the shaft that it holds at least.
_SECONDS, _TURNS = 1.0, 10
#: Stretches that the shortest recording holds at least; where stretches are shorter than they could
#: be, it holds this many.
_FEWEST, _ENOUGH = 2, 4


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
