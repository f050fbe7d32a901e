"""Run ``skarxlag fit``: read the recordings, fit the models and save them."""

import argparse
import warnings
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from joblib import parallel_config

from ...core.capabilities import capabilities, requests
from ...core.fault_locations import HEALTHY, location_of_label
from ...decisions.fusion import SensorFusion
from ...diagnosers import make_detector, make_diagnoser, make_known_conditions
from ...kernels.speed_references import group_speeds
from ...persistence.files import write_atomically
from ...persistence.models import packed_diagnoser
from ..readers.entries import ListedRecording
from .error_rates import ErrorRates
from .messages import (
    CommandError,
    Reporter,
    UsageError,
    as_command_error,
    keywords,
    show,
)
from .remarks import why_no_orders
from .results import file_name
from .training_facts import Channels, facts_of_training, units_of
from .training_rows import training_rows


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
    diagnoser = _kind(recordings, diagnoser, bearing, healthy)
    rows = training_rows(
        recordings,
        table,
        kind=diagnoser,
        window_length=window_length,
        resample_to=resample_to,
        reporter=reporter,
    )
    kind = diagnoser or ("stretches" if rows.word == "stretches" else "diagnoser")
    if bearing is not None and rows.speeds is None:
        raise CommandError(
            f"{table}: no speed is stated; expected a column rpm, or --rpm"
        )
    may_be_one = kind == "detector" or bearing is not None
    if "condition" not in rows.facts and may_be_one:
        rows.facts["condition"] = HEALTHY
    healthy, reason = _healthy_condition(rows, table, kind, healthy, may_be_one)
    if kind == "detector":
        rows = rows.where(rows.y == healthy)
    rows = rows.with_signal(table, outputs or 1)
    reporter.line(f"{len(rows.X)} {rows.word}: fitting")
    rates = None
    with as_command_error(), parallel_config("threading", n_jobs=n_jobs):
        detector = make_detector(
            false_alarm_rate=false_alarm_rate, fixed_gain=fixed_gain
        )
        main = detector
        if kind != "detector":
            main = _diagnoser(rows, kind, bearing, healthy, false_alarm_rate)
        models, notes = _fitted(rows, main, detector, healthy, outputs)
        if outputs is None and healthy is not None:
            rates = ErrorRates.measured(detector, rows, healthy)
        fitted = models.pop("diagnoser")
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
            "error_counts": None if rates is None else list(rates),
            "bearing": bearing,
            "saved": datetime.now(UTC).strftime("%Y-%m-%d"),
        }
        # The output is resolved and checked; a link that was made since is replaced.
        content = packed_diagnoser(fitted, models, facts)
        write_atomically(output, content, follows_links=False)
    lines = [
        *rows.notes,
        _size(rows),
        counts.to_string(),
        f"Healthy: {healthy or 'none'} ({reason})",
        *_channel_notes(rows.channels, outputs or 1),
        *dict.fromkeys(notes),
    ]
    slowest = None if rows.speeds is None else rows.speeds.min()
    too_short = why_no_orders(rows.X.shape[-1], rows.sampling_rate, slowest)
    if kind == "stretches" and too_short:
        lines.append(f"Note: {too_short}")
    if healthy is not None:
        limits = capabilities(models.get("detector", fitted)).limits
        lines.append(
            f"Limits for a false-alarm rate of {false_alarm_rate:g} from {limits}"
        )
    if rates is not None:
        lines += rates.sentences(false_alarm_rate, rows.seconds, rows.word)
    return [*lines, f"Saved {kind} to {output}"]


def _kind(recordings, kind, bearing, healthy):
    """Return the kind of diagnoser if it is stated, or the recordings determine it."""
    if bearing is not None:
        if kind not in (None, "stretches"):
            raise UsageError(
                "argument --bearing: belongs to --diagnoser stretches, not to "
                f"--diagnoser {kind}"
            )
        return "stretches"
    only, *others = {recording.condition for recording in recordings}
    if kind is not None or others or only is None:
        return kind
    is_healthy = only == healthy
    if healthy is None:
        is_healthy = location_of_label(only) == HEALTHY
    return "detector" if is_healthy else None


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
        "training_files": sorted(
            file_name(each, each.path.stat().st_size) for each in used
        ),
    }


def _healthy_condition(rows, source, kind, healthy, may_be_one):
    """Return the healthy condition, or None if there is none, and why it is that one."""
    present = []
    if "condition" in rows.facts:
        present = rows.facts["condition"].unique().tolist()
    if len(present) < 2 and not may_be_one:
        raise CommandError(
            f"{source}: conditions {', '.join(present) or 'not stated'}; expected "
            "two or more, by a column condition or --pattern; with healthy recordings "
            "only, use --diagnoser detector"
        )
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


def _diagnoser(rows, kind, bearing, healthy, false_alarm_rate):
    """Return a diagnoser that is not fitted yet."""
    rate = rows.sampling_rate if kind == "stretches" else None
    model = make_diagnoser(sampling_rate=rate, bearing=bearing, healthy=healthy)
    rates = [name for name in model.get_params() if name.endswith("__false_alarm_rate")]
    return model.set_params(**dict.fromkeys(rates, false_alarm_rate))


def _fitted(rows, main, detector, healthy, outputs):
    """Return the fitted models by their names in the file, and notes on them."""
    models: dict[str, Any] = {}

    def fit(name, model, rows, y):
        """Fit a model with the metadata that it requests, and return its warnings."""
        if outputs is not None:
            model = SensorFusion(estimator=model, n_outputs=outputs)
        requested = {
            key: values
            for key, values in rows.metadata.items()
            if requests(model, "fit", key)
        }
        with warnings.catch_warnings(
            record=True, action="always", category=UserWarning
        ) as warned:
            models[name] = model.fit(rows.X, y, **requested)
        return [f"Note: {warning.message}" for warning in warned]

    if main is detector:
        return models, fit("diagnoser", main, rows, None)
    notes = fit("diagnoser", main, rows, rows.y)
    if len(set(rows.y)) > 1:
        try:
            fit("known_conditions", make_known_conditions(), rows, rows.y)
            known = models["known_conditions"].classes_
            if left_out := sorted(set(rows.y) - set(known)):
                del models["known_conditions"]
                raise ValueError(
                    f"fewer than two windows at one speed of {', '.join(left_out)}"
                )
        except ValueError as error:
            notes.append(f"The verdict 'unknown condition' is not possible: {error}")
    if healthy is not None:
        try:
            notes += fit("detector", detector, rows.where(rows.y == healthy), None)
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


def _size(rows):
    """Describe a row in samples, seconds and, if a speed is stated, revolutions."""
    size = (
        f"{rows.word.capitalize()} of {rows.X.shape[-1]} samples, {rows.seconds:.3g} s "
        f"at {rows.sampling_rate:g} Hz"
    )
    if rows.speeds is None:
        return size
    slowest = rows.speeds.min()
    n_revolutions = rows.seconds * slowest / 60
    return f"{size}, {n_revolutions:.3g} revolutions at {slowest:g} rpm"


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
