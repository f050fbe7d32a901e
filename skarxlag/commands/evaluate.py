"""``skarxlag evaluate``: calibrate at one speed, test at every speed."""

import argparse
import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
from sklearn.utils import Bunch
from sklearn.utils.metadata_routing import get_routing_for_object

from .._files import write_atomically
from ..accuracy_tables import scored_windows
from ..datasets import FETCHERS, simulate_rig
from ..model_selection import SpeedSplit
from . import figures
from .arguments import add_execution_arguments, positive_int, seed, speed_or_all, window_length
from .messages import CommandError, Progress, UsageError, add_progress_arguments, as_command_error
from .models import DIAGNOSERS
from .own_rig import evaluate_table
from .report import why_no_figures
from .tables import evaluation_report
from .workers import WorkerDied, executors, run_tasks

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
    parser.add_argument("--rig", choices=TITLES, default="simulated", help="default: simulated")
    parser.add_argument(
        "--data-home", type=Path, help="folder of the real rigs' files; default: scikit-learn's"
    )
    parser.add_argument(
        "--train-rpm",
        type=speed_or_all,
        metavar="RPM",
        help="speed of the calibration, or all; default: all, on the simulated rig 500",
    )
    parser.add_argument(
        "--window-length",
        type=window_length,
        metavar="N",
        help="default: 1200; of a table 4800, if the recordings are long enough",
    )
    parser.add_argument(
        "--n-samples",
        type=positive_int,
        metavar="N",
        help=f"samples of a recording of the simulated rig; default: {_N_SAMPLES}",
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


@dataclass(frozen=True)
class RigSource:
    """Arguments of a rig, small enough to be sent to a worker.

    Parameters
    ----------
    name : str
        Key of `TITLES`.
    window_length : int
        Samples in a window.
    data_home : Path or None, default=None
        Folder of a real rig's files.
    crack_mm : float or None, default=None
        Crack size of the faulty windows of the simulated rig.
    n_samples : int, default=120000
        Samples in a recording of the simulated rig.
    seed : int, default=0
        Seed of the simulated rig.
    """

    name: str
    window_length: int
    data_home: Path | None = None
    crack_mm: float | None = None
    n_samples: int = _N_SAMPLES
    seed: int = 0

    @property
    def title(self) -> str:
        """Title of the rig in tables and figures."""
        crack = "" if self.crack_mm is None else f", crack {self.crack_mm:g} mm"
        return f"{TITLES[self.name]}{crack}"

    @property
    def stem(self) -> str:
        """First part of the names of its files."""
        return self.name if self.crack_mm is None else f"{self.name}_{self.crack_mm:g}mm"


@lru_cache(maxsize=len(_CRACKS_MM))
def load_rig(source: RigSource) -> Bunch:
    """Load or simulate a rig, once in a process."""
    if source.name == "simulated":
        return simulate_rig(
            crack_mm=source.crack_mm,
            n_samples=source.n_samples,
            window_length=source.window_length,
            random_state=source.seed,
        )
    fetch = FETCHERS[source.name]
    return fetch(data_home=source.data_home, window_length=source.window_length)


@dataclass(frozen=True)
class Trial:
    """A diagnoser, calibrated at one speed of a rig and tested at every speed.

    Parameters
    ----------
    rig : RigSource
        The rig.
    train_rpm : float
        Speed of the calibration.
    diagnoser : str
        Key of `DIAGNOSERS`.
    n_jobs : int
        Number of threads.
    """

    rig: RigSource
    train_rpm: float
    diagnoser: str
    n_jobs: int

    def __str__(self) -> str:
        title, _ = DIAGNOSERS[self.diagnoser]
        return f"{self.rig.title}: {title}, calibrated at {self.train_rpm:g} rpm"

    def __call__(self) -> Bunch:
        """Return ``verdicts`` on the second halves, the fitted ``diagnoser`` and ``seconds``."""
        rig = load_rig(self.rig)
        started = perf_counter()
        splitter = SpeedSplit(train_rpm=self.train_rpm, same_speed=True)
        groups = np.column_stack([rig.rpm, rig.recording])
        splits = list(splitter.split(rig.data, groups=groups))
        title, make = DIAGNOSERS[self.diagnoser]
        diagnoser = make(healthy=rig.target_names[0], n_jobs=self.n_jobs)
        takes_rpm = get_routing_for_object(diagnoser).consumes("fit", ["rpm"])
        train = splits[0][0]
        speeds = {"rpm": rig.rpm[train]} if takes_rpm else {}
        diagnoser.fit(rig.data[train], rig.target[train], **speeds)
        constants = {"diagnoser": title, "train_rpm": self.train_rpm}
        frames = [scored_windows(diagnoser, rig, test, constants) for _, test in splits]
        return Bunch(
            verdicts=pd.concat(frames, ignore_index=True),
            diagnoser=diagnoser,
            seconds=perf_counter() - started,
        )


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    try:
        args.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"argument --output: {error}") from error
    if args.table is not None:
        return evaluate_table(args)
    args.window_length = args.window_length or _WINDOW_LENGTH
    if not args.quiet:
        print(f"{TITLES[args.rig]}: loading", file=sys.stderr, flush=True)
    trials = [
        Trial(source, speed, name, 1)
        for source in _sources(args)
        for speed in _train_speeds(args, _loaded(source).rpm)
        for name in DIAGNOSERS
    ]
    outcomes = _outcomes(args, trials)
    missing = why_no_figures()
    text = []
    for source in dict.fromkeys(trial.rig for trial in trials):
        own = {trial: outcomes[trial] for trial in trials if trial.rig == source}
        verdicts = pd.concat([each.verdicts for each in own.values()], ignore_index=True)
        rig = load_rig(source)
        tables = evaluation_report(verdicts, rig.target_names, source.title)
        text.append("\n".join([_heading(source, rig), *(table.text for table in tables)]))
        print(text[-1])
        with as_command_error():
            _write_tables(args.output / source.stem, tables, verdicts.assign(rig=source.title))
            if missing is None:
                # ALPIO has one observer for each model, whose residuals can be drawn.
                drawn = next(out for trial, out in own.items() if trial.diagnoser == "alpio")
                figures.save_figures(
                    verdicts, rig, drawn.diagnoser, source.title, args.output / source.stem
                )
    with as_command_error():
        path = args.output / f"{args.rig}_report.txt"
        write_atomically(path, "\n".join(text).encode())
    drawn = "accuracy, confusion matrices, signals, identification, detection, residuals"
    print(missing or f"Drawn as PNG: {drawn}.")
    print(f"{TITLES[args.rig]}: tables (CSV) and figures (PNG) are in {args.output.resolve()}")
    return 0


