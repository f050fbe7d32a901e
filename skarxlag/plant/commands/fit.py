"""Run ``skarxlag fit``: read the recordings, fit the models and save them."""

import argparse
import warnings
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from joblib import parallel_config
from sklearn.base import clone

from ...core.capabilities import capabilities, requests
from ...core.fault_locations import HEALTHY, location_of_label
from ...decisions.fusion import SensorFusion
from ...diagnosers import make_detector, make_diagnoser, make_known_conditions
from ...kernels.speed_references import group_speeds
from ...persistence.files import write_atomically
from ...persistence.models import packed_diagnoser
from ..readers.entries import ListedRecording
from .messages import (
    CommandError,
    Reporter,
    UsageError,
    as_command_error,
    keywords,
    show,
)
from .remarks import why_no_orders
from .training_facts import Channels, facts_of_training, units_of
from .training_rows import TrainingRows, training_rows

#: Parts of a recording, of which each is left out once.
_N_BLOCKS = 5


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    show(*fit(**keywords(fit, args)))
    return 0


def fit(
    recordings: Sequence[ListedRecording],
    output: Path,
    *,
    table: Any = "recordings",
    diagnoser: str | None = None,
    bearing: str | None = None,
    healthy: str | None = None,
    false_alarm_rate: float = 0.01,
    outputs: int | None = None,
    fixed_gain: bool = False,
    window_length: int | None = None,
    resample_to: float | None = None,
    n_jobs: int | None = None,
    reporter: Reporter | None = None,
) -> list[str]:
    """Fit a diagnoser with its healthy limits and known conditions, and save them.

    Parameters
    ----------
    recordings : sequence of ListedRecording
        The recordings.
    output : Path
        The saved model.
    table : path-like, default="recordings"
        Named in messages.
    diagnoser, bearing, healthy, false_alarm_rate, outputs, fixed_gain, window_length, \
resample_to, n_jobs
        As in ``skarxlag fit``.
    reporter : Reporter or None, default=None
        Progress reporter. None prints nothing.

    Returns
    -------
    list of str
        What was fitted, in lines for a person.

    Raises
    ------
    CommandError, UsageError
        If the recordings cannot be read or used.
    """
    reporter = reporter or Reporter()
    kind = _kind(recordings, diagnoser, bearing, healthy)
    rows = training_rows(
        recordings,
        table,
        kind=kind,
        window_length=window_length,
        resample_to=resample_to,
        reporter=reporter,
    )
    kind = kind or ("stretches" if rows.word == "stretches" else "diagnoser")
    if bearing is not None and rows.speeds is None:
        raise CommandError(
            f"{table}: no speed is stated; expected a column rpm, or --rpm"
        )
    may_be_one = kind == "detector" or bearing is not None
    if "condition" not in rows.facts and may_be_one:
        rows.facts["condition"] = HEALTHY
    healthy = _healthy_condition(rows, table, kind, healthy, may_be_one)
    if kind == "detector":
        rows = rows.where(rows.y == healthy)
    rows = rows.with_signal(table, outputs or 1)
    reporter.line(f"{len(rows.X)} {rows.word}: fitting")
    detector = make_detector(false_alarm_rate=false_alarm_rate, fixed_gain=fixed_gain)
    with as_command_error(), parallel_config("threading", n_jobs=n_jobs):
        rates = []
        if healthy is not None and outputs is None:
            rates = error_rates(detector, rows, healthy)
        if outputs is not None:
            detector = SensorFusion(estimator=detector, n_outputs=outputs)
        if kind == "detector":
            notes = _fit(detector, rows)
            fitted, models = detector, {}
        else:
            fitted = _diagnoser(rows, kind, bearing, healthy, false_alarm_rate)
            if outputs is not None:
                fitted = SensorFusion(estimator=fitted, n_outputs=outputs)
            notes = _fit(fitted, rows, rows.y)
            models, further = _companions(rows, detector, healthy, outputs)
            notes += further
        # Locations of faults that no recording shows are conditions, too.
        conditions = capabilities(fitted).conditions or [healthy]
        conditions = sorted(conditions, key=lambda name: name != healthy)
        counts = _counts(conditions, rows)
        facts = _facts(recordings, rows, counts)
        facts |= {
            "diagnoser": kind,
            "conditions": conditions,
            "healthy": healthy,
            "false_alarm_rate": false_alarm_rate,
            "error_rates": rates,
            "bearing": bearing,
            "saved": datetime.now(UTC).strftime("%Y-%m-%d"),
        }
        # The output is resolved and checked; a link that was made since is replaced.
        content = packed_diagnoser(fitted, models, facts)
        write_atomically(output, content, follows_links=False)
    if healthy is not None:
        limits = capabilities(models.get("detector", fitted)).limits
        rates.insert(
            0, f"Limits for a false-alarm rate of {false_alarm_rate:g} from {limits}"
        )
    return [
        *rows.notes,
        *_size(rows, kind),
        counts.to_string(),
        f"Healthy: {healthy or 'none'}",
        *_channel_notes(rows.channels, outputs or 1),
        *dict.fromkeys(notes),
        *rates,
        f"Saved {kind} to {output}",
    ]


