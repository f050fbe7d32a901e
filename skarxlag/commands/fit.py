"""``skarxlag fit``: calibrate a diagnoser on the user's own recordings."""

import argparse
import re
import sys
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

import numpy as np

from .._answers import answers, requests
from ..diagnosers import make_detector, make_diagnoser, make_fault_order_classifier
from ..fault_classifier import FaultOrderClassifier
from ..fault_places import HEALTHY
from ..persistence import save_diagnoser
from ..verdicts import check_condition_names
from .arguments import (
    add_source_arguments,
    bearing,
    job_count,
    positive_int,
    positive_number,
    rate,
    speed_range,
    table_recordings,
    window_length,
)
from .info import calibration_basis, too_few_rows
from .messages import CommandError, UsageError, add_progress_arguments, as_command_error, counted
from .models import DIAGNOSERS, is_model_file
from .results import check_output
from .training import (
    DETECTOR,
    MOST_SAMPLES,
    ORDERS,
    STRETCHES,
    fit_healthy_limits,
    fit_known_conditions,
    fit_quietly,
    training_windows,
)

_DESCRIPTION = """\
Calibrate a diagnoser on the recordings that a table lists, and save it. The table is a csv file
with the columns path, condition, rpm, sampling_rate and channel; only path is needed by all, see
skarxlag.read_recording_table. The detector needs healthy recordings only, best of several speeds,
and names no fault.
"""
#: Words in the name of a healthy condition, and whole names of it.
_HEALTHY_WORDS = {"healthy", "normal", "good", "intact", "baseline", "ok", "okay", "nominal"}
_HEALTHY_NAMES = {"n", "h"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument("table", type=Path, help="csv table of the recordings, a folder, or a glob")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.skops")
    parser.add_argument(
        "--healthy",
        metavar="LABEL",
        help="healthy condition, or none if no recording is healthy; default: the only condition "
        "that is called healthy, normal, good, ok, intact, nominal, baseline, n or h",
    )
    parser.add_argument(
        "--train-rpm",
        type=speed_range,
        metavar="RPM",
        help="use the recordings of this speed, also 1797+-30, 1797+-2%% or 1700..1800; default: "
        "all recordings",
    )
    parser.add_argument(
        "--false-alarm-rate",
        type=rate,
        default=0.01,
        metavar="SHARE",
        help="of healthy windows that may raise an alarm; default: 0.01",
    )
    parser.add_argument(
        "--n-jobs", type=job_count, default=-1, metavar="N", help="threads; default: all cores"
    )
    add_progress_arguments(parser)
    add_source_arguments(parser, "a folder or glob")
    model = parser.add_argument_group("model")
    model.add_argument(
        "--diagnoser",
        choices=[*DIAGNOSERS, STRETCHES, ORDERS, DETECTOR],
        help="default: stretches, which takes the speeds of the table, if the recordings are long "
        "enough and neither --window-length, --hop nor --max-windows is given, else diagnoser",
    )
    model.add_argument(
        "--bearing",
        type=bearing,
        metavar="BEARING",
        help="name places of faults by the orders of this bearing (--diagnoser orders); recordings "
        "of faults are not needed, healthy ones set the limits. A name such as 6205, dimensions "
        "9,7.94,39.04, or orders outer=3.585,inner=5.415",
    )
    model.add_argument(
        "--fixed-gain",
        action="store_true",
        help="detector: all recordings have the same sensor and gain, so the level counts",
    )
    model.add_argument(
        "--no-p-values",
        action="store_true",
        help="do not save the known conditions and the healthy limits, which reject recordings "
        "that resemble no condition, and raise the alarm",
    )
    cut = parser.add_argument_group("windows")
    cut.add_argument(
        "--window-length",
        type=window_length,
        metavar="N",
        help="default: if the recordings are long enough, stretches of a second, or of ten "
        "turns at the lowest speed of the table if that is longer; else 1200, of the detector 4800",
    )
    cut.add_argument(
        "--hop",
        type=positive_int,
        metavar="N",
        help="samples from the start of one window to the start of the next; default: their length",
    )
    cut.add_argument(
        "--max-windows",
        type=positive_int,
        metavar="N",
        help="of each recording, spread over all of it; default: all windows, or, if they hold "
        f"more than {MOST_SAMPLES / 1e6:.0f} million samples of all recordings, an equal number of "
        "each that holds less",
    )
    cut.add_argument(
        "--resample-to",
        type=positive_number,
        metavar="HZ",
        help="bring all recordings to this sampling rate; without it they must have the same",
    )
    parser.add_argument_group("files").add_argument(
        "--force", action="store_true", help="let -o replace a file that is no saved diagnoser"
    )
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    with as_command_error():
        listed = table_recordings(args)
        inputs = [args.table, *(recording.path for recording in listed)]
    check_output(args.output, inputs, is_own=is_model_file, force=args.force)
    if find_spec("skops") is None:
        raise CommandError("saving a diagnoser needs skops: pip install 'skarxlag[io]'")
    if args.fixed_gain and args.diagnoser != DETECTOR:
        raise UsageError(f"argument --fixed-gain: belongs to --diagnoser {DETECTOR}")
    if args.bearing is not None:
        if args.diagnoser not in (None, ORDERS):
            raise UsageError(f"argument --bearing: belongs to --diagnoser {ORDERS}")
        args.diagnoser = ORDERS
    elif args.diagnoser == ORDERS:
        raise UsageError(f"argument --bearing: none given, --diagnoser {ORDERS} needs it")
    rig, kind, rows = training_windows(args, listed)
    if kind == ORDERS and rig.rpm is None:
        raise CommandError(
            f"{args.table}: no speed is stated, which --diagnoser {ORDERS} needs; expected a "
            "column rpm or --rpm"
        )
    if kind == ORDERS and rig.target is None:
        rig.target, rig.target_names = np.full(len(rig.recording), HEALTHY), [HEALTHY]
    chosen = _choose_speed(args, rig)
    conditions, healthy, reason = _conditions(args, kind, rig, chosen)
    if kind == DETECTOR and rig.target is not None:
        chosen &= rig.target == healthy
    # Not two copies at a time: the windows may be half of what memory holds.
    X, recording = rig.pop("data"), rig.recording[chosen]
    X = X if chosen.all() else X[chosen]
    y = None if kind == DETECTOR else rig.target[chosen]
    rpm = None if rig.rpm is None else rig.rpm[chosen]
    diagnoser = _make(args, kind, healthy, float(rig.sampling_rate))
    diagnoser.set_params(decide__false_alarm_rate=args.false_alarm_rate)
    started = perf_counter()
    if not args.quiet:
        print(f"{len(X)} {rows}: fitting", file=sys.stderr, flush=True)
    own = [recording if y is None else recording[y == name] for name in conditions]
    n_windows, n_recordings = [len(each) for each in own], [len(np.unique(each)) for each in own]
    with as_command_error():
        takes_rpm = requests(diagnoser, "fit", "rpm")
        notes = fit_quietly(diagnoser, X, y, rpm if takes_rpm else None, args)
    if kind == ORDERS:
        # Places that no recording shows are conditions, too.
        classes = diagnoser[-1].classes_.tolist()
        conditions = sorted(classes, key=lambda name: name != healthy)
        n_windows = [int(np.sum(y == name)) for name in conditions]
        n_recordings = [len(np.unique(recording[y == name])) for name in conditions]
    notes = [f"Note: {note}" for note in notes]
    known = detector = None
    if kind != DETECTOR and not args.no_p_values:
        if kind != ORDERS:
            known, line = fit_known_conditions(X, y, rpm, args)
            notes.append(line)
        if healthy is not None:
            detector, line = fit_healthy_limits(X, y == healthy, rpm, args)
            notes.append(line)
    with as_command_error():
        save_diagnoser(
            diagnoser,
            args.output,
            known_conditions=known,
            detector=detector,
            diagnoser=kind,
            conditions=conditions,
            healthy=healthy,
            train_rpm=None if rpm is None else np.unique(rpm).tolist(),
            sampling_rate=float(rig.sampling_rate),
            n_channels=1 if X.ndim == 2 else X.shape[1],
            window_length=X.shape[-1],
            rows=rows,
            channels=_channel_names(listed[0]),
            n_windows=n_windows,
            n_recordings=n_recordings,
            false_alarm_rate=args.false_alarm_rate,
            bearing=args.bearing,
            saved=datetime.now(UTC).strftime("%Y-%m-%d"),
        )
    if args.verbose:
        print(f"fitted in {perf_counter() - started:.1f} s", file=sys.stderr)
    lines = [rig.DESCR, _length_line(kind, rows, X.shape[-1], rig, chosen)]
    for name, n_own_recordings, n_own in zip(conditions, n_recordings, n_windows, strict=True):
        lines.append(f"{name}: {counted(n_own_recordings, 'recordings')}, {counted(n_own, rows)}")
    lines.append(f"Healthy: {healthy or 'none'} ({reason})")
    lines += notes
    if healthy is not None and detector is None:
        lines.append(_calibration(diagnoser[-1], args.false_alarm_rate, rows))
        if kind != DETECTOR:
            lines += too_few_rows(n_windows[0], args.false_alarm_rate)
    print(*lines, f"Saved {kind} to {args.output}", sep="\n")
    return 0


def _make(args, kind, healthy, sampling_rate):
    if kind == DETECTOR:
        return make_detector(fixed_gain=args.fixed_gain)
    if kind == ORDERS:
        return make_fault_order_classifier(bearing=args.bearing, sampling_rate=sampling_rate)
    if kind == STRETCHES:
        return make_diagnoser(sampling_rate=sampling_rate, healthy=healthy)
    return DIAGNOSERS[kind][1](healthy=healthy)


def _calibration(decide, rate, rows):
    """Describe the basis of the alarm in one line."""
    if answers(decide).healthy_p_value:
        return f"Limits for a false-alarm rate of {rate:g} from {calibration_basis(decide, rows)}"
    if isinstance(decide, FaultOrderClassifier):
        return (
            f"Limit of combs {decide.limit_:.2f} nepers above the healthy {rows} at a false-alarm "
            f"rate of {rate:g}"
        )
    threshold = decide.detection_threshold_
    return f"Detection threshold {threshold:.4g} at a false-alarm rate of {rate:g}"


def _length_line(kind, rows, length, rig, chosen):
    """What a verdict will rest on."""
    text = f"of {length} samples, {length / rig.sampling_rate:.3g} s at {rig.sampling_rate:g} Hz"
    if rows != STRETCHES:
        return f"Windows {text}"
    if rig.rpm is None:
        pattern = "; the table states no speed: the pattern of strikes is used"
        return f"Stretches {text}{pattern if kind == STRETCHES else ''}"
    slowest = rig.rpm[chosen].min()
    turns = length / rig.sampling_rate * slowest / 60
    return f"Stretches {text}, {turns:.3g} turns at {slowest:g} rpm"


def _channel_names(recording):
    channel = recording.channel
    return channel if isinstance(channel, list) else [] if channel is None else [channel]


def _choose_speed(args, rig):
    if args.train_rpm is None:
        return np.ones(len(rig.recording), dtype=bool)
    if rig.rpm is None:
        raise UsageError(f"argument --train-rpm: {args.table} has no column rpm to choose from")
    chosen = args.train_rpm.contains(rig.rpm)
    if not chosen.any():
        listed = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
        raise UsageError(
            f"argument --train-rpm: {args.train_rpm}, expected a speed of {args.table}: {listed}; "
            "1797+-30 and 1700..1800 take several"
        )
    return chosen


def _conditions(args, kind, rig, chosen):
    """Return the conditions, the healthy one first, the healthy one, and why it is that one."""
    if rig.target is None:
        if kind != DETECTOR:
            raise CommandError(
                f"{args.table}: no column condition, which --diagnoser {kind} needs; "
                f"with healthy recordings only use --diagnoser {DETECTOR}"
            )
        if args.healthy is not None:
            raise UsageError(f"argument --healthy: {args.table} has no column condition")
        return ["healthy"], "healthy", "the table states no conditions"
    present = [name for name in rig.target_names if name in set(rig.target[chosen])]
    at = "" if args.train_rpm is None else f" at {args.train_rpm} rpm"
    listed = f"{args.table}{at}: {', '.join(present)}"
    try:
        check_condition_names(present)
    except ValueError as error:
        raise UsageError(f"{args.table}: {error}") from error
    healthy, reason = _healthy(args, present, listed)
    if kind == DETECTOR:
        if healthy is None:
            raise UsageError(f"argument --healthy: none, but --diagnoser {DETECTOR} needs one")
        return [healthy], healthy, reason
    if len(present) < 2 and kind != ORDERS:
        raise CommandError(
            f"{args.table}: one condition, {present[0]!r}; --diagnoser {kind} needs two "
            f"or more, with healthy recordings only use --diagnoser {DETECTOR}"
        )
    return sorted(present, key=lambda name: name != healthy), healthy, reason


def _healthy(args, present, listed):
    """Return the healthy condition, or None if there is none, and why it is that one."""
    if args.healthy in present:
        return args.healthy, "--healthy"
    if args.healthy == "none":
        return None, "--healthy"
    if args.healthy is not None:
        raise UsageError(
            f"argument --healthy: {args.healthy!r}, expected a condition of {listed}; or none"
        )
    named = [name for name in present if _says_healthy(name)]
    if len(named) == 1:
        return named[0], "by its name; --healthy names another"
    if len(present) == 1:
        return present[0], "the only condition"
    raise UsageError(
        "argument --healthy: needed, because the names do not show which condition is healthy; "
        f"write --healthy NAME, or --healthy none. Conditions of {listed}"
    )


def _says_healthy(name):
    words = set(re.findall(r"[a-z]+", name.lower()))
    is_named = name.strip().lower() in _HEALTHY_NAMES or words & _HEALTHY_WORDS
    return bool(is_named) and not words & {"no", "not", "non"}