def _sources(args):
    """Return the rigs that the arguments name: one for each crack size of the simulated rig."""
    if args.rig != "simulated":
        for name in ("n_samples", "seed"):
            if getattr(args, name) is not None:
                option = "--" + name.replace("_", "-")
                raise UsageError(f"argument {option}: only for the simulated rig, not {args.rig}")
        # A worker may run in another folder.
        home = None if args.data_home is None else args.data_home.absolute()
        return [RigSource(args.rig, args.window_length, home)]
    if args.data_home is not None:
        raise UsageError("argument --data-home: the simulated rig reads no files")
    n_samples = args.n_samples or _N_SAMPLES
    # A tail that fills no window is not simulated.
    n_samples -= n_samples % args.window_length
    return [
        RigSource("simulated", args.window_length, None, crack, n_samples, args.seed or 0)
        for crack in _CRACKS_MM
    ]


def _loaded(source):
    """Load a rig whose recordings can be halved."""
    try:
        with as_command_error(OSError):
            rig = load_rig(source)
    except ValueError as error:
        # The files of a fetcher are the original ones, so only the window length can be wrong.
        raise UsageError(f"argument --window-length: {error}") from error
    if np.unique(rig.recording, return_counts=True)[1].min() < 2:
        raise UsageError(
            f"argument --window-length: {source.window_length}, expected at most half of the "
            "shortest recording"
        )
    return rig


def _train_speeds(args, rpm):
    speeds = np.unique(rpm).tolist()
    wanted = args.train_rpm or ("all" if args.rig != "simulated" else _SIMULATED_RPM)
    if wanted == "all":
        return speeds
    if wanted not in speeds:
        listed = ", ".join(f"{speed:g}" for speed in speeds)
        raise UsageError(f"argument --train-rpm: {wanted:g}, expected {listed}, or all")
    return [wanted]


def _heading(source, rig):
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
    simulated = "Simulated, not measured. " if source.name == "simulated" else ""
    return (
        f"{source.title}: {len(rig.target_names)} conditions at {speeds} rpm, "
        f"windows of {source.window_length} samples at {rig.sampling_rate:g} Hz.\n{simulated}"
        "Calibrated on first halves of recordings at one speed, tested on second halves.\n"
    )


def _outcomes(args, trials):
    """Return the outcomes by trial."""
    outcomes = dict.fromkeys(trials)
    with as_command_error(), executors(args) as workers:
        if not (args.processes or args.dask):
            n_jobs = max(workers.count() // len(trials), 1)
            tasks = [Trial(each.rig, each.train_rpm, each.diagnoser, n_jobs) for each in trials]
        else:
            tasks = trials
        with Progress(len(trials), "fits", args) as progress:
            for place, outcome in run_tasks(tasks, workers):
                if isinstance(outcome, WorkerDied):
                    raise CommandError(f"{trials[place]}: every process for it died")
                outcomes[trials[place]] = outcome
                progress.step(f"{trials[place]}: {outcome.seconds:.1f} s")
    return outcomes


def _write_tables(stem, tables, verdicts):
    frames = {table.stem: table.frame for table in tables}
    for name, frame in (frames | {"verdicts": verdicts.set_index("rig")}).items():
        content = frame.to_csv(float_format="%.6g" if name in frames else None)
        write_atomically(Path(f"{stem}_{name}.csv"), content.encode())
