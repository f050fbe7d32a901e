"""``skarxlag evaluate``: calibrate at one speed, test at every speed."""

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from .._files import write_atomically
from ..paper.protocol import joined_outcomes
from . import figures
from .arguments import add_execution_arguments, positive_int, seed, speed_or_all, window_length
from .diagnosers import DIAGNOSERS, LADDERS
from .errors import CommandError, UsageError, as_command_error
from .paper_report import paper_heading, paper_report
from .progress import Progress, add_progress_arguments
from .report import evaluation_report
from .rigs import TITLES, load_parts
from .runner import WorkerDied, executors, run_tasks
from .trials import PaperTrial, Trial

_DESCRIPTION = """\
Compare the three diagnosers across shaft speeds: ALPIO, the paper's baseline; the extended-state
observer, its proposal as repaired; and the diagnoser that we recommend. On the simulated rig this
fills Tables 2-9 of the paper under its protocol, with the paper's printed figures beside ours:
calibrated on all windows at 500 rpm, tested on all windows at every speed. On a real rig each is
calibrated on the first half of every recording of one speed and tested on the second half of
every recording of every speed.
"""
#: The paper shows confusion matrices at this speed.
_PAPER_CONFUSION_RPM = 400.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    parser.add_argument("--rig", choices=TITLES, default="simulated", help="default: simulated")
    parser.add_argument(
        "--data-home", type=Path, help="folder of the real rigs' files; default: scikit-learn's"
    )
    parser.add_argument(
        "--train-rpm",
        type=speed_or_all,
        metavar="RPM",
        help="speed to calibrate at on a real rig, or all; default: all",
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
    parser.add_argument(
        "--ladder",
        choices=LADDERS,
        help="on the simulated rig: a bank of residuals, one for each condition (default), or the "
        "paper's single residual, of the healthy condition's model",
    )
    parser.add_argument("--seed", type=seed, metavar="N", help="of the simulated rig; default: 0")
    add_execution_arguments(parser)
    add_progress_arguments(parser)
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("skarxlag-results"),
        metavar="FOLDER",
        help="for CSV and PNG; default: ./skarxlag-results",
    )
    parser.set_defaults(run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    try:
        args.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"argument --output: {error}") from error
    title = TITLES[args.rig]
    say = _nothing if args.quiet else _progress
    say(f"{title}: loading\n")
    parts = load_parts(args)
    fill = _paper_tables if args.rig == "simulated" else _speed_tables
    heading, tables, verdicts, fitted = fill(args, parts)
    text = "\n".join([heading, *(table.text for table in tables)])
    print(text)
    with as_command_error():
        _write_files(args, tables, verdicts, text)
        missing = figures.why_missing()
        if missing is None:
            confusion_rpm = _PAPER_CONFUSION_RPM if args.rig == "simulated" else None
            figures.save_figures(verdicts, parts, fitted, title, confusion_rpm, _file(args))
    drawn = "accuracy, confusion matrices, signals, identification, detection, residuals"
    print(missing or f"Drawn as PNG: {drawn}.")
    print(f"{title}: tables (CSV) and figures (PNG) are in {args.output.resolve()}")
    return 0


def _paper_tables(args, parts):
    """The paper's tables, its protocol applied to the parts of the simulated rig."""
    ladder = "bank" if args.ladder is None else args.ladder
    names = [(part, title) for part in parts for title in LADDERS[ladder]]
    outcomes = _outcomes(
        args,
        [f"{title}, crack {part.crack_mm:g} mm" for part, title in names],
        lambda n_jobs: [PaperTrial(part.source, ladder, title, n_jobs) for part, title in names],
    )
    outcome = joined_outcomes(outcomes)
    heading = paper_heading(parts[0].rig, ladder, 0 if args.seed is None else args.seed)
    return heading, paper_report(outcome), outcome.verdicts, outcome.fitted


def _speed_tables(args, parts):
    """Every pair of speeds of a real rig."""
    (part,) = parts
    rig = part.rig
    verdicts, fitted = _speed_pairs(args, part, _train_speeds(args, rig.rpm))
    title = TITLES[args.rig]
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
    heading = (
        f"{title}: {len(rig.target_names)} conditions at {speeds} rpm, "
        f"windows of {args.window_length} samples at {rig.sampling_rate:g} Hz.\n"
        "Calibrated on first halves of recordings at one speed, tested on second halves.\n"
    )
    return heading, evaluation_report(verdicts, rig.target_names, title), verdicts, fitted


def _train_speeds(args, rpm):
    speeds = np.unique(rpm).tolist()
    if args.train_rpm in (None, "all"):
        return speeds
    if args.train_rpm not in speeds:
        listed = ", ".join(f"{speed:g}" for speed in speeds)
        raise UsageError(f"argument --train-rpm: {args.train_rpm:g}, expected {listed}, or all")
    return [args.train_rpm]


def _speed_pairs(args, part, train_speeds):
    """Verdicts on all tested windows, and the diagnosers of the first training speed."""
    names = [(train_rpm, name) for train_rpm in train_speeds for name in DIAGNOSERS]
    outcomes = _outcomes(
        args,
        [f"{DIAGNOSERS[name][0]}, calibrated at {train_rpm:g} rpm" for train_rpm, name in names],
        lambda n_jobs: [Trial(part.source, *each, n_jobs) for each in names],
    )
    fitted = {
        (None, DIAGNOSERS[name][0]): outcome.diagnoser
        for (train_rpm, name), outcome in zip(names, outcomes, strict=True)
        if train_rpm == train_speeds[0]
    }
    return pd.concat([outcome.verdicts for outcome in outcomes], ignore_index=True), fitted


def _outcomes(args, names, make_trials):
    """What comes of trials, in order, on whatever workers there are."""
    outcomes = [None] * len(names)
    with as_command_error(), executors(args) as workers:
        is_elsewhere = args.processes or args.dask is not None
        trials = make_trials(1 if is_elsewhere else max(workers.count() // len(names), 1))
        with Progress(len(names), "fits", args) as progress:
            for place, outcome in run_tasks(trials, workers):
                if isinstance(outcome, WorkerDied):
                    raise CommandError(f"{names[place]}: every process for it died")
                outcomes[place] = outcome
                progress.step(f"{names[place]}: {outcome.seconds:.1f} s")
    return outcomes


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
        content = table.frame.to_csv(float_format="%.6g").encode()
        write_atomically(path(table.stem, ".csv"), content)


def _progress(text):
    print(text, end="", file=sys.stderr, flush=True)


def _nothing(text):
    """Progress for those who want none."""
