"""Calibrate a diagnoser on the recordings that a table lists, and save it.

The table is a csv file with the columns path, condition, rpm, sampling_rate and channel. Only path
is always needed, see skarxlag.read_recording_table. The detector needs healthy recordings only,
best of several speeds, and names no fault.
"""

import argparse
import warnings
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
from joblib import parallel_config

from .. import diagnosers
from .._answers import answers, requests
from ..fault_places import HEALTHY, place_of_label
from ..kernels.speed_references import group_speeds
from ..persistence import save_diagnoser
from ..recordings.files import list_channels
from ..recordings.formats._contents import choose_channels
from ..recordings.rig import speeds_of_samples
from ..speeds import LEAST_TURNS
from ..verdicts import check_condition_names
from . import arguments
from .arguments import flag, option, refuse
from .info import limits_basis
from .messages import (
    CommandError,
    UsageError,
    add_progress_arguments,
    as_command_error,
    counted,
    report_progress,
    require,
)
from .models import DIAGNOSERS, is_model_file, of_outputs
from .results import check_output
from .training import training_rows


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = __doc__
    parser.add_argument("table", type=Path, help="csv table of the recordings, a folder, or a glob")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.skops")
    text = "healthy condition, or none if no recording is healthy; default: the only condition "
    text += "that is called healthy, normal, good, ok, intact, nominal, baseline, n or h"
    option(parser, "--healthy", text, metavar="LABEL")
    text = "recordings to use: 1797, 1797+-30, 1797+-2%% or 1700..1800; default: all"
    option(parser, "--train-rpm", text, arguments.speed_range, "RPM")
    text = "share of healthy windows that may raise an alarm; default: 0.01"
    option(parser, "--false-alarm-rate", text, arguments.rate, "SHARE")
    option(parser, "--n-jobs", "number of threads; default: all cores", arguments.job_count)
    parser.set_defaults(false_alarm_rate=0.01, n_jobs=-1, run=run, fail=parser.error)
    add_progress_arguments(parser)
    arguments.add_source_arguments(parser, "a folder or glob")
    model = parser.add_argument_group("model")
    text = "default: stretches if the recordings are long enough and none of the options that cut "
    text += "windows is given, else diagnoser; detector if the only condition is healthy"
    kinds = [*DIAGNOSERS, "stretches", "detector"]
    model.add_argument("--diagnoser", choices=kinds, help=text)
    text = "name places of faults by the orders of this bearing: with recordings of faults, orders "
    text += "and spectra make one verdict; without, healthy recordings set the limits. A name such "
    text += "as 6205, dimensions 9,7.94,39.04, or orders outer=3.585,inner=5.415"
    option(model, "--bearing", text, arguments.bearing, "BEARING")
    text = "the first N channels are sensors on the machine, which together give one verdict; the "
    text += "others are inputs of its model, such as a torque. Default: 1"
    option(model, "--outputs", text, arguments.positive_int)
    flag(model, "--fixed-gain", "--diagnoser detector: one sensor and gain, so the level counts")
    text = "do not save the known conditions and the healthy limits, which reject recordings that "
    text += "resemble no condition, and raise the alarm"
    flag(model, "--no-p-values", text)
    cut = parser.add_argument_group("windows")
    text = "default: stretches of a second, or of ten turns if they take longer; if the recordings "
    text += "are too short, windows of 1200, of the detector 4800"
    option(cut, "--window-length", text, arguments.window_length)
    text = "samples between the starts of windows; default: their length"
    option(cut, "--hop", text, arguments.positive_int)
    text = "windows of each recording, spread over all of it; default: as memory allows"
    option(cut, "--max-windows", text, arguments.positive_int)
    text = "resample all recordings; without it they must have the same sampling rate"
    option(cut, "--resample-to", text, arguments.positive_number, "HZ")
    files = parser.add_argument_group("files")
    flag(files, "--force", "let -o replace a file that is no saved diagnoser")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    with as_command_error():
        listed = arguments.table_recordings(args)
        inputs = [args.table, *(recording.path for recording in listed)]
        check_output(args.output, inputs, is_model_file, args.force)
        require("skops", "saving a diagnoser", "io")
    _check_options(args, listed)
    rig, rows = training_rows(args, listed)
    kind = args.diagnoser or ("stretches" if rows == "stretches" else "diagnoser")
    chosen = _choose_speed(args, rig)
    speeds, errors = speeds_of_samples(rig, LEAST_TURNS if rows == "stretches" else 0)
    chosen &= errors == ""
    healthy, reason = _healthy_condition(args, kind, rig, chosen)
    if kind == "detector":
        chosen &= rig.target == healthy
    # The windows may take half of the memory, so they are not copied without need.
    X = rig.pop("data")
    X = X if chosen.all() else X[chosen]
    y, rpm = rig.target[chosen], None if speeds is None else speeds[chosen]
    rate, channels = float(rig.sampling_rate), listed[0].channel or []
    diagnoser, started = _make(args, kind, healthy, rate), perf_counter()
    rates = [name for name in diagnoser.get_params() if name.endswith("__false_alarm_rate")]
    diagnoser.set_params(**dict.fromkeys(rates, args.false_alarm_rate))
    report_progress(args, f"{len(X)} {rows}: fitting")
    with as_command_error():
        notes = _fit_quietly(args, diagnoser, X, None if kind == "detector" else y, rpm)
    companions = _companions(args, kind, X, y, rpm, healthy, notes)
    # Places of faults that no recording shows are conditions, too.
    conditions = sorted(answers(diagnoser).conditions or [healthy], key=lambda c: c != healthy)
    counts = pd.Series(rig.recording[chosen]).groupby(y).agg(["count", "nunique"])
    n_windows, n_recordings = counts.reindex(conditions, fill_value=0).T.to_numpy().tolist()
    with as_command_error():
        save_diagnoser(
            diagnoser,
            args.output,
            **companions,
            diagnoser=kind,
            conditions=conditions,
            healthy=healthy,
            train_rpm=_training_speeds(rig, chosen),
            sampling_rate=rate,
            n_channels=1 if X.ndim == 2 else X.shape[1],
            window_length=X.shape[-1],
            rows=rows,
            channels=channels if isinstance(channels, list) else [channels],
            n_windows=n_windows,
            n_recordings=n_recordings,
            false_alarm_rate=args.false_alarm_rate,
            bearing=args.bearing,
            saved=datetime.now(UTC).strftime("%Y-%m-%d"),
        )
    if args.verbose:
        report_progress(args, f"fitted in {perf_counter() - started:.1f} s")
    seconds = X.shape[-1] / rate
    turns = "" if rpm is None else f", {seconds * rpm.min() / 60:.3g} turns at {rpm.min():g} rpm"
    if rpm is None and kind == "stretches":
        turns = "; the table states no speed: the pattern of impacts is used"
    print(rig.DESCR)
    if (errors != "").any():
        print(f"{np.sum(errors != '')} {rows} left out: {errors[errors != ''][0]}")
    print(f"{rows.capitalize()} of {X.shape[-1]} samples, {seconds:.3g} s at {rate:g} Hz{turns}")
    for name, n_own_recordings, n_own in zip(conditions, n_recordings, n_windows, strict=True):
        if n_own_recordings:
            print(f"{name}: {counted(n_own_recordings, 'recordings')}, {counted(n_own, rows)}")
    roles = _roles(listed[0], args.outputs or 1)
    print(f"Healthy: {healthy or 'none'} ({reason})", *roles, *notes, sep="\n")
    if healthy is not None:
        basis = limits_basis(companions.get("detector", diagnoser), rows)
        print(f"Limits for a false-alarm rate of {args.false_alarm_rate:g} from {basis}")
    print(f"Saved {kind} to {args.output}")
    return 0


