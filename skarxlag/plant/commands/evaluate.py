"""Run ``skarxlag evaluate``: compare the diagnosers on a rig or on recordings of a table."""

import argparse
from collections import Counter
from importlib.util import find_spec

import pandas as pd
from joblib import Parallel, delayed, parallel_config
from sklearn.base import clone

from ...core.capabilities import offers, requests
from ...core.files import write_atomically
from . import evaluation_summary, evaluation_tables, messages
from .evaluation_cases import Case, rig_cases, table_case
from .messages import as_command_error
from .progress_bar import ProgressBar


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    missing = why_no_figures()
    with as_command_error():
        cases = [*rig_cases(args)] if args.table is None else [table_case(args)]
        args.output.mkdir(parents=True, exist_ok=True)
        progress = messages.Progress(sum(len(case.methods) for case in cases), args)
        bar = ProgressBar(_work(cases), args)
        summaries = []
        texts = []
        for case in cases:
            verdicts = case_verdicts(case, args.n_jobs, progress, bar)
            across_speeds = verdicts[verdicts["protocol"].isin(case.protocols)]
            summaries.append(evaluation_summary.summary(verdicts))
            if missing is None:
                evaluation_tables.save_figure(case, across_speeds, args.output)
            files = {"verdicts": verdicts, "protocols": summaries[-1]}
            tables = evaluation_tables.case_tables(case, across_speeds)
            for name, (title, table) in tables.items():
                texts.append(evaluation_tables.as_text(f"{case.title}: {title}", table))
                files[name] = table
            for name, table in files.items():
                content = table.to_csv(float_format="%.6g").encode()
                write_atomically(args.output / f"{case.stem}_{name}.csv", content)
            bar.advance("tables", len(case.rig.data))
        summary = evaluation_tables.summary_text(cases, summaries)
        stem = args.rig if args.table is None else cases[0].stem
        report = "\n".join([summary, "", *texts])
        write_atomically(args.output / f"{stem}_report.txt", report.encode())
        bar.clear()
    # A summary whose tables cannot be written is not printed.
    print(summary, flush=True)
    print(missing or "Drawn as PNG: accuracy and confusion matrices.")
    print(f"Report, tables and figures are in {args.output.resolve()}")
    return 0


def why_no_figures() -> str | None:
    """Return why no figures can be drawn, or None if they can."""
    if find_spec("matplotlib") is None:
        return "No figures: they need matplotlib, pip install 'skarxlag[plot]'."
    return None


def _work(cases):
    """Return the rows that each diagnoser is fitted on and tested with, and those in tables."""
    work: Counter[str] = Counter()
    for case in cases:
        n_rows = sum(len(split.train) + len(split.test) for split in case.splits)
        work.update(dict.fromkeys(case.methods, n_rows))
        work["tables"] += len(case.rig.data)
    return work


def case_verdicts(
    case: Case, n_jobs: int | None, progress: messages.Progress, bar: ProgressBar
) -> pd.DataFrame:
    """Return a row for each window of each test, and each diagnoser.

    Parameters
    ----------
    case : Case
        The case.
    n_jobs : int or None
        Threads.
    progress : Progress
        Counts the diagnosers.
    bar : ProgressBar
        Counts the rows.

    Returns
    -------
    DataFrame
        As `evaluation_summary.summary` takes it, also with ``split``, ``recording`` and
        ``start``.
    """
    frames = []
    for name, diagnoser in case.methods.items():
        with parallel_config("threading", n_jobs=n_jobs):
            tests = Parallel(return_as="generator")(
                delayed(_test)(clone(diagnoser), case, split) for split in case.splits
            )
            for number, (split, frame) in enumerate(
                zip(case.splits, tests, strict=True)
            ):
                facts = frame.assign(
                    diagnoser=name,
                    split=number,
                    protocol=split.protocol,
                    train_rpm=split.train_rpm,
                )
                frames.append(facts)
                bar.advance(name, len(split.train) + len(split.test))
        bar.clear()
        progress.step(f"{case.title}: {name}")
        bar.show()
    rows = pd.DataFrame(
        {
            "test_rpm": case.rig.rpm,
            "recording": case.rig.recording,
            "start": case.rig.start,
            "specimen": case.specimens,
        }
    )
    return pd.concat(frames).join(rows).reset_index(drop=True)


def _test(diagnoser, case, split):
    """Fit a diagnoser on the training of a split, and return its verdicts on the test."""
    params = {"rpm": case.speeds, "specimen": case.rig.get("specimen")}

    def metadata(method, rows):
        return {
            name: values[rows]
            for name, values in params.items()
            if values is not None and requests(diagnoser, method, name)
        }

    X = case.rig.data
    y = case.rig.target
    diagnoser.fit(X[split.train], y[split.train], **metadata("fit", split.train))
    tested = X[split.test]
    true = y[split.test]
    if offers(diagnoser, "diagnose"):
        diagnosis = diagnoser.diagnose(tested, **metadata("predict", split.test))
        predicted = diagnosis.verdict
        probability = diagnosis.probability
    else:
        predicted = diagnoser.predict(tested)
        probability = diagnoser.predict_proba(tested)
    locations = evaluation_summary.location_columns(
        true, diagnoser.classes_, probability
    )
    verdicts = {"true": true, "predicted": predicted} | locations
    return pd.DataFrame(verdicts, index=split.test)
