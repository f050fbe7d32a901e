"""``skarxlag evaluate``: train at some speeds, test at others."""

import argparse
from pathlib import Path

import pandas as pd
from joblib import parallel_config
from sklearn.model_selection import check_cv

from .._answers import requests
from .._files import write_atomically
from ..datasets import FETCHERS
from ..model_selection import cross_speed_predict
from .arguments import (
    FACTS,
    add_source_arguments,
    job_count,
    option,
    positive_int,
    refuse,
    speed_or_all,
    window_length,
)
from .evaluation_cases import N_SAMPLES, TITLES, own_case, rig_cases
from .evaluation_reports import report, save_figure
from .messages import Progress, UsageError, add_progress_arguments, as_command_error
from .report import why_no_figures

_DESCRIPTION = """\
Compare the three diagnosers across shaft speeds: ALPIO, the baseline of Piltan and Kim (2019); the
extended-state observer, their proposal as repaired; and the recommended diagnoser. Each is
calibrated on the first half of every recording of one speed and tested on the second half of every
recording of every speed. The paper's own protocol is python -m benchmarks.paper.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.description = _DESCRIPTION
    text = "csv table of your own recordings with the columns path, condition and rpm, or a folder "
    text += "or glob: make_diagnoser and two other methods with one speed in training and with one "
    text += "left out. Recordings of one value of the column campaign are not split between "
    text += "training and test"
    parser.add_argument("table", nargs="?", type=Path, help=text)
    parser.add_argument("--rig", choices=TITLES, default="simulated", help="default: simulated")
    text = "folder of a real rig's files; default: scikit-learn's"
    option(parser, "--data-home", text, Path, "FOLDER")
    text = "speed of the calibration on a rig, or all; default: all, on the simulated rig 500"
    option(parser, "--train-rpm", text, speed_or_all, "RPM")
    text = "default: 1200; of a table 4800, if the recordings are long enough"
    option(parser, "--window-length", text, window_length)
    text = f"samples of a recording of the simulated rig; default: {N_SAMPLES}"
    option(parser, "--n-samples", text, positive_int)
    text = "of a table: the first N channels are sensors, see fit"
    option(parser, "--outputs", text, positive_int)
    option(parser, "--n-jobs", "threads; default: all cores", job_count)
    option(parser, "--output", "default: skarxlag-results", Path, "FOLDER")
    add_progress_arguments(parser)
    add_source_arguments(parser, "a folder or glob")
    parser.set_defaults(n_jobs=-1, output=Path("skarxlag-results"), run=run, fail=parser.error)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    is_rig = args.table is None
    if is_rig:
        unfit = "n_samples" if args.rig in FETCHERS else "data_home"
        refuse(args, [*FACTS, "outputs", unfit], f"not allowed with --rig {args.rig}")
    else:
        refuse(args, ["data_home", "n_samples", "train_rpm"], "not allowed with a table")
    if args.output.exists() and not args.output.is_dir():
        raise UsageError(f"argument --output: {args.output} is a file, expected a folder")
    cases = rig_cases(args) if is_rig else [own_case(args)]
    texts, n_fits = [], sum(len(case.methods) for case in cases)
    with as_command_error(), Progress(n_fits, "diagnosers", args) as progress:
        args.output.mkdir(parents=True, exist_ok=True)
        for case in cases:
            verdicts = _verdicts(case, args.n_jobs, progress)
            text, tables = report(case, verdicts)
            texts.append(text)
            if why_no_figures() is None:
                save_figure(case, verdicts, args.output)
            for name, table in (tables | {"verdicts": verdicts}).items():
                content = table.to_csv(float_format="%.6g").encode()
                write_atomically(args.output / f"{case.stem}_{name}.csv", content)
        stem = args.rig if is_rig else cases[0].stem
        write_atomically(args.output / f"{stem}_report.txt", "\n".join(texts).encode())
    print(*texts, sep="\n")
    print(why_no_figures() or "Drawn as PNG: accuracy and confusion matrices.")
    print(f"Report, tables and figures are in {args.output.resolve()}")
    return 0


def _verdicts(case, n_jobs, progress):
    """Return a row for each window of each test, and each diagnoser."""
    rig, frames = case.rig, {}
    speeds = rig.get("speeds", rig.rpm)
    splits = [(split.train, split.test) for split in case.splits]
    for name, diagnoser in case.methods.items():
        params = {"rpm": speeds} if requests(diagnoser, "predict", "rpm") else {}
        with parallel_config("threading", n_jobs=n_jobs):
            frames[name] = cross_speed_predict(
                diagnoser, rig.data, rig.target, groups=rig.rpm, cv=check_cv(splits), params=params
            )
        progress.step(f"{case.title}: {name}")
    verdicts = pd.concat(frames, names=["diagnoser", None]).reset_index("diagnoser")
    columns = pd.DataFrame(case.splits)[["protocol", "train_rpm"]]
    verdicts = verdicts.join(columns, on="split").set_index("window")
    rows = pd.DataFrame({name: rig[name] for name in ("rpm", "recording", "start")})
    return verdicts.join(rows.rename(columns={"rpm": "test_rpm"})).reset_index(drop=True)
