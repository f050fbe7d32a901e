"""Run ``skarxlag fit``: read the recordings, fit the models and save them."""

import argparse
import warnings
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pandas as pd
from joblib import parallel_config

from ..core.capabilities import capabilities, requests
from ..core.speeds import LEAST_REVOLUTIONS
from ..diagnosers import make_detector, make_diagnoser, make_known_conditions
from ..persistence.models import save_diagnoser
from ..recordings.rows import speeds_of_samples
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


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    recordings = args.listed
    choose_kind(args, recordings)
    rig, rows = training_rows(args, recordings)
    check_speeds_of_recordings(args.table, rig)
    kind = args.diagnoser or ("stretches" if rows == "stretches" else "diagnoser")
    chosen = rows_at_speeds(args, rig)
    least_revolutions = LEAST_REVOLUTIONS if rows == "stretches" else 0
    speeds, errors = speeds_of_samples(rig, least_revolutions)
    chosen &= errors == ""
    healthy, reason = healthy_condition(args, kind, rig, chosen)
    if kind == "detector":
        chosen &= rig.target == healthy
    n_outputs = args.outputs or 1
    chosen, left_out = leave_out_silent(args.table, rig, rows, chosen, n_outputs)
    # The windows may take half of the memory, so they are not copied without need.
    X = rig.pop("data")
    X = X if chosen.all() else X[chosen]
    y = rig.target[chosen]
    rpm = None if speeds is None else speeds[chosen]
    has_specimens = any(recording.specimen for recording in recordings)
    specimen = rig.specimen[chosen] if has_specimens else None
    metadata = {"rpm": rpm, "specimen": specimen}
    rate = float(rig.sampling_rate)
    report_progress(args, f"{len(X)} {rows}: fitting")
    with as_command_error(), parallel_config("threading", n_jobs=args.n_jobs):
        diagnoser = of_outputs(args, _make(args, kind, healthy, rate))
        if kind == "detector":
            notes = _fit_quietly(diagnoser, X, None, metadata)
            companions = {}
        else:
            notes = _fit_quietly(diagnoser, X, y, metadata)
            companions = _companions(args, X, y, metadata, healthy, notes)
        # Locations of faults that no recording shows are conditions, too.
        conditions = sorted(
            capabilities(diagnoser).conditions or [healthy],
            key=lambda name: name != healthy,
        )
        counts = _counts(conditions, y, rig.recording[chosen], specimen, rows)
        save_diagnoser(
            diagnoser,
            args.output,
            **companions,
            **fitted_channels(recordings, rig.channels),
            diagnoser=kind,
            rows=rows,
            conditions=conditions,
            healthy=healthy,
            train_rpm=training_speeds(rig, chosen),
            sampling_rate=rate,
            n_channels=1 if X.ndim == 2 else X.shape[1],
            window_length=X.shape[-1],
            n_windows=counts[rows].tolist(),
            n_recordings=counts["recordings"].tolist(),
            false_alarm_rate=args.false_alarm_rate,
            bearing=args.bearing,
            saved=datetime.now(UTC).strftime("%Y-%m-%d"),
        )
    slowest = None if rpm is None else rpm.min()
    if kind == "stretches" and (why := why_no_orders(X.shape[-1], rate, slowest)):
        notes.append(f"Note: {why}")
    if rows == "windows" and not cuts_windows(args):
        notes.append(why_windows(rig, X.shape[-1], SECONDS, REVOLUTIONS))
    print(rig.DESCR)
    if (errors != "").any():
        n_refused = counted(np.sum(errors != ""), rows.removesuffix("s"))
        print(f"{n_refused} left out: {errors[errors != ''][0]}")
    print(*left_out, _size(X.shape[-1], rows, rate, slowest), sep="\n")
    print(counts.to_string())
    notes = [*_roles(rig.channels[0], n_outputs), *_units(rig.channels), *notes]
    print(f"Healthy: {healthy or 'none'} ({reason})", *notes, sep="\n")
    if healthy is not None:
        basis = limits_basis(companions.get("detector", diagnoser), rows)
        print(
            f"Limits for a false-alarm rate of {args.false_alarm_rate:g} from {basis}"
        )
    print(f"Saved {kind} to {args.output}")
    return 0


def _counts(conditions, y, recording, specimen, rows):
    """Return a table of recordings and rows, and specimens if stated, of each condition."""
    counts = pd.Series(recording).groupby(y).agg(["nunique", "count"])
    counts = counts.reindex(conditions, fill_value=0)
    counts = counts.set_axis(["recordings", rows], axis=1)
    if specimen is not None:
        n_specimens = pd.Series(specimen).groupby(y).nunique()
        counts.insert(0, "specimens", n_specimens.reindex(conditions, fill_value=0))
    return counts


def _size(n_samples, rows, rate, slowest):
    """Describe a row in samples, seconds and, if a speed is stated, revolutions."""
    seconds = n_samples / rate
    size = f"{rows.capitalize()} of {n_samples} samples, {seconds:.3g} s at {rate:g} Hz"
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


def _companions(args, X, y, metadata, healthy, notes):
    """Return the fitted known conditions and healthy limits; the notes say why one is missing."""
    companions: dict[str, Any] = {}
    if len(set(y)) > 1:
        model = of_outputs(args, make_known_conditions())
        try:
            _fit_quietly(model, X, y, metadata)
            if left_out := sorted(set(y) - set(model.classes_)):
                raise ValueError(
                    f"fewer than two windows at one speed of {', '.join(left_out)}"
                )
            companions["known_conditions"] = model
        except ValueError as error:
            notes.append(f"The verdict 'unknown condition' is not possible: {error}")
    if healthy is not None:
        model = of_outputs(args, _make(args, "detector"))
        is_healthy = y == healthy
        of_healthy = {
            name: None if values is None else values[is_healthy]
            for name, values in metadata.items()
        }
        try:
            _fit_quietly(model, X[is_healthy], None, of_healthy)
            companions["detector"] = model
        except ValueError as error:
            notes.append(f"No healthy limits: {error}")
    return companions
