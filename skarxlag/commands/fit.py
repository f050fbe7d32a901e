"""Run ``skarxlag fit``: read the recordings, fit the models and save them."""

import argparse
import warnings
from datetime import UTC, datetime

import numpy as np
import pandas as pd
from joblib import parallel_config
from sklearn.utils import Bunch

from ..core.capabilities import capabilities, requests
from ..core.fault_locations import HEALTHY, location_of_label
from ..core.speeds import LEAST_REVOLUTIONS
from ..diagnosers import make_detector, make_diagnoser, make_known_conditions
from ..kernels.speed_references import group_speeds
from ..persistence.models import save_diagnoser
from ..recordings.files import list_channels
from ..recordings.formats._contents import choose_channels
from ..recordings.rig import cut_recordings, join_windows, speeds_of_samples
from . import messages
from .arguments import refuse
from .channels import fitted_channels, units_of
from .info import limits_basis
from .messages import CommandError, UsageError, as_command_error, report_progress
from .models import DIAGNOSERS, of_outputs
from .refused_rows import (
    check_speeds_of_recordings,
    leave_out_silent,
    why_no_orders,
    why_windows,
)

#: Samples of a channel that the windows of all recordings hold together, unless
#: --max-windows says otherwise: a quarter of a GiB. The fits of companions copy the
#: healthy ones.
MOST_SAMPLES = 2**25
#: Samples in a window, of which stretches consist, and in a window of a detector.
_WINDOW_LENGTH, _DETECTOR_LENGTH = 1200, 4800
#: Seconds in a stretch, and turns of the shaft that it holds at least.
_SECONDS, _REVOLUTIONS = 1.0, 10
#: Stretches that the shortest recording holds at least, and those that are enough.
_FEWEST, _ENOUGH = 2, 4


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    recordings = args.listed
    _check_options(args, recordings)
    rig, rows = _training_rows(args, recordings)
    check_speeds_of_recordings(args.table, rig)
    kind = args.diagnoser or ("stretches" if rows == "stretches" else "diagnoser")
    chosen = _choose_speed(args, rig)
    speeds, errors = speeds_of_samples(
        rig, LEAST_REVOLUTIONS if rows == "stretches" else 0
    )
    chosen &= errors == ""
    healthy, reason = _healthy_condition(args, kind, rig, chosen)
    if kind == "detector":
        chosen &= rig.target == healthy
    chosen, left_out = leave_out_silent(
        args.table, rig, rows, chosen, args.outputs or 1
    )
    # The windows may take half of the memory, so they are not copied without need.
    X = rig.pop("data")
    X = X if chosen.all() else X[chosen]
    y, rpm = rig.target[chosen], None if speeds is None else speeds[chosen]
    is_stated = any(recording.specimen for recording in recordings)
    specimen = rig.specimen[chosen] if is_stated else None
    params = {"rpm": rpm, "specimen": specimen}
    rate = float(rig.sampling_rate)
    report_progress(args, f"{len(X)} {rows}: fitting")
    with as_command_error(), parallel_config("threading", n_jobs=args.n_jobs):
        diagnoser = of_outputs(args, _make(args, kind, healthy, rate))
        notes = _fit_quietly(diagnoser, X, None if kind == "detector" else y, params)
        companions = (
            {}
            if kind == "detector"
            else _companions(args, X, y, params, healthy, notes)
        )
        # Places of faults that no recording shows are conditions, too.
        conditions = sorted(
            capabilities(diagnoser).conditions or [healthy], key=lambda c: c != healthy
        )
        counts = pd.Series(rig.recording[chosen]).groupby(y).agg(["nunique", "count"])
        counts = counts.reindex(conditions, fill_value=0).set_axis(
            ["recordings", rows], axis=1
        )
        if specimen is not None:
            specimens = pd.Series(specimen).groupby(y).nunique()
            counts.insert(0, "specimens", specimens.reindex(conditions, fill_value=0))
        facts = {
            "diagnoser": kind,
            "rows": rows,
            "conditions": conditions,
            "healthy": healthy,
        }
        facts |= {"train_rpm": _training_speeds(rig, chosen), "sampling_rate": rate}
        facts |= {
            "n_channels": 1 if X.ndim == 2 else X.shape[1],
            "window_length": X.shape[-1],
        }
        facts |= fitted_channels(recordings) | {"n_windows": counts[rows].tolist()}
        facts["n_recordings"] = counts["recordings"].tolist()
        facts |= {"false_alarm_rate": args.false_alarm_rate, "bearing": args.bearing}
        facts["saved"] = datetime.now(UTC).strftime("%Y-%m-%d")
        save_diagnoser(diagnoser, args.output, **companions, **facts)
    seconds = X.shape[-1] / rate
    turns = (
        ""
        if rpm is None
        else f", {seconds * rpm.min() / 60:.3g} turns at {rpm.min():g} rpm"
    )
    print(rig.DESCR)
    if (errors != "").any():
        print(f"{np.sum(errors != '')} {rows} left out: {errors[errors != ''][0]}")
    print(*left_out, sep="\n", end="\n" * len(left_out))
    print(
        f"{rows.capitalize()} of {X.shape[-1]} samples, {seconds:.3g} s at {rate:g} Hz{turns}"
    )
    print(counts.to_string())
    slowest = None if rpm is None else rpm.min()
    if kind == "stretches" and (reason := why_no_orders(X.shape[-1], rate, slowest)):
        notes.append(f"Note: {reason}")
    is_asked = (
        args.window_length
        or args.hop
        or args.max_windows
        or args.diagnoser in DIAGNOSERS
    )
    if rows == "windows" and not is_asked:
        notes.append(why_windows(rig, X.shape[-1], _SECONDS, _REVOLUTIONS))
    notes = [*_roles(recordings[0], args.outputs or 1), *_units(recordings), *notes]
    print(f"Healthy: {healthy or 'none'} ({reason})", *notes, sep="\n")
    if healthy is not None:
        basis = limits_basis(companions.get("detector", diagnoser), rows)
        print(
            f"Limits for a false-alarm rate of {args.false_alarm_rate:g} from {basis}"
        )
    print(f"Saved {kind} to {args.output}")
    return 0