def error_rates(detector: Any, rows: TrainingRows, healthy: Any) -> list[str]:
    """Describe the errors of healthy limits on rows that did not set them.

    Parameters
    ----------
    detector : estimator
        Not fitted.
    rows : TrainingRows
        The rows, in the order of time.
    healthy : label
        The healthy condition. A fifth of each of its recordings is left out at a time.

    Returns
    -------
    list of str
        Sentences; none if the healthy rows are too few.
    """
    of_healthy = rows.where(rows.y == healthy)
    faulty = rows.where(rows.y != healthy)
    recording = of_healthy.facts["recording"]
    order = recording.groupby(recording).cumcount()
    block = order * _N_BLOCKS // recording.groupby(recording).transform("size")
    n_alarms = 0
    try:
        for left_out in block.unique():
            test = (block == left_out).to_numpy()
            exceeds = _exceeds(
                detector, of_healthy.where(~test), of_healthy.where(test)
            )
            n_alarms += int(exceeds.sum())
        sentences = [
            f"False alarms: {n_alarms} of {len(block)} healthy {rows.word} exceed limits "
            "that were learned without this part of their recordings."
        ]
        if len(faulty.X):
            n_missed = int((~_exceeds(detector, of_healthy, faulty)).sum())
            sentences.append(
                f"Missed faults: {n_missed} of {len(faulty.X)} {rows.word} of recorded "
                "faults are within the healthy limits."
            )
        return sentences
    except ValueError:
        return []


def _exceeds(detector, train, test):
    """Return which rows exceed the limits that a detector learns from others."""
    speeds = [
        {} if each.speeds is None else {"rpm": each.speeds} for each in (train, test)
    ]
    with warnings.catch_warnings(action="ignore"):
        fitted = clone(detector).fit(train.X, **speeds[0])
        return fitted.predict(test.X, **speeds[1]) == -1


def _kind(recordings, kind, bearing, healthy):
    """Return the kind of diagnoser if it is stated, or the recordings determine it."""
    if bearing is not None:
        return "stretches"
    only, *others = {recording.condition for recording in recordings}
    if kind is not None or others or only is None:
        return kind
    is_healthy = only == healthy or (healthy is None and _is_healthy(only))
    return "detector" if is_healthy else None


def _is_healthy(name):
    return location_of_label(name) == HEALTHY


def _facts(recordings, rows, counts):
    """Return facts of the training that are saved with the model."""
    names = set(rows.facts["recording"])
    pairs = zip(recordings, rows.channels, strict=True)
    used, channels = zip(
        *(each for each in pairs if each[0].name in names), strict=True
    )
    rpm = None
    if rows.speeds is not None:
        rpm = np.unique(rows.facts["rpm"])
        if "mean_rpm" in rows.facts:
            rpm = np.exp(group_speeds(np.log(rpm))[0]).round(1)
        rpm = rpm.tolist()
    return {
        **facts_of_training(used, channels),
        "rows": rows.word,
        "train_rpm": rpm,
        "sampling_rate": rows.sampling_rate,
        "n_channels": 1 if rows.X.ndim == 2 else rows.X.shape[1],
        "window_length": rows.X.shape[-1],
        "n_windows": counts[rows.word].tolist(),
        "n_recordings": counts["recordings"].tolist(),
    }


