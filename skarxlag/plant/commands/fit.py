"""Run ``skarxlag fit``: read the recordings, fit the models and save them."""

import argparse
import warnings
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from joblib import parallel_config
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.capabilities import capabilities, requests
from ...core.speeds import LEAST_REVOLUTIONS
from ...decisions.fusion import SensorFusion
from ...diagnosers import make_detector, make_diagnoser, make_known_conditions
from ...persistence.models import save_diagnoser
from ..readers.entries import ListedRecording
from ..readers.rows import speeds_of_samples
from .channels import Channels, fitted_channels, units_of
from .fit_conditions import (
    healthy_condition,
    kind_of,
    recordings_at_speeds,
    rows_at_speeds,
    speeds_of_training,
)
from .fit_rows import REVOLUTIONS, SECONDS, training_rows
from .messages import Reporter, as_command_error, counted, show
from .models import DIAGNOSERS
from .refused_rows import (
    check_speeds_of_recordings,
    leave_out_silent,
    why_no_orders,
    why_windows,
)
from .results import file_name
from .training_facts import (
    facts_of_training,
    false_alarm_events,
    false_alarm_sentence,
)


class TrainingRows(NamedTuple):
    """Rows of the recordings that are used for training.

    Attributes
    ----------
    rig : Bunch
        All rows, as `cut_recordings` returns them, without their samples.
    chosen : ndarray of bool
        Which of them are used.
    X : ndarray of shape (n_rows, ...)
        Samples of those.
    y : ndarray of shape (n_rows,)
        Their conditions.
    metadata : dict
        Their speeds and specimens, by the parameters of `fit`, if they are stated.
    word : str
        Word for the rows: windows or stretches.
    kind : str
        Kind of the diagnoser.
    healthy : str or None
        The healthy condition; None if there is none.
    reason : str
        Why it is that one.
    notes : list of str
        Reports of rows that cannot be used.
    """

    rig: Bunch
    chosen: NDArray[np.bool_]
    X: NDArray[Any]
    y: NDArray[Any]
    metadata: dict[str, Any]
    word: str
    kind: str
    healthy: str | None
    reason: str
    notes: list[str]

    @property
    def slowest(self) -> float | None:
        """Slowest speed; None if none is stated."""
        rpm = self.metadata.get("rpm")
        return None if rpm is None else rpm.min()

    @property
    def seconds(self) -> float:
        """Length of a row."""
        return self.X.shape[-1] / float(self.rig.sampling_rate)


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    lines = fit(
        args.listed,
        args.output,
        source=args.table,
        diagnoser=args.diagnoser,
        bearing=args.bearing,
        healthy=args.healthy,
        train_rpm=args.train_rpm,
        false_alarm_rate=args.false_alarm_rate,
        outputs=args.outputs,
        fixed_gain=args.fixed_gain,
        window_length=args.window_length,
        hop=args.hop,
        max_windows=args.max_windows,
        resample_to=args.resample_to,
        n_jobs=args.n_jobs,
        reporter=Reporter(args.quiet, args.verbose),
    )
    show(*lines)
    return 0


