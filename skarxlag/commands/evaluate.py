"""``skarxlag evaluate``: train at some speeds, test at others."""

import argparse
import sys
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
from joblib import Parallel, delayed

from .._answers import requests
from .._files import write_atomically
from ..accuracy_tables import scored_windows
from ..datasets import FETCHERS, simulate_rig
from ..model_selection import first_and_second_half
from . import figures
from .arguments import job_count, option_of, positive_int, speed_or_all, window_length
from .messages import Progress, UsageError, add_progress_arguments, as_command_error
from .models import DIAGNOSERS
from .own_rig import Case, Split, own_case, own_report
from .report import why_no_figures
from .tables import evaluation_report

_DESCRIPTION = """\
Compare the three diagnosers across shaft speeds: ALPIO, the baseline of Piltan and Kim (2019); the
extended-state observer, their proposal as repaired; and the recommended diagnoser. Each is
calibrated on the first half of every recording of one speed and tested on the second half of every
recording of every speed. The paper's own protocol is python -m benchmarks.paper.
"""
TITLES = {
    "simulated": "Simulated rig",
    **{name: f"{name.upper().replace('_', '-')} rig" for name in FETCHERS},
}
#: The simulated rig: samples of a recording, crack sizes, and the speed of the calibration.
_N_SAMPLES = 120_000
_CRACKS_MM = (3.0, 6.0)
_SIMULATED_RPM = 500.0
_WINDOW_LENGTH = 1200


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument(
        "table",
        nargs="?",
        help="csv table of your own recordings, with the columns path, condition and rpm: "
        "make_diagnoser and two other methods with one speed in training and with one left out. "
        "Recordings of one value of the column campaign are not split between training and test",
    )
    add = parser.add_argument
    add("--rig", choices=TITLES, default="simulated", help="default: simulated")
    add("--data-home", type=Path, help="folder of a real rig's files; default: scikit-learn's")
    speed = "speed of the calibration on a rig, or all; default: all, on the simulated rig 500"
    add("--train-rpm", type=speed_or_all, metavar="RPM", help=speed)
    length = "default: 1200; of a table 4800, if the recordings are long enough"
    add("--window-length", type=window_length, metavar="N", help=length)
    samples = f"samples of a recording of the simulated rig; default: {_N_SAMPLES}"
    add("--n-samples", type=positive_int, metavar="N", help=samples)
    add("--n-jobs", type=job_count, default=-1, metavar="N", help="threads; default: all cores")
    add_progress_arguments(parser)
    folder = Path("skarxlag-results")
    add("--output", type=Path, default=folder, metavar="FOLDER", help="default: %(default)s")
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    fits = {"data_home": args.rig in FETCHERS, "n_samples": args.rig not in FETCHERS}
    for name in fits:
        if vars(args)[name] is not None and not (fits[name] and args.table is None):
            what = f"--rig {args.rig}" if args.table is None else "a table"
            raise UsageError(f"argument {option_of(name)}: not allowed with {what}")
    try:
        args.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"argument --output: {error}") from error
    cases = _rig_cases(args) if args.table is None else [own_case(args)]
    report = _rig_report if args.table is None else own_report
    n_fits = sum(len(case.splits) * len(case.makers) for case in cases)
    with as_command_error():
        with Progress(n_fits, "fits", args) as progress:
            found = [_evaluated(case, args.n_jobs, progress) for case in cases]
        texts = [report(args, case, *each) for case, each in zip(cases, found, strict=True)]
        text = "\n".join(texts)
        stem = args.rig if args.table is None else cases[0].stem
        write_atomically(args.output / f"{stem}_report.txt", text.encode())
    print(text)
    missing = why_no_figures()
    if args.table is None:
        drawn = "accuracy, confusion matrices, signals, identification, detection, residuals"
        print(missing or f"Drawn as PNG: {drawn}.")
    print(f"Report, tables and figures are in {args.output.resolve()}")
    return 0


def _rig_cases(args):
    """Cases of a rig: one for each crack size of the simulated rig."""
    if not args.quiet:
        print(f"{TITLES[args.rig]}: loading", file=sys.stderr, flush=True)
    try:
        with as_command_error(OSError):
            rigs = _rigs(args, args.window_length or _WINDOW_LENGTH)
    except ValueError as error:
        # The files of a fetcher are the original ones, so only the window length can be wrong.
        raise UsageError(f"argument --window-length: {error}") from error
    return [_rig_case(args, crack, rig) for crack, rig in rigs.items()]