def _roles(recording, n_outputs):
    """Yield which of several channels are outputs, and a note on inputs of the same unit."""
    if not isinstance(recording.channel, list) or len(recording.channel) < 2:
        return
    units = list_channels(recording.path, dtype=recording.dtype).set_index("channel")["unit"]
    names = choose_channels(list(units.index), recording.channel)
    outputs, inputs = names[:n_outputs], names[n_outputs:]
    yield f"Outputs: {', '.join(outputs)}. Inputs: {', '.join(inputs) or 'none'}"
    for name in inputs:
        if units[outputs[0]] is not None and units[name] == units[outputs[0]]:
            yield (
                f"Note: {outputs[0]} and {name} have the unit {units[name]}; {name} is used as an "
                "input of the model. If it is another sensor on the machine, use --outputs."
            )


def _check_options(args, listed):
    present = {recording.condition for recording in listed}
    if args.bearing is not None and args.diagnoser is None:
        args.diagnoser = "stretches"
    elif args.diagnoser is None and len(present) == 1 and None not in present:
        (name,) = present
        is_healthy = _is_healthy(name) if args.healthy is None else name == args.healthy
        args.diagnoser = "detector" if is_healthy else None
    for name, kind in {"fixed_gain": "detector", "bearing": "stretches"}.items():
        if args.diagnoser != kind:
            refuse(args, [name], f"belongs to --diagnoser {kind}")
    if args.bearing is not None:
        refuse(args, ["outputs"], "not allowed with --bearing; fit one model for each output")


