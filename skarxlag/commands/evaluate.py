"""``python -m skarxlag evaluate``: calibrate at one speed, test at every speed."""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd

from ..evaluation_tables import window_verdicts
from ..model_selection import speed_splits
from ..persistence import write_atomically
from . import figures
from .arguments import job_count, positive_int, seed, speed_or_all, window_length
from .diagnosers import COMPARED
from .errors import UsageError, reported
from .report import evaluation_report
from .rigs import TITLES, load_parts

_DESCRIPTION = """\
Compare the three diagnosers across shaft speeds: ALPIO, the paper's baseline; the extended-state
observer, its proposal as repaired; and the diagnoser that we recommend. Each is calibrated on
the first half of every recording of one speed and tested on the second half of every recording
of every speed. On the simulated rig each crack size is diagnosed by itself, with the normal
windows.
"""
#: The paper calibrates at this speed and shows confusion matrices at that one.
_SIMULATED_TRAIN_RPM, _SIMULATED_CONFUSION_RPM = 500.0, 400.0


def add_parser(subparsers):
    """Declare the command and its arguments."""
    parser = subparsers.add_parser(
        "evaluate", help="compare the diagnosers across speeds", description=_DESCRIPTION
    )
    parser.add_argument("--rig", choices=TITLES, default="simulated", help="default: simulated")
    parser.add_argument(
        "--data-home", type=Path, help="folder of the real rigs' files; default: scikit-learn's"
    )
    parser.add_argument(
        "--train-rpm",
        type=speed_or_all,
        metavar="RPM",
        help="speed to calibrate at, or all; default: 500 on the simulated rig, else all",
    )
    parser.add_argument(
        "--window-length", type=window_length, default=1200, metavar="N", help="default: 1200"
    )
    parser.add_argument(
        "--n-samples",
        type=positive_int,
        metavar="N",
        help="samples of a recording of the simulated rig; default: 120000",
    )
    parser.add_argument("--seed", type=seed, metavar="N", help="of the simulated rig; default: 0")
    parser.add_argument(
        "--n-jobs", type=job_count, default=-1, metavar="N", help="threads; default: all cores"
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("skarxlag-results"),
        metavar="FOLDER",
        help="for CSV and PNG; default: ./skarxlag-results",
    )
    parser.set_defaults(run=run, fail=parser.error)


def run(args):
    """Run the command."""
    try:
        args.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"argument --output: {error}") from error
    title = TITLES[args.rig]
    _progress(f"{title}: loading\n")
    parts = load_parts(args)
    train_speeds = _train_speeds(args, parts[0].rig.rpm)
    verdicts, fitted = _evaluate(parts, train_speeds, args.n_jobs)
    confusion_rpm = _SIMULATED_CONFUSION_RPM if args.rig == "simulated" else None
    tables = evaluation_report(verdicts, parts, title, confusion_rpm)
    blocks = [f"{table.title}\n{table.text}\n" for table in tables]
    text = "\n".join([_heading(args, title, parts), *blocks])
    print(text)
    with reported():
        _write_files(args, tables, verdicts, text)
        missing = figures.why_missing()
        if missing is None:
            figures.save_figures(verdicts, parts, fitted, title, confusion_rpm, _file(args))
    print(missing or "Accuracy, confusion matrices, residuals and trajectories are drawn as PNG.")
    print(f"{title}: tables (CSV) and figures (PNG) are in {args.output.resolve()}")
    return 0


def _train_speeds(args, rpm):
    speeds = np.unique(rpm).tolist()
    chosen = args.train_rpm
    if chosen is None:
        chosen = _SIMULATED_TRAIN_RPM if args.rig == "simulated" else "all"
    if chosen == "all":
        return speeds
    if chosen not in speeds:
        listed = ", ".join(f"{speed:g}" for speed in speeds)
        raise UsageError(f"argument --train-rpm: {chosen:g}, expected one of {listed}, or all")
    return [chosen]


def _evaluate(parts, train_speeds, n_jobs):
    """Verdicts on all tested windows, and the diagnosers of the first training speed."""
    frames, fitted = [], {}
    total = len(parts) * len(train_speeds) * len(COMPARED)
    for part in parts:
        rig = part.rig
        for train_rpm in train_speeds:
            splits = speed_splits(
                rig.rpm, train_rpm=train_rpm, recording=rig.recording, same_speed=True
            )
            for title, maker in COMPARED.values():
                started = perf_counter()
                number = 1 + len(frames) // len(splits)
                _progress(
                    f"[{number}/{total}] {title}{part.title}, calibrated at {train_rpm:g} rpm: "
                    "fitting,"
                )
                diagnoser = maker(healthy=rig.target_names[0], n_jobs=n_jobs)
                train = splits[0][0]
                with reported():
                    diagnoser.fit(rig.data[train], rig.target[train])
                crack = {} if part.crack_mm is None else {"crack_mm": part.crack_mm}
                constants = {"diagnoser": title, **crack, "train_rpm": train_rpm}
                _progress(" scoring")
                for _, test in splits:
                    _progress(f" {rig.rpm[test[0]]:g}")
                    frames.append(window_verdicts(diagnoser, rig, test, constants))
                _progress(f" rpm, {perf_counter() - started:.1f} s\n")
                if train_rpm == train_speeds[0]:
                    fitted[part.crack_mm, title] = diagnoser
    return pd.concat(frames, ignore_index=True), fitted


def _heading(args, title, parts):
    rig = parts[0].rig
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
    lines = [
        f"{title}: {len(rig.target_names)} conditions at {speeds} rpm, "
        f"windows of {args.window_length} samples at {rig.sampling_rate:g} Hz.",
        "Calibrated on first halves of recordings at one speed, tested on second halves.",
    ]
    if args.rig == "simulated":
        lines[0] += f" Seed {0 if args.seed is None else args.seed}."
        lines.append("These figures come from a simulation, not from measurements.")
    return "\n".join(lines) + "\n"


def _file(args):
    """Function from stem and suffix to the path of a file."""
    return lambda stem, suffix: args.output / f"{args.rig}_{stem}{suffix}"


def _write_files(args, tables, verdicts, text):
    path = _file(args)
    title = TITLES[args.rig]
    write_atomically(path("report", ".txt"), text.encode())
    verdicts = verdicts.assign(rig=title).set_index("rig")
    write_atomically(path("verdicts", ".csv"), verdicts.to_csv().encode())
    for table in tables:
        frame = pd.concat({title: table.frame}, names=["rig"])
        content = frame.to_csv(float_format="%.6g").encode()
        write_atomically(path(table.stem, ".csv"), content)


def _progress(text):
    print(text, end="", file=sys.stderr, flush=True)
