"""``skarxlag watch``: verdicts on a running sensor."""

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

from ..monitoring import ConditionMonitor, load_monitor_state, save_monitor_state
from .arguments import positive_number
from .errors import UsageError, as_command_error, printable
from .live_sources import Patience, from_folder, from_growing_file, from_stream
from .models import load_model
from .sample_parsers import RawSamples, TextSamples
from .stopping import Stopping, StopRequestedError

_DESCRIPTION = """\
Diagnose a running sensor with a diagnoser that `fit` saved. SOURCE is - for standard input, a file
that grows, or a folder into which a logger drops files. Standard input and a growing file hold csv
lines, or raw samples with --dtype; files in a folder are of any format that diagnose reads. Writes
one line of JSON for each window to standard output, and a summary to standard error. Ends with the
input, or on Ctrl-C.
"""
#: Seconds between two savings of the state.
_SAVE_EVERY = 60.0


def add_arguments(parser: Any) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="what fit has saved")
    parser.add_argument("source", metavar="SOURCE", help="- or a file or a folder")
    parser.add_argument("--detector", type=Path, metavar="MODEL.skops", help="for the alarm")
    parser.add_argument(
        "--dtype", help="of raw samples: <i2, or '(4,)<f4' for four interleaved channels"
    )
    parser.add_argument(
        "--channel",
        metavar="NAME",
        help="column of the lines or samples, counted from 0, or channel of the files; several are "
        "separated by ; with the output first",
    )
    parser.add_argument(
        "--sampling-rate", type=positive_number, metavar="HZ", help="default: the model's"
    )
    parser.add_argument("--rpm", type=positive_number, help="shaft speed, where the model uses it")
    parser.add_argument(
        "--hop", type=int, metavar="SAMPLES", help="between windows; default: their length"
    )
    parser.add_argument(
        "--half-life",
        type=positive_number,
        default=10.0,
        metavar="SECONDS",
        help="in which the weight of evidence halves; default: %(default)g",
    )
    parser.add_argument(
        "--false-alarm-interval",
        type=positive_number,
        default=1000.0,
        metavar="HOURS",
        help="of signal between false alarms, in the mean; default: %(default)g",
    )
    parser.add_argument(
        "--timed-files",
        action="store_true",
        help="the time of modification of each file in the folder is that of its last sample, so "
        "there may be gaps between files",
    )
    parser.add_argument(
        "--gap-tolerance",
        type=positive_number,
        metavar="SECONDS",
        help="by which a file may be late without a gap; default: half a window",
    )
    parser.add_argument(
        "--state", type=Path, metavar="FILE.npz", help="go on from here, and save here every minute"
    )
    parser.add_argument(
        "--idle",
        type=positive_number,
        metavar="SECONDS",
        help="end when a file or a folder has had nothing new for so long; default: never",
    )
    parser.add_argument(
        "--poll",
        type=positive_number,
        default=0.2,
        metavar="SECONDS",
        help="between looks at a file or a folder; default: %(default)g",
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="a line a second for people")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: Any) -> Any:
    """Run the command."""
    model = load_model(args.model)
    sampling_rate = args.sampling_rate or model.sampling_rate
    if sampling_rate is None:
        raise UsageError(f"argument --sampling-rate: needed, {args.model} states none")
    monitor = _monitor(args, model, sampling_rate)
    place = None
    if args.state is not None and args.state.exists():
        with as_command_error():
            state, facts = load_monitor_state(args.state)
            monitor.restore(state)
        place = facts.get("place")
    with as_command_error(), Stopping() as stopping:
        parser, blocks = _source(args, model, sampling_rate, stopping, place)
        try:
            _follow(args, monitor, blocks, stopping, place)
        except StopRequestedError:
            pass
        finally:
            blocks.close()
    _warn(_summary(monitor, 0 if parser is None else parser.n_bad))
    return 0