def _is_healthy(name):
    return place_of_label(name) == HEALTHY


def _make(args, kind, healthy, rate):
    if kind == "detector":
        model = diagnosers.make_detector(fixed_gain=args.fixed_gain)
    elif kind == "stretches":
        model = diagnosers.make_diagnoser(sampling_rate=rate, bearing=args.bearing, healthy=healthy)
    else:
        model = DIAGNOSERS[kind][1](healthy=healthy)
    return of_outputs(args, model)


def _fit_quietly(args, model, X, y, rpm):
    """Fit a model with the threads of --n-jobs, and return the messages of its warnings."""
    speeds = {"rpm": rpm} if rpm is not None and requests(model, "fit", "rpm") else {}
    with (
        parallel_config("threading", n_jobs=args.n_jobs),
        warnings.catch_warnings(record=True) as warned,
    ):
        warnings.simplefilter("always", UserWarning)
        model.fit(X, y, **speeds)
    return [f"Note: {warning.message}" for warning in warned]


def _companions(args, kind, X, y, rpm, healthy, notes):
    """Return the fitted known conditions and healthy limits; the notes say why one is missing."""
    fitted = {}
    if kind == "detector" or args.no_p_values:
        return fitted
    if len(set(y)) > 1:
        known = of_outputs(args, diagnosers.make_known_conditions())
        try:
            _fit_quietly(args, known, X, y, rpm)
            if left_out := sorted(set(y) - set(known.classes_)):
                names = ", ".join(left_out)
                raise ValueError(f"fewer than two windows at one speed of {names}")
            fitted["known_conditions"] = known
        except ValueError as error:
            notes.append(f"The verdict 'none of these' is not possible: {error}")
    if healthy is not None:
        detector = diagnosers.make_detector(false_alarm_rate=args.false_alarm_rate)
        detector = of_outputs(args, detector)
        rows = y == healthy
        try:
            _fit_quietly(args, detector, X[rows], None, None if rpm is None else rpm[rows])
            fitted["detector"] = detector
        except ValueError as error:
            notes.append(f"No healthy limits: {error}")
    return fitted


def _choose_speed(args, rig):
    if args.train_rpm is None:
        return np.ones(len(rig.recording), dtype=bool)
    if rig.rpm is None:
        raise UsageError(f"argument --train-rpm: {args.table} has no column rpm to choose from")
    low, high = args.train_rpm
    chosen = (rig.rpm >= low) & (rig.rpm <= high)
    if not chosen.any():
        listed = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
        raise UsageError(
            f"argument --train-rpm: {low:g} to {high:g} holds no speed of {args.table}: {listed}; "
            "1797+-30 and 1700..1800 take several"
        )
    return chosen


def _training_speeds(rig, chosen):
    """Return the speeds of the chosen rows; those of varying speed are grouped."""
    if rig.rpm is None:
        return None
    rpm = np.unique(rig.rpm[chosen])
    return np.exp(group_speeds(np.log(rpm))[0]).round(1).tolist() if rig.profiles else rpm.tolist()


def _healthy_condition(args, kind, rig, chosen):
    """Return the healthy condition, or None if there is none, and why it is that one."""
    if args.bearing is not None and rig.rpm is None:
        raise CommandError(f"{args.table}: no speed is stated; expected a column rpm, or --rpm")
    present = [] if rig.target is None else [n for n in rig.target_names if n in rig.target[chosen]]
    if len(present) < 2 and kind != "detector" and args.bearing is None:
        raise CommandError(
            f"{args.table}: conditions {present}; --diagnoser {kind} needs two or more in a column "
            "condition. With healthy recordings only, use --diagnoser detector"
        )
    if rig.target is None:
        rig.target, present = np.full(len(rig.recording), HEALTHY), [HEALTHY]
    with as_command_error():
        check_condition_names(present)
    named = list(filter(_is_healthy, present))
    if args.healthy in present or (args.healthy == "none" and kind != "detector"):
        return None if args.healthy not in present else args.healthy, "--healthy"
    if args.healthy is None and len(present) == 1:
        return present[0], "the only condition"
    if args.healthy is None and len(named) == 1:
        return named[0], "by its name; --healthy names another"
    problem = "needed, because the names do not show which condition is healthy"
    raise UsageError(
        f"argument --healthy: {problem if args.healthy is None else repr(args.healthy)}, expected "
        f"a condition of {args.table}: {', '.join(present)}"
        + ("; or --healthy none" if kind != "detector" else "")
    )
