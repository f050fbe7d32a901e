"""Training rows that `diagnose` would refuse, and speeds that cannot be true."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.speeds import LEAST_REVOLUTIONS, REVOLUTIONS_LEFT
from ...measures.quality import quality_of_outputs
from .messages import CommandError, counted

#: Revolutions that the longest recording at a speed holds at least. Fewer come from a
#: wrong unit.
_FEWEST_REVOLUTIONS = 0.25
#: Recordings that are named in a report.
_MOST_NAMED = 5


def check_speeds_of_recordings(source: Any, rig: Bunch) -> None:
    """Refuse a speed at which no recording holds a quarter of a revolution.

    Parameters
    ----------
    source : path-like
        Named in messages.
    rig : Bunch
        Result of `cut_recordings`.

    Raises
    ------
    CommandError
        If there is such a speed.

    Examples
    --------
    >>> rig = Bunch(rpm=np.array([1.0, 1.0]), start=np.array([0, 500]), sampling_rate=100.0,
    ...             data=np.zeros((2, 500)), recording=np.array(["run", "run"]), profiles={})
    >>> check_speeds_of_recordings("table.csv", rig)
    Traceback (most recent call last):
        ...
    skarxlag...CommandError: table.csv: run: rpm is 1, at which the 10 s of the
    recording are 0.167 revolutions; expected revolutions per minute. If the speed is right, leave
    it out
    """
    if rig.rpm is None:
        return
    ends = (rig.start + rig.data.shape[-1]) / rig.sampling_rate
    rows = pd.DataFrame({"name": rig.recording, "rpm": rig.rpm, "seconds": ends})
    # A run-up may begin at rest.
    stated = rows[~rows["name"].isin(list(rig.profiles))]
    longest = stated.loc[stated.groupby("rpm")["seconds"].idxmax()]
    for name, rpm, seconds in longest.itertuples(index=False):
        n_revolutions = seconds * rpm / 60
        if n_revolutions < _FEWEST_REVOLUTIONS:
            raise CommandError(
                f"{source}: {name}: rpm is {rpm:g}, at which the {seconds:.3g} s of the "
                f"recording are {n_revolutions:.3g} revolutions; expected revolutions "
                "per minute. If the speed is right, leave it out"
            )


def leave_out_silent(
    source: Any, rig: Bunch, rows: str, chosen: NDArray[np.bool_], n_outputs: int
) -> tuple[NDArray[np.bool_], list[str]]:
    """Leave out the rows without a signal, which `diagnose` would refuse.

    Parameters
    ----------
    source : path-like
        Named in messages.
    rig : Bunch
        Result of `cut_recordings`.
    rows : str
        Word for the rows: windows or stretches.
    chosen : ndarray of bool of shape (n_rows,)
        Rows for training.
    n_outputs : int
        Number of the first channels that are outputs.

    Returns
    -------
    chosen : ndarray of bool of shape (n_rows,)
        Rows for training that carry a signal.
    notes : list of str
        A report, if rows are left out.

    Raises
    ------
    CommandError
        If no row of a condition is left.
    """
    # The model refuses more outputs than there are channels.
    n_channels = 1 if rig.data.ndim == 2 else rig.data.shape[1]
    outputs = [f"output {s}" for s in range(1, min(n_outputs, n_channels) + 1)]
    facts = {"sampling_rate": float(rig.sampling_rate), "rpm": rig.rpm}
    quality, _ = quality_of_outputs(rig.data, outputs, **facts)
    silent = chosen & (quality != "good")
    if not silent.any():
        return chosen, []
    left = chosen & ~silent
    for condition in pd.unique(rig.target[chosen]):
        is_of_condition = rig.target == condition
        if not (left & is_of_condition).any():
            reasons = ", ".join(np.unique(quality[silent & is_of_condition]))
            raise CommandError(
                f"{source}: {condition}: no signal ({reasons}); check the sensor, its "
                "cable and the logger"
            )
    reasons = pd.Series(quality[silent])
    counts = reasons.groupby(rig.recording[silent]).value_counts(sort=False)
    named = [f"{count} {reason} in {run}" for (run, reason), count in counts.items()]
    if len(named) > _MOST_NAMED:
        named[_MOST_NAMED:] = [f"{len(named) - _MOST_NAMED} more"]
    n_rows = counted(silent.sum(), rows.removesuffix("s"))
    return left, [f"{n_rows} left out, without a signal: {', '.join(named)}"]


def why_windows(
    rig: Bunch, window_length: int, seconds: float, n_revolutions: float
) -> str:
    """Return the note that recordings are too short for stretches.

    Parameters
    ----------
    rig : Bunch
        Result of `cut_recordings`.
    window_length : int
        Samples in a window.
    seconds, n_revolutions : float
        What two stretches take at least: seconds, or revolutions of the shaft if they
        take longer.

    Examples
    --------
    >>> rig = Bunch(rpm=np.array([100.0]), available=np.array([4]), sampling_rate=1000.0,
    ...             recording=np.array(["run"]))
    >>> why_windows(rig, 500, 1.0, 10)
    'Note: windows, not stretches: the shortest recording takes 2 s, and two stretches 6 s.'
    """
    needed = seconds
    if rig.rpm is not None:
        slowest = pd.Series(rig.rpm).groupby(rig.recording).mean().min()
        needed = max(seconds, 60 * n_revolutions / slowest)
    shortest = rig.available.min() * window_length / rig.sampling_rate
    return (
        "Note: windows, not stretches: the shortest recording takes "
        f"{shortest:.3g} s, and two stretches {needed:.3g} s."
    )


def why_no_orders(
    n_samples: int, sampling_rate: float | None, rpm: float | None
) -> str:
    """Return why the order spectra of a stretch are not compared, or an empty text if they are.

    Examples
    --------
    >>> why_no_orders(6000, 10_000.0, 900.0)
    ''
    >>> why_no_orders(6000, 10_000.0, 150.0)
    'Order spectra are not compared: 0.6 s are 1.5 revolutions at 150 rpm, and it takes 3.'
    """
    if sampling_rate is None or rpm is None:
        return ""
    seconds = n_samples / sampling_rate
    n_revolutions = seconds * rpm / 60
    if not n_revolutions < REVOLUTIONS_LEFT:
        return ""
    return (
        f"Order spectra are not compared: {seconds:.3g} s are {n_revolutions:.3g} "
        f"revolutions at {rpm:g} rpm, and it takes {LEAST_REVOLUTIONS}."
    )