def fit(
    recordings: Sequence[ListedRecording],
    output: Path,
    *,
    source: Any = "recordings",
    diagnoser: str | None = None,
    bearing: str | None = None,
    healthy: str | None = None,
    train_rpm: tuple[float, float] | None = None,
    false_alarm_rate: float = 0.01,
    outputs: int | None = None,
    fixed_gain: bool = False,
    window_length: int | None = None,
    hop: int | None = None,
    max_windows: int | None = None,
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
    source : path-like, default="recordings"
        Named in messages.
    diagnoser, bearing, healthy, false_alarm_rate, outputs, fixed_gain, window_length, \
hop, max_windows, resample_to, n_jobs
        As in ``skarxlag fit``.
    train_rpm : tuple of two floats or None, default=None
        Lowest and highest speed. None: all recordings.
    reporter : Reporter or None, default=None
        Prints the progress. None: nobody.

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
    kind = kind_of(list(recordings), diagnoser, bearing, healthy)
    recordings = recordings_at_speeds(list(recordings), train_rpm)
    rig, word = training_rows(
        recordings,
        source,
        kind=kind,
        window_length=window_length,
        hop=hop,
        max_windows=max_windows,
        resample_to=resample_to,
        reporter=reporter,
    )
    if not any(recording.specimen for recording in recordings):
        rig.specimen = None
    rows = _chosen_rows(rig, word, source, kind, bearing, healthy, train_rpm, outputs)
    reporter.line(f"{len(rows.X)} {rows.word}: fitting")
    with as_command_error(), parallel_config("threading", n_jobs=n_jobs):
        detector = make_detector(
            false_alarm_rate=false_alarm_rate, fixed_gain=fixed_gain
        )
        main = detector
        if rows.kind != "detector":
            main = _diagnoser(rows, bearing, false_alarm_rate)
        models, notes = _fitted(rows, main, detector, outputs)
        # Locations of faults that no recording shows are conditions, too.
        conditions = capabilities(models["diagnoser"]).conditions or [rows.healthy]
        conditions = sorted(conditions, key=lambda name: name != rows.healthy)
        counts = _counts(conditions, rows)
        n_events = _events(rows, detector) if outputs is None else None
        used = {*rows.rig.recording[rows.chosen]}
        save_diagnoser(
            models["diagnoser"],
            output,
            **{name: models[name] for name in models if name != "diagnoser"},
            **fitted_channels(recordings, rows.rig.channels),
            **facts_of_training(each for each in recordings if each.name in used),
            diagnoser=rows.kind,
            rows=rows.word,
            conditions=conditions,
            healthy=rows.healthy,
            train_rpm=speeds_of_training(rows.rig, rows.chosen),
            sampling_rate=float(rows.rig.sampling_rate),
            n_channels=1 if rows.X.ndim == 2 else rows.X.shape[1],
            window_length=rows.X.shape[-1],
            n_windows=counts[rows.word].tolist(),
            n_recordings=counts["recordings"].tolist(),
            false_alarm_rate=false_alarm_rate,
            false_alarm_events=n_events,
            bearing=bearing,
            training_files=sorted(
                file_name(each, each.path.stat().st_size)
                for each in recordings
                if each.name in used
            ),
            saved=datetime.now(UTC).strftime("%Y-%m-%d"),
        )
    has_options = window_length or hop or max_windows or diagnoser in DIAGNOSERS
    return [
        rows.rig.DESCR,
        *rows.notes,
        _size(rows),
        counts.to_string(),
        f"Healthy: {rows.healthy or 'none'} ({rows.reason})",
        *_channel_notes(rows.rig.channels, outputs or 1),
        *dict.fromkeys(notes),
        *_row_notes(rows, has_options),
        *_limit_lines(rows, models, false_alarm_rate, n_events),
        f"Saved {rows.kind} to {output}",
    ]


def _chosen_rows(rig, word, source, kind, bearing, healthy, train_rpm, outputs):
    """Choose the rows that can be used."""
    check_speeds_of_recordings(source, rig)
    kind = kind or ("stretches" if word == "stretches" else "diagnoser")
    chosen = rows_at_speeds(rig, source, train_rpm)
    least_revolutions = LEAST_REVOLUTIONS if word == "stretches" else 0
    speeds, errors = speeds_of_samples(rig, least_revolutions)
    chosen &= errors == ""
    healthy, reason = healthy_condition(rig, chosen, source, kind, bearing, healthy)
    if kind == "detector":
        chosen &= rig.target == healthy
    chosen, notes = leave_out_silent(source, rig, word, chosen, outputs or 1)
    refused = errors[errors != ""]
    if len(refused):
        n_refused = counted(len(refused), word.removesuffix("s"))
        notes = [f"{n_refused} left out: {refused[0]}", *notes]
    # The windows may take half of the memory, so they are not copied without need.
    X = rig.pop("data")
    X = X if chosen.all() else X[chosen]
    metadata = {}
    if speeds is not None:
        metadata["rpm"] = speeds[chosen]
    if rig.specimen is not None:
        metadata["specimen"] = rig.specimen[chosen]
    y = rig.target[chosen]
    return TrainingRows(rig, chosen, X, y, metadata, word, kind, healthy, reason, notes)


def _diagnoser(rows, bearing, false_alarm_rate):
    """Return a diagnoser that is not fitted yet."""
    if rows.kind == "stretches":
        rate = float(rows.rig.sampling_rate)
        model = make_diagnoser(
            sampling_rate=rate, bearing=bearing, healthy=rows.healthy
        )
    else:
        model = DIAGNOSERS[rows.kind][1](healthy=rows.healthy)
    rates = [name for name in model.get_params() if name.endswith("__false_alarm_rate")]
    return model.set_params(**dict.fromkeys(rates, false_alarm_rate))


def _fitted(rows, main, detector, outputs):
    """Return the fitted models by their names in the file, and notes on them."""
    main = _of_outputs(main, outputs)
    if rows.kind == "detector":
        notes = _fit_quietly(main, rows.X, None, rows.metadata)
        return {"diagnoser": main}, notes
    notes = _fit_quietly(main, rows.X, rows.y, rows.metadata)
    models = {"diagnoser": main}
    if len(set(rows.y)) > 1:
        known = _of_outputs(make_known_conditions(), outputs)
        try:
            _fit_quietly(known, rows.X, rows.y, rows.metadata)
            if left_out := sorted(set(rows.y) - set(known.classes_)):
                raise ValueError(
                    f"fewer than two windows at one speed of {', '.join(left_out)}"
                )
            models["known_conditions"] = known
        except ValueError as error:
            notes.append(f"The verdict 'unknown condition' is not possible: {error}")
    if rows.healthy is not None:
        companion = _of_outputs(detector, outputs)
        X, _, metadata = _healthy_rows(rows)
        try:
            notes += _fit_quietly(companion, X, None, metadata)
            models["detector"] = companion
        except ValueError as error:
            notes.append(f"No healthy limits: {error}")
    return models, notes


def _of_outputs(model, outputs):
    """Return a model for a number of outputs."""
    if outputs is None:
        return model
    return SensorFusion(estimator=model, n_outputs=outputs)


def _healthy_rows(rows):
    """Return the healthy rows, their recordings and their metadata."""
    is_healthy = rows.y == rows.healthy
    metadata = {name: values[is_healthy] for name, values in rows.metadata.items()}
    return rows.X[is_healthy], rows.rig.recording[rows.chosen][is_healthy], metadata


def _fit_quietly(model, X, y, metadata):
    """Fit a model with the metadata that it requests; return the messages of its warnings."""
    requested = {
        name: values
        for name, values in metadata.items()
        if requests(model, "fit", name)
    }
    with warnings.catch_warnings(
        record=True, action="always", category=UserWarning
    ) as warned:
        model.fit(X, y, **requested)
    return [f"Note: {warning.message}" for warning in warned]


def _events(rows, detector):
    """Return the false alarms on left-out blocks of the healthy rows; None if they are too few."""
    if rows.healthy is None:
        return None
    X, recording, metadata = _healthy_rows(rows)
    speeds = {name: metadata[name] for name in metadata if name == "rpm"}
    with warnings.catch_warnings(action="ignore"):
        try:
            return false_alarm_events(detector, X, recording, speeds)
        except ValueError:
            return None


def _counts(conditions, rows):
    """Return a table of recordings and rows, and specimens if stated, of each condition."""
    recording = pd.Series(rows.rig.recording[rows.chosen])
    counts = recording.groupby(rows.y).agg(["nunique", "count"])
    counts = counts.reindex(conditions, fill_value=0)
    counts = counts.set_axis(["recordings", rows.word], axis=1)
    if "specimen" in rows.metadata:
        specimen = pd.Series(rows.metadata["specimen"])
        n_specimens = specimen.groupby(rows.y).nunique()
        counts.insert(0, "specimens", n_specimens.reindex(conditions, fill_value=0))
    return counts


def _size(rows):
    """Describe a row in samples, seconds and, if a speed is stated, revolutions."""
    size = (
        f"{rows.word.capitalize()} of {rows.X.shape[-1]} samples, {rows.seconds:.3g} s "
        f"at {float(rows.rig.sampling_rate):g} Hz"
    )
    slowest = rows.slowest
    if slowest is None:
        return size
    n_revolutions = rows.seconds * slowest / 60
    return f"{size}, {n_revolutions:.3g} revolutions at {slowest:g} rpm"


def _row_notes(rows, has_options):
    """Yield why orders are not compared, or why rows are windows."""
    n_samples = rows.X.shape[-1]
    reason = why_no_orders(n_samples, float(rows.rig.sampling_rate), rows.slowest)
    if rows.kind == "stretches" and reason:
        yield f"Note: {reason}"
    if rows.word == "windows" and not has_options:
        yield why_windows(rows.rig, n_samples, SECONDS, REVOLUTIONS)


def _limit_lines(rows, models, false_alarm_rate, n_events):
    """Yield the basis of the healthy limits, and their false alarms."""
    if rows.healthy is None:
        return
    limits = capabilities(models.get("detector", models["diagnoser"])).limits
    yield f"Limits for a false-alarm rate of {false_alarm_rate:g} from {limits}"
    if n_events is not None:
        n_healthy = int((rows.y == rows.healthy).sum())
        yield false_alarm_sentence(
            n_events,
            n_healthy * rows.seconds,
            false_alarm_rate,
            rows.seconds,
            rows.word,
        )


def _channel_notes(channels: Sequence[Channels], n_outputs: int) -> Iterator[str]:
    """Yield which of several channels are outputs, and notes on their units."""
    names = [name for name, _ in channels[0]]
    units = dict(channels[0])
    outputs = names[:n_outputs]
    inputs = names[n_outputs:]
    if len(names) > 1:
        yield f"Outputs: {', '.join(outputs)}. Inputs: {', '.join(inputs) or 'none'}"
        unit = units[outputs[0]]
        alike = [name for name in inputs if unit is not None and units[name] == unit]
        if alike:
            yield (
                f"Note: {', '.join([outputs[0], *alike])} have the unit {unit}. If the "
                "inputs are sensors, use --outputs."
            )
    of_recordings = units_of(channels)
    if len(of_recordings) > 1:
        yield (
            f"Note: the recordings have the units {', '.join(of_recordings)}. They must "
            "be one quantity."
        )
