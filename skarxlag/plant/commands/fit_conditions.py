"""Conditions of ``skarxlag fit``: the training speeds, and the healthy condition."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.fault_locations import HEALTHY, location_of_label
from ...kernels.speed_references import group_speeds
from ..readers.entries import ListedRecording
from .messages import CommandError, UsageError, listed


def kind_of(
    recordings: list[ListedRecording],
    kind: str | None,
    bearing: str | None,
    healthy: str | None,
) -> str | None:
    """Return the kind of diagnoser if it is stated, or the bearing or the conditions determine it.

    Raises
    ------
    UsageError
        If another kind is stated next to a bearing.
    """
    present = {recording.condition for recording in recordings}
    only = present.pop() if len(present) == 1 else None
    is_healthy = only == healthy
    if healthy is None:
        is_healthy = location_of_label(only) == HEALTHY
    if bearing is not None:
        kind = kind or "stretches"
        if kind != "stretches":
            raise UsageError(
                "argument --bearing: belongs to --diagnoser stretches, not to --diagnoser "
                f"{kind}"
            )
    elif kind is None and only is not None and is_healthy:
        kind = "detector"
    return kind


def recordings_at_speeds(
    recordings: list[ListedRecording], train_rpm: tuple[float, float] | None
) -> list[ListedRecording]:
    """Leave out recordings with a stated speed outside a range, before they are read."""
    low, high = train_rpm or (0.0, np.inf)
    near = [
        recording
        for recording in recordings
        if recording.rpm is None or low <= recording.rpm <= high
    ]
    return near or recordings


def rows_at_speeds(
    rig: Bunch, source: Any, train_rpm: tuple[float, float] | None
) -> NDArray[np.bool_]:
    """Return which rows are within a range of speeds."""
    if train_rpm is None:
        return np.ones(len(rig.recording), dtype=bool)
    low, high = train_rpm
    rpm = np.full(len(rig.recording), np.nan) if rig.rpm is None else rig.rpm
    chosen = (rpm >= low) & (rpm <= high)
    if not chosen.any():
        stated = "no column rpm" if rig.rpm is None else listed(np.unique(rpm))
        raise UsageError(
            f"argument --train-rpm: {low:g} to {high:g} holds no speed of "
            f"{source}: {stated}"
        )
    return chosen


def speeds_of_training(rig: Bunch, chosen: NDArray[np.bool_]) -> list[float] | None:
    """Return the speeds of the chosen rows; those of varying speed are grouped."""
    if rig.rpm is None:
        return None
    rpm = np.unique(rig.rpm[chosen])
    if rig.profiles:
        rpm = np.exp(group_speeds(np.log(rpm))[0]).round(1)
    return rpm.tolist()


def healthy_condition(
    rig: Bunch,
    chosen: NDArray[np.bool_],
    source: Any,
    kind: str,
    bearing: str | None,
    healthy: str | None,
) -> tuple[str | None, str]:
    """Return the healthy condition, or None if there is none, and why it is that one.

    If the recordings state no condition, all become healthy.
    """
    if bearing is not None and rig.rpm is None:
        raise CommandError(
            f"{source}: no speed is stated; expected a column rpm, or --rpm"
        )
    present = [name for name in rig.target_names if name in rig.target[chosen]]
    if len(present) < 2 and kind != "detector" and bearing is None:
        raise CommandError(
            f"{source}: conditions {', '.join(present) or 'not stated'}; expected "
            "two or more, by a column condition or --pattern; with healthy recordings "
            "only, use --diagnoser detector"
        )
    if rig.target is None:
        rig.target = np.full(len(rig.recording), HEALTHY)
        present = [HEALTHY]
    named_healthy = [name for name in present if location_of_label(name) == HEALTHY]
    if healthy in present:
        return healthy, "--healthy"
    if healthy == "none" and kind != "detector":
        return None, "--healthy"
    if healthy is None and len(present) == 1:
        return present[0], "the only condition"
    if healthy is None and len(named_healthy) == 1:
        return named_healthy[0], "by its name; --healthy names another"
    problem = "needed, because the names do not show it"
    if healthy:
        problem = repr(healthy)
    none = "" if kind == "detector" else "; or --healthy none"
    raise UsageError(
        f"argument --healthy: {problem}, expected a condition of {source}: "
        f"{', '.join(present)}{none}"
    )
