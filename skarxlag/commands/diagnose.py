"""``python -m skarxlag diagnose``: verdicts of a saved diagnoser on recordings."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from ..persistence import load_diagnoser, write_atomically
from ..recording_table import read_recording_table
from ..recordings import read_recording
from ..signals import stack_windows
from .arguments import job_count, positive_number
from .diagnosers import set_threads
from .errors import CommandError, UsageError, reported
from .verdicts import recording_verdict, window_verdicts

_DESCRIPTION = """\
Diagnose recordings with a diagnoser that `fit` saved: one verdict for each recording, from the
evidence of all its windows. A .csv among RECORDING holds samples; a table of recordings, with the
columns that `fit` takes, is given with --table.
"""
_FACTS = ("conditions", "diagnoser", "n_channels", "sampling_rate", "train_rpm", "window_length")


@dataclass(frozen=True)
class _Recording:
    name: str
    signal: np.ndarray
    sampling_rate: float | None
    condition: str | None = None

    @property
    def n_channels(self):
        return 1 if self.signal.ndim == 1 else len(self.signal)


def add_parser(subparsers):
    """Declare the command and its arguments."""
    parser = subparsers.add_parser(
        "diagnose", help="diagnose recordings with a saved diagnoser", description=_DESCRIPTION
    )
    parser.add_argument("model", type=Path, metavar="MODEL.skops", help="what fit has saved")
    parser.add_argument(
        "recordings", type=Path, nargs="*", metavar="RECORDING", help=".mat, .csv, .wav, ..."
    )
    parser.add_argument("--table", type=Path, help="csv table of further recordings")
    parser.add_argument(
        "--channel",
        metavar="NAME",
        help="channel of each RECORDING; several are separated by ; with the output first",
    )
    parser.add_argument(
        "--sampling-rate",
        type=positive_number,
        metavar="HZ",
        help="of each RECORDING, to check it against the diagnoser's",
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FILE.csv", help="write the verdict on every window"
    )
    parser.add_argument(
        "--n-jobs", type=job_count, default=-1, metavar="N", help="threads; default: all cores"
    )
    parser.set_defaults(run=run, fail=parser.error)


def run(args):
    """Run the command."""
    _check_arguments(args)
    with reported():
        diagnoser, facts = load_diagnoser(args.model)
    missing = [name for name in _FACTS if name not in facts]
    if missing:
        raise CommandError(f"{args.model}: not saved by fit, it does not state {missing[0]}")
    with reported():
        recordings = [*_read_files(args), *_read_table(args)]
    for recording in recordings:
        _check_fits(recording, args.model, facts)
    with reported():
        X, source, start = stack_windows(
            [recording.signal for recording in recordings],
            [recording.name for recording in recordings],
            facts["window_length"],
        )
        set_threads(diagnoser, args.n_jobs)
        print(f"{len(X)} windows: diagnosing", file=sys.stderr, flush=True)
        windows = window_verdicts(diagnoser, X, facts["conditions"])
    if args.output is not None:
        names = np.array([recording.name for recording in recordings])
        windows.insert(0, "recording", names[source])
        windows.insert(1, "start", start)
        with reported():
            write_atomically(args.output, windows.to_csv(index=False).encode())
    print(_report(args, facts, recordings, windows, source))
    return 0


def _check_arguments(args):
    if not args.recordings and args.table is None:
        raise UsageError("argument RECORDING: none given, expected files or --table")
    for name in ("channel", "sampling_rate"):
        if getattr(args, name) is not None and not args.recordings:
            option = "--" + name.replace("_", "-")
            raise UsageError(f"argument {option}: belongs to RECORDING; the table states its own")
    if args.output is not None and (not args.output.parent.is_dir() or args.output.is_dir()):
        raise UsageError(f"argument -o/--output: {args.output}, expected a file in a folder there")


def _read_files(args):
    channel = args.channel
    if channel is not None and ";" in channel:
        channel = [name.strip() for name in channel.split(";")]
    for path in args.recordings:
        signal, known_rate = read_recording(path, channel=channel)
        rate = args.sampling_rate
        if None not in (rate, known_rate) and rate != known_rate:
            raise UsageError(
                f"argument --sampling-rate: {rate:g} Hz, but {path} states {known_rate:g} Hz"
            )
        yield _Recording(str(path), signal, known_rate if rate is None else rate)


def _read_table(args):
    if args.table is None:
        return
    table = read_recording_table(args.table)
    for number, (name, signal) in enumerate(zip(table.recording, table.recordings, strict=True)):
        condition = None if table.condition is None else str(table.condition[number])
        yield _Recording(name, signal, table.sampling_rate, condition)


def _check_fits(recording, model, facts):
    if recording.n_channels != facts["n_channels"]:
        raise CommandError(
            f"{recording.name}: {recording.n_channels} channels, but {model} was fitted on "
            f"{facts['n_channels']}"
        )
    if recording.sampling_rate not in (None, facts["sampling_rate"]):
        raise CommandError(
            f"{recording.name}: sampled at {recording.sampling_rate:g} Hz, but {model} was fitted "
            f"at {facts['sampling_rate']:g} Hz"
        )


def _report(args, facts, recordings, windows, source):
    rows = [
        {"condition": recording.condition or "-"}
        | recording_verdict(windows[source == number], facts["conditions"])
        for number, recording in enumerate(recordings)
    ]
    table = pd.DataFrame(rows, index=[recording.name for recording in recordings])
    if all(recording.condition is None for recording in recordings):
        table = table.drop(columns="condition")
    if table["confidence"].isna().all():
        table = table.drop(columns="confidence")
    for name in table.columns.intersection(["confidence", "alarms"]):
        table[name] = table[name].map("{:.1%}".format)
    shares = [name for name in table if name.startswith("share of ")]
    table[shares] = table[shares].map("{:.1%}".format)
    speeds = facts["train_rpm"]
    at = "" if speeds is None else f" at {', '.join(f'{s:g}' for s in speeds)} rpm"
    lines = [
        f"{args.model}: {facts['diagnoser']} calibrated on {', '.join(facts['conditions'])}{at}, "
        f"windows of {facts['window_length']} samples at {facts['sampling_rate']:g} Hz",
        table.to_string(),
    ]
    if any(recording.sampling_rate is None for recording in recordings):
        lines.append(
            f"No sampling rate is stated for some files; {facts['sampling_rate']:g} Hz was assumed."
        )
    if "confidence" in table:
        lines.append("Alarms depend on the speed; for detection across speeds fit a detector.")
    elif speeds is not None:
        lines.append(
            f"Levels grow with speed: false alarms are as stated up to {speeds[-1]:g} rpm."
        )
    if args.output is not None:
        lines.append(f"Verdicts on windows are in {args.output}")
    return "\n".join(lines)