def _healthy_condition(rows, source, kind, healthy, may_be_one):
    """Return the healthy condition, or None if there is none."""
    present = []
    if "condition" in rows.facts:
        present = rows.facts["condition"].unique().tolist()
    if len(present) < 2 and not may_be_one:
        raise CommandError(
            f"{source}: conditions {', '.join(present) or 'not stated'}; expected "
            "two or more, by a column condition or --pattern; with healthy recordings "
            "only, use --diagnoser detector"
        )
    if healthy in present:
        return healthy
    if healthy == "none" and kind != "detector":
        return None
    candidates = present if len(present) == 1 else [*filter(_is_healthy, present)]
    if healthy is None and len(candidates) == 1:
        return candidates[0]
    none = "" if kind == "detector" else "; or --healthy none"
    raise UsageError(
        f"argument --healthy: {healthy or 'needed'}, expected a condition of {source}: "
        f"{', '.join(present)}{none}"
    )


def _diagnoser(rows, kind, bearing, healthy, false_alarm_rate):
    """Return a diagnoser that is not fitted yet."""
    rate = rows.sampling_rate if kind == "stretches" else None
    model = make_diagnoser(sampling_rate=rate, bearing=bearing, healthy=healthy)
    rates = [name for name in model.get_params() if name.endswith("__false_alarm_rate")]
    return model.set_params(**dict.fromkeys(rates, false_alarm_rate))


def _fit(model, rows, y=None):
    """Fit a model with the metadata that it requests, and return its warnings."""
    requested = {
        key: values
        for key, values in rows.metadata.items()
        if requests(model, "fit", key)
    }
    with warnings.catch_warnings(
        record=True, action="always", category=UserWarning
    ) as warned:
        model.fit(rows.X, y, **requested)
    return [f"Note: {warning.message}" for warning in warned]


def _companions(rows, detector, healthy, outputs):
    """Return the fitted models that are saved next to a diagnoser, and notes on them."""
    models = {}
    notes = []
    if len(set(rows.y)) > 1:
        known = make_known_conditions()
        if outputs is not None:
            known = SensorFusion(estimator=known, n_outputs=outputs)
        try:
            _fit(known, rows, rows.y)
            if left_out := sorted(set(rows.y) - set(known.classes_)):
                raise ValueError(
                    f"fewer than two windows at one speed of {', '.join(left_out)}"
                )
            models["known_conditions"] = known
        except ValueError as error:
            notes.append(f"The verdict 'unknown condition' is not possible: {error}")
    if healthy is not None:
        try:
            notes += _fit(detector, rows.where(rows.y == healthy))
            models["detector"] = detector
        except ValueError as error:
            notes.append(f"No healthy limits: {error}")
    return models, notes


def _counts(conditions, rows):
    """Return a table of recordings and rows, and specimens if stated, of each condition."""
    of_condition = rows.facts.groupby(rows.y)
    counts = of_condition["recording"].agg(["nunique", "count"])
    counts = counts.set_axis(["recordings", rows.word], axis=1)
    if "specimen" in rows.facts:
        counts.insert(0, "specimens", of_condition["specimen"].nunique())
    return counts.reindex(conditions, fill_value=0)


def _size(rows, kind):
    """Yield the size of a row, and why the orders of a stretch are not compared."""
    size = (
        f"{rows.word.capitalize()} of {rows.X.shape[-1]} samples, {rows.seconds:.3g} s "
        f"at {rows.sampling_rate:g} Hz"
    )
    slowest = None if rows.speeds is None else rows.speeds.min()
    if slowest is not None:
        n_revolutions = rows.seconds * slowest / 60
        size = f"{size}, {n_revolutions:.3g} revolutions at {slowest:g} rpm"
    yield size
    reason = why_no_orders(rows.X.shape[-1], rows.sampling_rate, slowest)
    if kind == "stretches" and reason:
        yield f"Note: {reason}"


def _channel_notes(channels: Sequence[Channels], n_outputs: int) -> Iterator[str]:
    """Yield which of several channels are outputs, and that units differ."""
    names = [name for name, _ in channels[0]]
    if len(names) > 1:
        inputs = ", ".join(names[n_outputs:]) or "none"
        yield f"Outputs: {', '.join(names[:n_outputs])}. Inputs: {inputs}"
    units = units_of(channels)
    if len(units) > 1:
        yield (
            f"Note: the recordings have the units {', '.join(units)}. They must be one "
            "quantity."
        )
