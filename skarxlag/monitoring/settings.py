"""Checks of what a monitor is told."""

from numbers import Integral
from typing import Any

import numpy as np
from sklearn.utils import check_scalar

from .._validation import check_real


def checked_windowing(
    window_length: int, hop: int | None, sampling_rate: float, gap_tolerance: float | None
) -> dict[str, Any]:
    """Arguments of `WindowStream`, as `ConditionMonitor` is given them."""
    check_scalar(window_length, "window_length", Integral, min_val=1)
    hop = window_length if hop is None else check_scalar(hop, "hop", Integral, min_val=1)
    check_real(sampling_rate, "sampling_rate", min_val=0, include_boundaries="neither")
    if gap_tolerance is None:
        gap_tolerance = 0.5 * window_length / sampling_rate
    check_real(gap_tolerance, "gap_tolerance", min_val=0)
    return {
        "window_length": int(window_length),
        "hop": int(hop),
        "sampling_rate": float(sampling_rate),
        "gap_tolerance": float(gap_tolerance),
    }


def checked_memory(
    half_life: float, false_alarm_interval: float, persistence: float, faulty_rate: float
) -> dict[str, Any]:
    """What sets evidence and alarm, as `ConditionMonitor` is given it."""
    if half_life != np.inf:
        check_real(half_life, "half_life", min_val=0, include_boundaries="neither")
    check_real(
        false_alarm_interval, "false_alarm_interval", min_val=0, include_boundaries="neither"
    )
    check_real(persistence, "persistence", min_val=0, max_val=1, include_boundaries="neither")
    check_real(faulty_rate, "faulty_rate", min_val=0, max_val=1, include_boundaries="neither")
    return {"half_life": float(half_life), "faulty_rate": float(faulty_rate)}


def check_count(value: object, least: int = 0) -> int:
    """Check that a number of a saved state counts something.

    Parameters
    ----------
    value : object
        The number.
    least : int, default=0
        Smallest number that can be.

    Returns
    -------
    int
        The number.

    Raises
    ------
    ValueError
        If it is no integer, or too small, or larger than any count of samples.

    Examples
    --------
    >>> check_count(7)
    7
    """
    if type(value) is not int or not least <= value < 2**62:
        raise ValueError(f"state: {value!r}, expected an integer of at least {least}")
    return value