def _monitor(args, model, sampling_rate):
    diagnoser, detector = model.diagnoser, None
    if args.detector is not None:
        flagging = load_model(args.detector)
        if flagging.window_length != model.window_length:
            raise UsageError(
                f"argument --detector: windows of {flagging.window_length} samples, expected "
                f"{model.window_length} as in {args.model}"
            )
        detector = flagging.diagnoser
    if not hasattr(diagnoser, "predict_proba"):
        if detector is not None:
            raise UsageError(f"argument --detector: {args.model} is a detector itself")
        diagnoser, detector = None, diagnoser
    with as_command_error():
        return ConditionMonitor(
            diagnoser,
            sampling_rate,
            detector=detector,
            window_length=model.window_length,
            hop=args.hop,
            half_life=args.half_life,
            false_alarm_interval=args.false_alarm_interval,
            gap_tolerance=args.gap_tolerance,
        )


def _source(args, model, sampling_rate, stopping, place):
    """Parser of a stream, if there is one, and the blocks."""
    path = Path(args.source)
    channel = args.channel
    if channel is not None and ";" in channel:
        channel = [name.strip() for name in channel.split(";")]
    patience = Patience(stopping, args.poll, args.idle)
    if args.source != "-" and path.is_dir():
        options = {
            "channel": channel,
            "dtype": args.dtype,
            "sampling_rate": sampling_rate,
            "window_length": model.window_length,
            "has_times": args.timed_files,
        }
        return None, from_folder(path, options, patience, _warn, place)
    columns = None if channel is None else _columns(channel)
    parser = TextSamples(columns) if args.dtype is None else RawSamples(args.dtype, columns)
    if args.source == "-":
        return parser, from_stream(sys.stdin.buffer, parser, stopping)
    if not path.is_file():
        raise FileNotFoundError(f"{printable(path)}: no such file or folder")
    return parser, from_growing_file(path, parser, patience, _warn, place or 0)


def _columns(channel):
    names = [channel] if isinstance(channel, str) else channel
    if not all(name.isdecimal() for name in names):
        raise UsageError(f"argument --channel: {';'.join(names)!r}, expected columns from 0 on")
    return [int(name) for name in names]


def _follow(args, monitor, blocks, stopping, place):
    told = saved = time.monotonic()
    try:
        for block in blocks:
            place = block.place
            if block.samples.shape[1] > 0:
                verdicts = monitor.update(block.samples, time=block.time, rpm=args.rpm)
                _write(verdicts, block.source)
                if verdicts and args.verbose and time.monotonic() - told >= 1.0:
                    told = time.monotonic()
                    _warn(_sentence(verdicts[-1]))
            if args.state is not None and time.monotonic() - saved >= _SAVE_EVERY:
                saved = time.monotonic()
                save_monitor_state(monitor, args.state, place=place)
            if stopping.requested:
                return
    finally:
        if args.state is not None:
            save_monitor_state(monitor, args.state, place=place)


def _write(verdicts, source):
    for verdict in verdicts:
        line = {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in verdict._asdict().items()
        }
        if source is not None:
            line["source"] = printable(source)
        print(json.dumps(line, allow_nan=False))
    if verdicts:
        sys.stdout.flush()


def _sentence(verdict):
    parts = [f"{verdict.time:.1f} s"]
    parts.append("no verdict" if verdict.verdict is None else f"{verdict.verdict}")
    if verdict.verdict is not None:
        parts.append(f"confidence {verdict.confidence:.0%}")
    if verdict.alarm is not None:
        parts.append(f"alarm {'ON' if verdict.alarm else 'off'} at {verdict.alarm_level:.0%}")
    if verdict.quality != "good":
        parts.append(f"no signal: {verdict.quality}")
    return ", ".join(parts)


def _summary(monitor, n_bad):
    counts = monitor.counts
    windows = ", ".join(f"{n} {name}" for name, n in sorted(counts["windows"].items()))
    parts = [f"{counts['samples']} samples", f"windows: {windows or 'none'}"]
    parts.append(f"{counts['gaps']} gaps of {counts['missing_seconds']:.1f} s")
    if counts["clock_steps_back"]:
        parts.append(f"clock set back {counts['clock_steps_back']} times")
    if n_bad:
        parts.append(f"{n_bad} lines that are no numbers")
    parts.append(f"{counts['alarms']} alarms")
    return "; ".join(parts)


def _warn(text):
    print(text, file=sys.stderr, flush=True)
