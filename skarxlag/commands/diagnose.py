"""``skarxlag diagnose``: verdicts of a saved diagnoser on recordings."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

from .._files import write_atomically
from ..persistence import load_diagnoser
from ..recordings.files import recording_blocks
from ..recordings.table import list_recordings
from ..recordings.windows import block_length, cut_blocks
from ..verdicts import recording_verdict, window_verdicts
from .arguments import job_count, positive_number
from .diagnosers import set_threads
from .errors import CommandError, UsageError, as_command_error

_DESCRIPTION = """\
Diagnose recordings with a diagnoser that `fit` saved: one verdict for each recording, from the
evidence of all its windows. A .csv among RECORDING holds samples; a table of recordings, with the
columns that `fit` takes, is given with --table.
"""
_FACTS = ("conditions", "diagnoser", "n_channels", "sampling_rate", "train_rpm", "window_length")


class _File:
    """A RECORDING of the command line, with the face of a `ListedRecording`."""

    condition = None

    def __init__(self, path, args):
        self.name, self.path, self.sampling_rate = str(path), path, args.sampling_rate
        self.channel = args.channel
        if args.channel is not None and ";" in args.channel:
            self.channel = [name.strip() for name in args.channel.split(";")]

    def blocks(self, n_samples):
        for signal, known in recording_blocks(self.path, n_samples, channel=self.channel):
            if None not in (self.sampling_rate, known) and self.sampling_rate != known:
                raise UsageError(
                    f"argument --sampling-rate: {self.sampling_rate:g} Hz, but {self.path} states "
                    f"{known:g} Hz"
                )
            yield signal, known if self.sampling_rate is None else self.sampling_rate


def add_arguments(parser):
    """Declare the arguments."""
    parser.description = _DESCRIPTION
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
    with as_command_error():
        diagnoser, facts = load_diagnoser(args.model)
    missing = [name for name in _FACTS if name not in facts]
    if missing:
        raise CommandError(f"{args.model}: not saved by fit, it does not state {missing[0]}")
    set_threads(diagnoser, args.n_jobs)
    recordings = [_File(path, args) for path in args.recordings]
    with as_command_error():
        if args.table is not None:
            recordings += list_recordings(args.table)
        verdicts, rates = zip(
            *(_diagnose(recording, diagnoser, args.model, facts) for recording in recordings),
            strict=True,
        )
        if args.output is not None:
            for recording, windows in zip(recordings, verdicts, strict=True):
                windows.insert(0, "recording", recording.name)
            content = pd.concat(verdicts).to_csv(index=False)
            write_atomically(args.output, content.encode())
    print(_report(args, facts, recordings, verdicts, rates))
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


def _diagnose(recording, diagnoser, model, facts):
    """Verdicts on the windows of a recording, read part by part, and its sampling rate."""
    print(f"{recording.name}: diagnosing", file=sys.stderr, flush=True)
    window_length, sampling_rate = facts["window_length"], None

    def signals():
        nonlocal sampling_rate
        for signal, sampling_rate in recording.blocks(block_length(window_length)):
            _check_fits(recording.name, signal, sampling_rate, model, facts)
            yield signal

    parts = [
        window_verdicts(diagnoser, X, facts["conditions"])
        for X in cut_blocks(signals(), recording.name, window_length)
    ]
    windows = pd.concat(parts, ignore_index=True)
    windows.insert(0, "start", np.arange(len(windows)) * window_length)
    return windows, sampling_rate


def _check_fits(name, signal, sampling_rate, model, facts):
    n_channels = 1 if signal.ndim == 1 else len(signal)
    if n_channels != facts["n_channels"]:
        raise CommandError(
            f"{name}: {n_channels} channels, but {model} was fitted on {facts['n_channels']}"
        )
    if sampling_rate not in (None, facts["sampling_rate"]):
        raise CommandError(
            f"{name}: sampled at {sampling_rate:g} Hz, but {model} was fitted at "
            f"{facts['sampling_rate']:g} Hz"
        )


def _report(args, facts, recordings, verdicts, rates):
    rows = [
        {"condition": recording.condition or "-"} | recording_verdict(windows, facts["conditions"])
        for recording, windows in zip(recordings, verdicts, strict=True)
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
    if None in rates:
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