def _rigs(args, length):
    """Rigs by crack size, which is None for a real rig."""
    if args.rig in FETCHERS:
        return {None: FETCHERS[args.rig](data_home=args.data_home, window_length=length)}
    # A tail that fills no window is not simulated.
    n_samples = (args.n_samples or _N_SAMPLES) // length * length
    options = {"n_samples": n_samples, "window_length": length, "random_state": 0}
    return {crack: simulate_rig(crack_mm=crack, **options) for crack in _CRACKS_MM}


def _rig_case(args, crack, rig):
    title, stem = TITLES[args.rig], args.rig
    if crack is not None:
        title, stem = f"{title}, crack {crack:g} mm", f"{stem}_{crack:g}mm"
    if np.unique(rig.recording, return_counts=True)[1].min() < 2:
        raise UsageError(
            f"argument --window-length: {rig.data.shape[-1]}, expected at most half of the "
            "shortest recording"
        )
    speeds = np.unique(rig.rpm).tolist()
    wanted = args.train_rpm or ("all" if crack is None else _SIMULATED_RPM)
    if wanted not in (*speeds, "all"):
        listed = ", ".join(f"{speed:g}" for speed in speeds)
        raise UsageError(f"argument --train-rpm: {wanted:g}, expected {listed}, or all")
    first, second = first_and_second_half(rig.recording)
    splits = []
    for speed in speeds if wanted == "all" else [wanted]:
        train, label = np.flatnonzero(first & (rig.rpm == speed)), f"calibrated at {speed:g} rpm"
        splits.append(Split(train, np.flatnonzero(second), label, {"train_rpm": speed}))
    healthy = rig.target_names[0]
    makers = {name: partial(make, healthy=healthy) for name, make in DIAGNOSERS.values()}
    return Case(title, stem, rig, splits, makers)


def _evaluated(case, n_jobs, progress):
    """Verdicts of all diagnosers on all tests, and the first fitted diagnoser."""
    fits = Parallel(n_jobs=n_jobs, prefer="threads", return_as="generator")(
        delayed(_scored)(case, split, name) for name in case.makers for split in case.splits
    )
    frames, first = [], None
    for frame, diagnoser, line in fits:
        first = diagnoser if first is None else first
        frames.append(frame)
        progress.step(line)
    return pd.concat(frames, ignore_index=True), first


def _scored(case, split, name):
    started, rig = perf_counter(), case.rig
    diagnoser = case.makers[name]()
    speeds = {"rpm": rig.rpm[split.train]} if requests(diagnoser, "fit", "rpm") else {}
    diagnoser.fit(rig.data[split.train], rig.target[split.train], **speeds)
    frame = scored_windows(diagnoser, rig, split.test, {"diagnoser": name} | split.columns)
    line = f"{case.title}: {name}, {split.label}: {perf_counter() - started:.1f} s"
    return frame, diagnoser, line


def _rig_report(args, case, verdicts, diagnoser):
    """Write tables and figures, and return the report."""
    rig, stem = case.rig, args.output / case.stem
    tables = evaluation_report(verdicts, rig.target_names, case.title)
    frames = {table.stem: table.frame for table in tables}
    for name, frame in frames.items():
        write_atomically(Path(f"{stem}_{name}.csv"), frame.to_csv(float_format="%.6g").encode())
    content = verdicts.assign(rig=case.title).set_index("rig").to_csv()
    write_atomically(Path(f"{stem}_verdicts.csv"), content.encode())
    if why_no_figures() is None:
        # ALPIO comes first: it has one observer for each model, whose residuals can be drawn.
        figures.save_figures(verdicts, rig, diagnoser, case.title, stem)
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
    simulated = "Simulated, not measured. " if args.rig == "simulated" else ""
    heading = (
        f"{case.title}: {len(rig.target_names)} conditions at {speeds} rpm, "
        f"windows of {rig.data.shape[-1]} samples at {rig.sampling_rate:g} Hz.\n{simulated}"
        "Calibrated on first halves of recordings at one speed, tested on second halves.\n"
    )
    return "\n".join([heading, *(table.text for table in tables)])