def _training_rows(args, listed):
    """Return the rows of recordings as a rig, and whether they are windows or stretches."""
    kind, length = args.diagnoser, args.window_length or _WINDOW_LENGTH
    is_cut = args.window_length or args.hop or args.max_windows or kind in DIAGNOSERS
    if kind == "detector" and is_cut:
        length = args.window_length or _DETECTOR_LENGTH
    rig = _cut(args, listed, length)
    if is_cut:
        return rig, "stretches" if kind == "stretches" else "windows"
    n_windows = _stretch_windows(rig)
    if n_windows is not None:
        return _in_rows(args, listed, rig, n_windows), "stretches"
    if kind == "stretches":
        problem = "the shortest recording is too short for two stretches"
        raise CommandError(f"{args.table}: {problem}; use --diagnoser diagnoser")
    if kind == "detector":
        rig = _in_rows(args, listed, rig, _DETECTOR_LENGTH // length)
    return rig, "windows"


def _in_rows(args, listed, rig, n_windows):
    """Return rows of several windows. Only recordings of which some are missing are read again."""
    if len(rig.data) == rig.available.sum() and rig.available.min() >= n_windows:
        return join_windows(rig, n_windows)
    length = n_windows * rig.data.shape[-1]
    del rig["data"]
    return _cut(args, listed, length)


def _cut(args, listed, window_length):
    n_values = window_length * np.size(listed[0].channel) * len(listed)
    most = args.max_windows or max(MOST_SAMPLES // n_values, 2)
    progress = messages.Progress(len(listed), args)

    def note(entry, n_windows):
        progress.step(
            f"{entry.name}: read", f"{n_windows} windows of {window_length} samples"
        )

    options = {
        "hop": args.hop,
        "max_windows": most,
        "resample": args.resample_to,
        "note": note,
    }
    with as_command_error():
        return cut_recordings(listed, args.table, window_length, **options)


def _stretch_windows(rig: Bunch) -> int | None:
    """Return the number of windows in a stretch, or None if the recordings are too short.

    A stretch takes a second, or ten turns at the slowest mean speed if they take
    longer. If one would hold less than four such stretches, a stretch takes a quarter
    of the shortest recording, but not less than half of that.

    >>> rig = Bunch(data=np.zeros((12, 500)), available=np.array([12, 40]), rpm=None,
    ...             sampling_rate=1_000.0, recording=np.repeat("run", 12))
    >>> _stretch_windows(rig)
    2
    >>> rig.rpm = np.full(12, 300.0)
    >>> _stretch_windows(rig)
    3
    >>> rig.rpm = np.full(12, 50.0)
    >>> _stretch_windows(rig)
    """
    seconds = _SECONDS
    if rig.rpm is not None:
        # A run-up may begin at rest.
        slowest = pd.Series(rig.rpm).groupby(rig.recording).mean().min()
        seconds = max(_SECONDS, 60 * _REVOLUTIONS / slowest)
    wanted = seconds * rig.sampling_rate / rig.data.shape[-1]
    shortest = rig.available.min()
    n_windows = int(np.ceil(min(wanted, max(shortest // _ENOUGH, wanted / 2))))
    return n_windows if shortest >= _FEWEST * n_windows else None


def _roles(recording, n_outputs):
    """Yield which of several channels are outputs, and a note on inputs of the same unit."""
    if not isinstance(recording.channel, list) or len(recording.channel) < 2:
        return
    units = list_channels(recording.path, dtype=recording.dtype).set_index("channel")[
        "unit"
    ]
    names = choose_channels(list(units.index), recording.channel)
    outputs, inputs = names[:n_outputs], names[n_outputs:]
    yield f"Outputs: {', '.join(outputs)}. Inputs: {', '.join(inputs) or 'none'}"
    unit = units[outputs[0]]
    if alike := [name for name in inputs if unit is not None and units[name] == unit]:
        names = ", ".join([outputs[0], *alike])
        yield f"Note: {names} have the unit {unit}. If the inputs are sensors, use --outputs."


def _units(recordings):
    """Yield a note on recordings of different units."""
    units = units_of(recordings)
    if len(units) > 1:
        yield f"Note: the recordings have the units {', '.join(units)}. They must be one quantity."


def _check_options(args, recordings):
    present = {recording.condition for recording in recordings}
    only = present.pop() if len(present) == 1 else None
    is_healthy = (
        location_of_label(only) == HEALTHY
        if args.healthy is None
        else only == args.healthy
    )
    if args.bearing is not None:
        args.diagnoser = args.diagnoser or "stretches"
    elif args.diagnoser is None and only is not None and is_healthy:
        args.diagnoser = "detector"
    if args.diagnoser != "stretches":
        refuse(args, ["bearing"], "belongs to --diagnoser stretches")


def _make(args, kind, healthy=None, rate=None):
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


def _fit_quietly(model, X, y, params):
    """Fit a model with the metadata that it requests; return the messages of its warnings."""
    given = {name: value for name, value in params.items() if value is not None}
    requested = {name: given[name] for name in given if requests(model, "fit", name)}
    with warnings.catch_warnings(
        record=True, action="always", category=UserWarning
    ) as warned:
        model.fit(X, y, **requested)
    return [f"Note: {warning.message}" for warning in warned]


def _companions(args, X, y, params, healthy, notes):
    """Return the fitted known conditions and healthy limits; the notes say why one is missing."""
    fitted, wanted = {}, {}
    if len(set(y)) > 1:
        without = "The verdict 'unknown condition' is not possible"
        wanted["known_conditions"] = (make_known_conditions(), slice(None), y, without)
    if healthy is not None:
        wanted["detector"] = (
            _make(args, "detector"),
            y == healthy,
            None,
            "No healthy limits",
        )
    for name, (model, rows, labels, without) in wanted.items():
        model = of_outputs(args, model)
        try:
            of_rows = {
                name: None if value is None else value[rows]
                for name, value in params.items()
            }
            _fit_quietly(model, X[rows], labels, of_rows)
            left_out = (
                [] if labels is None else sorted(set(labels) - set(model.classes_))
            )
            if left_out:
                raise ValueError(
                    f"fewer than two windows at one speed of {', '.join(left_out)}"
                )
            fitted[name] = model
        except ValueError as error:
            notes.append(f"{without}: {error}")
    return fitted


def _choose_speed(args, rig):
    if args.train_rpm is None:
        return np.ones(len(rig.recording), dtype=bool)
    low, high = args.train_rpm
    rpm = np.full(len(rig.recording), np.nan) if rig.rpm is None else rig.rpm
    chosen = (rpm >= low) & (rpm <= high)
    if not chosen.any():
        stated = "no column rpm" if rig.rpm is None else messages.listed(np.unique(rpm))
        problem = f"{low:g} to {high:g} holds no speed of {args.table}: {stated}"
        raise UsageError(f"argument --train-rpm: {problem}")
    return chosen


def _training_speeds(rig, chosen):
    """Return the speeds of the chosen rows; those of varying speed are grouped."""
    if rig.rpm is None:
        return None
    rpm = np.unique(rig.rpm[chosen])
    return (
        np.exp(group_speeds(np.log(rpm))[0]).round(1).tolist()
        if rig.profiles
        else rpm.tolist()
    )


def _healthy_condition(args, kind, rig, chosen):
    """Return the healthy condition, or None if there is none, and why it is that one."""
    if args.bearing is not None and rig.rpm is None:
        raise CommandError(
            f"{args.table}: no speed is stated; expected a column rpm, or --rpm"
        )
    present = [n for n in rig.target_names if n in rig.target[chosen]]
    if len(present) < 2 and kind != "detector" and args.bearing is None:
        expected = "expected two or more, by a column condition or --pattern"
        alone = "with healthy recordings only, use --diagnoser detector"
        found = ", ".join(present) or "not stated"
        raise CommandError(f"{args.table}: conditions {found}; {expected}; {alone}")
    if rig.target is None:
        rig.target, present = np.full(len(rig.recording), HEALTHY), [HEALTHY]
    named = [name for name in present if location_of_label(name) == HEALTHY]
    if args.healthy in present:
        return args.healthy, "--healthy"
    if args.healthy == "none" and kind != "detector":
        return None, "--healthy"
    if args.healthy is None and len(present) == 1:
        return present[0], "the only condition"
    if args.healthy is None and len(named) == 1:
        return named[0], "by its name; --healthy names another"
    problem = (
        repr(args.healthy)
        if args.healthy
        else "needed, because the names do not show it"
    )
    none = "" if kind == "detector" else "; or --healthy none"
    expected = f"a condition of {args.table}: {', '.join(present)}{none}"
    raise UsageError(f"argument --healthy: {problem}, expected {expected}")
