"""Conditions of ``skarxlag fit``: the training speeds, and the healthy condition."""

import argparse

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.fault_locations import HEALTHY, location_of_label
from ...kernels.speed_references import group_speeds
from ..readers.entries import ListedRecording
from .arguments import refuse
from .messages import CommandError, UsageError, listed


def choose_kind(args: argparse.Namespace, recordings: list[ListedRecording]) -> None:
    """Set the kind of diagnoser if the bearing or the conditions determine it."""
    present = {recording.condition for recording in recordings}
    only = present.pop() if len(present) == 1 else None
    is_healthy = only == args.healthy
    if args.healthy is None:
        is_healthy = location_of_label(only) == HEALTHY
    if args.bearing is not None:
        args.diagnoser = args.diagnoser or "stretches"
    elif args.diagnoser is None and only is not None and is_healthy:
        args.diagnoser = "detector"
    if args.diagnoser != "stretches":
        refuse(args, ["bearing"], "belongs to --diagnoser stretches")


def rows_at_speeds(args: argparse.Namespace, rig: Bunch) -> NDArray[np.bool_]:
    """Return which rows are within the range of --train-rpm."""
    if args.train_rpm is None:
        return np.ones(len(rig.recording), dtype=bool)
    low, high = args.train_rpm
    rpm = np.full(len(rig.recording), np.nan) if rig.rpm is None else rig.rpm
    chosen = (rpm >= low) & (rpm <= high)
    if not chosen.any():
        stated = "no column rpm" if rig.rpm is None else listed(np.unique(rpm))
        raise UsageError(
            f"argument --train-rpm: {low:g} to {high:g} holds no speed of "
            f"{args.table}: {stated}"
        )
    return chosen


def training_speeds(rig: Bunch, chosen: NDArray[np.bool_]) -> list[float] | None:
    """Return the speeds of the chosen rows; those of varying speed are grouped."""
    if rig.rpm is None:
        return None
    rpm = np.unique(rig.rpm[chosen])
    if rig.profiles:
        rpm = np.exp(group_speeds(np.log(rpm))[0]).round(1)
    return rpm.tolist()


def healthy_condition(
    args: argparse.Namespace, kind: str, rig: Bunch, chosen: NDArray[np.bool_]
) -> tuple[str | None, str]:
    """Return the healthy condition, or None if there is none, and why it is that one.

    If the recordings state no condition, all become healthy.
    """
    if args.bearing is not None and rig.rpm is None:
        raise CommandError(
            f"{args.table}: no speed is stated; expected a column rpm, or --rpm"
        )
    present = [name for name in rig.target_names if name in rig.target[chosen]]
    if len(present) < 2 and kind != "detector" and args.bearing is None:
        raise CommandError(
            f"{args.table}: conditions {', '.join(present) or 'not stated'}; expected "
            "two or more, by a column condition or --pattern; with healthy recordings "
            "only, use --diagnoser detector"
        )
    if rig.target is None:
        rig.target = np.full(len(rig.recording), HEALTHY)
        present = [HEALTHY]
    named_healthy = [name for name in present if location_of_label(name) == HEALTHY]
    if args.healthy in present:
        return args.healthy, "--healthy"
    if args.healthy == "none" and kind != "detector":
        return None, "--healthy"
    if args.healthy is None and len(present) == 1:
        return present[0], "the only condition"
    if args.healthy is None and len(named_healthy) == 1:
        return named_healthy[0], "by its name; --healthy names another"
    problem = "needed, because the names do not show it"
    if args.healthy:
        problem = repr(args.healthy)
    none = "" if kind == "detector" else "; or --healthy none"
    raise UsageError(
        f"argument --healthy: {problem}, expected a condition of {args.table}: "
        f"{', '.join(present)}{none}"
    )
