"""Run ``skarxlag fit``: read the recordings, fit the models and save them."""

import argparse
import warnings
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from joblib import parallel_config
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.capabilities import capabilities, requests
from ...core.speeds import LEAST_REVOLUTIONS
from ...diagnosers import make_detector, make_diagnoser, make_known_conditions
from ...persistence.models import save_diagnoser
from ..readers.rows import speeds_of_samples
from .channels import Channels, fitted_channels, units_of
from .fit_conditions import (
    choose_kind,
    healthy_condition,
    rows_at_speeds,
    training_speeds,
)
from .fit_rows import REVOLUTIONS, SECONDS, cuts_windows, training_rows
from .info import limits_basis
from .messages import as_command_error, counted, report_progress
from .models import DIAGNOSERS, of_outputs
from .refused_rows import (
    check_speeds_of_recordings,
    leave_out_silent,
    why_no_orders,
    why_windows,
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
        Their speeds and specimens, by the parameters of `fit`; None if not stated.
    word : str
        Word for the rows: windows or stretches.
    kind : str
        Kind of the diagnoser.
    healthy : str or None
        The healthy condition; None if there is none.
    reason : str
        Why it is that one.
    left_out : list of str
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
    left_out: list[str]

    @property
    def slowest(self) -> float | None:
        """Slowest speed; None if none is stated."""
        rpm = self.metadata["rpm"]
        return None if rpm is None else rpm.min()


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    choose_kind(args, args.listed)
    rows = _training_rows(args)
    report_progress(args, f"{len(rows.X)} {rows.word}: fitting")
    rate = float(rows.rig.sampling_rate)
    with as_command_error(), parallel_config("threading", n_jobs=args.n_jobs):
        models, notes = _fitted(args, rows, rate)
        # Locations of faults that no recording shows are conditions, too.
        conditions = capabilities(models["diagnoser"]).conditions or [rows.healthy]
        conditions = sorted(conditions, key=lambda name: name != rows.healthy)
        counts = _counts(conditions, rows)
        _save(args, models, rows, conditions, counts)
    n_samples = rows.X.shape[-1]
    reason = why_no_orders(n_samples, rate, rows.slowest)
    if rows.kind == "stretches" and reason:
        notes.append(f"Note: {reason}")
    if rows.word == "windows" and not cuts_windows(args):
        notes.append(why_windows(rows.rig, n_samples, SECONDS, REVOLUTIONS))
    print(rows.rig.DESCR, *rows.left_out, _size(rows, rate), sep="\n")
    print(counts.to_string())
    channels = rows.rig.channels
    notes = [*_roles(channels[0], args.outputs or 1), *_units(channels), *notes]
    print(f"Healthy: {rows.healthy or 'none'} ({rows.reason})", *notes, sep="\n")
    if rows.healthy is not None:
        limiting = models.get("detector", models["diagnoser"])
        print(
            f"Limits for a false-alarm rate of {args.false_alarm_rate:g} from "
            f"{limits_basis(limiting, rows.word)}"
        )
    print(f"Saved {rows.kind} to {args.output}")
    return 0


def _training_rows(args):
    """Read the recordings, and choose the rows that can be used."""
    rig, word = training_rows(args, args.listed)
    check_speeds_of_recordings(args.table, rig)
    kind = args.diagnoser or ("stretches" if word == "stretches" else "diagnoser")
    chosen = rows_at_speeds(args, rig)
    least_revolutions = LEAST_REVOLUTIONS if word == "stretches" else 0
    speeds, errors = speeds_of_samples(rig, least_revolutions)
    chosen &= errors == ""
    healthy, reason = healthy_condition(args, kind, rig, chosen)
    if kind == "detector":
        chosen &= rig.target == healthy
    chosen, left_out = leave_out_silent(
        args.table, rig, word, chosen, args.outputs or 1
    )
    refused = errors[errors != ""]
    if len(refused):
        n_refused = counted(len(refused), word.removesuffix("s"))
        left_out = [f"{n_refused} left out: {refused[0]}", *left_out]
    # The windows may take half of the memory, so they are not copied without need.
    X = rig.pop("data")
    X = X if chosen.all() else X[chosen]
    has_specimens = any(recording.specimen for recording in args.listed)
    metadata = {
        "rpm": None if speeds is None else speeds[chosen],
        "specimen": rig.specimen[chosen] if has_specimens else None,
    }
    y = rig.target[chosen]
    return TrainingRows(
        rig, chosen, X, y, metadata, word, kind, healthy, reason, left_out
    )


def _fitted(args, rows, rate):
    """Return the fitted models by their names in the file, and notes on them."""
    diagnoser = of_outputs(args, _make(args, rows.kind, rows.healthy, rate))
    if rows.kind == "detector":
        notes = _fit_quietly(diagnoser, rows.X, None, rows.metadata)
        return {"diagnoser": diagnoser}, notes
    notes = _fit_quietly(diagnoser, rows.X, rows.y, rows.metadata)
    models = {"diagnoser": diagnoser}
    if len(set(rows.y)) > 1:
        model = of_outputs(args, make_known_conditions())
        try:
            _fit_quietly(model, rows.X, rows.y, rows.metadata)
            if left_out := sorted(set(rows.y) - set(model.classes_)):
                raise ValueError(
                    f"fewer than two windows at one speed of {', '.join(left_out)}"
                )
            models["known_conditions"] = model
        except ValueError as error:
            notes.append(f"The verdict 'unknown condition' is not possible: {error}")
    if rows.healthy is not None:
        model = of_outputs(args, _make(args, "detector"))
        is_healthy = rows.y == rows.healthy
        of_healthy = {
            name: None if values is None else values[is_healthy]
            for name, values in rows.metadata.items()
        }
        try:
            _fit_quietly(model, rows.X[is_healthy], None, of_healthy)
            models["detector"] = model
        except ValueError as error:
            notes.append(f"No healthy limits: {error}")
    return models, notes


def _save(args, models, rows, conditions, counts):
    """Save the models with the facts that the commands use."""
    companions = {name: models[name] for name in models if name != "diagnoser"}
    save_diagnoser(
        models["diagnoser"],
        args.output,
        **companions,
        **fitted_channels(args.listed, rows.rig.channels),
        diagnoser=rows.kind,
        rows=rows.word,
        conditions=conditions,
        healthy=rows.healthy,
        train_rpm=training_speeds(rows.rig, rows.chosen),
        sampling_rate=float(rows.rig.sampling_rate),
        n_channels=1 if rows.X.ndim == 2 else rows.X.shape[1],
        window_length=rows.X.shape[-1],
        n_windows=counts[rows.word].tolist(),
        n_recordings=counts["recordings"].tolist(),
        false_alarm_rate=args.false_alarm_rate,
        bearing=args.bearing,
        saved=datetime.now(UTC).strftime("%Y-%m-%d"),
    )


def _counts(conditions, rows):
    """Return a table of recordings and rows, and specimens if stated, of each condition."""
    recording = pd.Series(rows.rig.recording[rows.chosen])
    counts = recording.groupby(rows.y).agg(["nunique", "count"])
    counts = counts.reindex(conditions, fill_value=0)
    counts = counts.set_axis(["recordings", rows.word], axis=1)
    specimen = rows.metadata["specimen"]
    if specimen is not None:
        n_specimens = pd.Series(specimen).groupby(rows.y).nunique()
        counts.insert(0, "specimens", n_specimens.reindex(conditions, fill_value=0))
    return counts


def _size(rows, rate):
    """Describe a row in samples, seconds and, if a speed is stated, revolutions."""
    n_samples = rows.X.shape[-1]
    seconds = n_samples / rate
    size = f"{rows.word.capitalize()} of {n_samples} samples, {seconds:.3g} s at {rate:g} Hz"
    slowest = rows.slowest
    if slowest is None:
        return size
    return f"{size}, {seconds * slowest / 60:.3g} revolutions at {slowest:g} rpm"


def _roles(channels: Channels, n_outputs: int) -> Iterator[str]:
    """Yield which of several channels are outputs, and a note on inputs of the same unit."""
    if len(channels) < 2:
        return
    names = [name for name, _ in channels]
    units = dict(channels)
    outputs = names[:n_outputs]
    inputs = names[n_outputs:]
    yield f"Outputs: {', '.join(outputs)}. Inputs: {', '.join(inputs) or 'none'}"
    unit = units[outputs[0]]
    alike = [name for name in inputs if unit is not None and units[name] == unit]
    if alike:
        yield (
            f"Note: {', '.join([outputs[0], *alike])} have the unit {unit}. If the "
            "inputs are sensors, use --outputs."
        )


def _units(channels):
    """Yield a note on recordings of different units."""
    units = units_of(channels)
    if len(units) > 1:
        yield (
            f"Note: the recordings have the units {', '.join(units)}. They must be one "
            "quantity."
        )


def _make(args, kind, healthy=None, rate=None):
    """Return a diagnoser that is not fitted yet."""
    if kind == "detector":
        return make_detector(
            false_alarm_rate=args.false_alarm_rate, fixed_gain=args.fixed_gain
        )
    if kind == "stretches":
        model = make_diagnoser(
            sampling_rate=rate, bearing=args.bearing, healthy=healthy
        )
    else:
        model = DIAGNOSERS[kind][1](healthy=healthy)
    rates = [name for name in model.get_params() if name.endswith("__false_alarm_rate")]
    return model.set_params(**dict.fromkeys(rates, args.false_alarm_rate))


def _fit_quietly(model, X, y, metadata):
    """Fit a model with the metadata that it requests; return the messages of its warnings."""
    requested = {
        name: values
        for name, values in metadata.items()
        if values is not None and requests(model, "fit", name)
    }
    with warnings.catch_warnings(
        record=True, action="always", category=UserWarning
    ) as warned:
        model.fit(X, y, **requested)
    return [f"Note: {warning.message}" for warning in warned]
