"""Run ``skarxlag evaluate``: compare diagnosers on a rig or on your recordings."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, scale

from ... import diagnosers
from ...core.validation import output_of_windows
from ...datasets import load_public_rig, simulate_rig
from ...decisions.fusion import SensorFusion
from ...kernels.speed_references import group_speeds
from ...model_selection import (
    PROTOCOLS,
    Split,
    evaluate,
    evaluation_summary,
    protocol_splits,
)
from ...persistence.files import write_atomically
from ..readers.entries import ListedRecording
from .messages import Reporter, UsageError, as_command_error, keywords, speeds_as_text
from .results import csv_of
from .training_rows import training_rows

#: Crack sizes of the simulated rig, and the speed of its calibration.
_CRACKS_MM = (3.0, 6.0)
_SIMULATED_RPM = 500.0
#: Printed columns, in percent of rows.
_COLUMNS = ["condition", "location", "recordings", "false alarms", "missed"]
#: Points by which another method has to be better to be named.
_LEAST_LEAD = 1.0
#: Segments of the log spectrum of the peer.
_SEGMENT = 256
ALPIO = "ALPIO, the paper's baseline"
PROPOSAL = "the paper's proposal"
RECOMMENDED = "make_diagnoser, recommended"
PEER = "log spectrum and LDA"


@dataclass(frozen=True)
class Case:
    """Rows of one evaluation, the diagnosers to compare, and the splits.

    Parameters
    ----------
    title : str
        What the rows are.
    methods : dict of str to estimator
        Diagnosers to compare.
    splits : list of Split
        Tests.
    X : ndarray of shape (n_rows, ...)
        Rows.
    y : ndarray of shape (n_rows,)
        Conditions.
    facts : DataFrame
        As `protocol_splits` takes it.
    sampling_rate : float
        In Hz.
    params : dict of str to ndarray
        Metadata of the rows.
    sentences : list of str
        What is not measured, and what the reader has to know.
    """

    title: str
    methods: dict[str, Any]
    splits: list[Split]
    X: NDArray[Any]
    y: NDArray[Any]
    facts: pd.DataFrame
    sampling_rate: float
    params: dict[str, Any]
    sentences: list[str]


def run(args: argparse.Namespace) -> int:
    """Run the command with parsed arguments."""
    with as_command_error():
        if args.table is not None:
            cases = [table_case(**keywords(table_case, args))]
        elif args.dataset is not None:
            cases = [public_case(**keywords(public_case, args))]
        else:
            cases = [*simulated_cases(**keywords(simulated_cases, args))]
        evaluate_cases(cases, **keywords(evaluate_cases, args))
    return 0


def evaluate_cases(
    cases: Sequence[Case],
    output: Path,
    *,
    n_jobs: int | None = None,
    reporter: Reporter | None = None,
) -> None:
    """Evaluate cases, print their summaries, and write tables.

    Parameters
    ----------
    cases : sequence of Case
        The cases.
    output : Path
        Folder of the results; it is made.
    n_jobs : int or None, default=None
        Threads.
    reporter : Reporter or None, default=None
        Progress reporter that counts the fits. None prints nothing.
    """
    output.mkdir(parents=True, exist_ok=True)
    reporter = reporter or Reporter()
    reporter.start(sum(len(case.methods) * len(case.splits) for case in cases))
    lines = []
    for case in cases:
        verdicts = evaluate(
            case.methods,
            case.X,
            case.y,
            case.facts,
            splits=case.splits,
            params=case.params,
            n_jobs=n_jobs,
            note=lambda name, n_rows: reporter.step(
                f"{name}: fitted and tested with {n_rows} rows"
            ),
        )
        summary = evaluation_summary(verdicts)
        lines += _summary_lines(case, summary)
        stem = re.sub("[^a-z0-9]+", "_", Path(case.title).stem.lower())
        tables = {"verdicts": verdicts.set_index("row"), "summary": summary}
        for name, table in tables.items():
            content = csv_of(table, index=True, float_format="%.6g").encode()
            write_atomically(output / f"{stem}_{name}.csv", content)
    lines += dict.fromkeys(text for case in cases for text in case.sentences)
    text = "\n".join(lines)
    write_atomically(output / "report.txt", f"{text}\n".encode())
    # A summary whose tables cannot be written is not printed.
    print(text, f"Tables are in {output.resolve()}.", sep="\n", flush=True)


def _summary_lines(case, summary):
    """Yield the data, and a table for each protocol."""
    trained = {split.train_rpm for split in case.splits if split.train_rpm > 0}
    n_conditions = len(set(case.y.tolist()))
    seconds = case.X.shape[-1] / case.sampling_rate
    yield (
        f"{case.title}: {n_conditions} conditions at "
        f"{speeds_as_text(np.unique(case.facts['rpm']))} rpm, trained at "
        f"{speeds_as_text(sorted(trained)) or 'several'} rpm."
    )
    yield (
        f"A row has {case.X.shape[-1]} samples, {1e3 * seconds:.4g} ms, so 1 % of false "
        f"alarms are {36 / seconds:.3g} an hour. Chance is {100 / n_conditions:.1f} %."
    )
    yield (
        "Percent of rows with the right condition and the right location, of recordings "
        "with the right location, of healthy rows called faulty, and of faults missed:"
    )
    for protocol in summary.index.unique("protocol"):
        table = summary.loc[protocol].reindex(case.methods, columns=_COLUMNS)
        yield PROTOCOLS[protocol]
        yield table.rename_axis(None).to_string(
            float_format="{:.1f}".format, na_rep="-"
        )
    shares = summary["location"].groupby("estimator").mean()
    if shares.max() > shares[RECOMMENDED] + _LEAST_LEAD:
        yield f"Here, {shares.idxmax()} is right more often than {RECOMMENDED}."
    yield ""


def simulated_cases(
    *, n_samples: int | None = None, window_length: int | None = None
) -> Iterator[Case]:
    """Yield a case of the simulated rig for each size of the crack, trained as in the paper.

    The first halves of the recordings train, and the second halves test.

    Parameters
    ----------
    n_samples : int or None, default=None
        Samples of a recording. None: 120 000.
    window_length : int or None, default=None
        Samples in a window. None: 1200, as in the paper.
    """
    length = window_length or 1200
    # A tail that fills no window is not simulated.
    n_windows = max((n_samples or 120_000) // length, 2)
    for crack in _CRACKS_MM:
        rig = simulate_rig(
            crack_mm=crack,
            n_samples=n_windows * length,
            window_length=length,
            as_frame=True,
        )
        yield _rig_case(
            rig,
            f"Simulated rig, crack {crack:g} mm",
            ["speed"],
            _SIMULATED_RPM,
            "Results on a simulated rig are no evidence about a real machine.",
        )


def public_case(
    dataset: str,
    *,
    data_home: Path | None = None,
    channel: str | None = None,
    where: str | None = None,
    window_length: int | None = None,
) -> Case:
    """Return the case of a public rig, trained at each of its speeds.

    The first halves of the recordings train, and the second halves test.

    Parameters
    ----------
    dataset, channel, where
        As `skarxlag.datasets.load_public_rig` takes them.
    data_home : Path or None, default=None
        Its `root`.
    window_length : int or None, default=None
        Samples in a window. None: 1200.

    Raises
    ------
    UsageError
        If a recording has fewer than two windows.
    """
    rig = load_public_rig(
        dataset,
        root=data_home,
        channel=channel,
        where=where,
        window_length=window_length or 1200,
        as_frame=True,
    )
    if rig.frame["recording"].value_counts().min() < 2:
        raise UsageError(
            f"argument --window-length: {rig.data.shape[-1]}, expected at most half of "
            "the shortest recording"
        )
    return _rig_case(rig, f"Data set {dataset}", tuple(PROTOCOLS))


def _rig_case(rig, title, protocols, train_rpm=None, *sentences):
    """Return the case of a rig whose first halves train and whose second halves test."""
    splits, unmeasured = protocol_splits(
        rig.target,
        rig.frame,
        halves=True,
        window_length=rig.data.shape[-1],
        protocols=protocols,
    )
    healthy = rig.target_names[0]
    methods = {
        ALPIO: diagnosers.make_alpio(healthy=healthy),
        PROPOSAL: diagnosers.make_extended_state_pio(healthy=healthy),
        RECOMMENDED: diagnosers.make_diagnoser(healthy=healthy),
    }
    return Case(
        title,
        methods,
        [split for split in splits if train_rpm in (None, split.train_rpm)],
        rig.data,
        rig.target,
        rig.frame,
        rig.sampling_rate,
        {"rpm": rig.rpm, "specimen": rig.specimen},
        [*sentences, *unmeasured],
    )


def table_case(
    table: Path,
    recordings: list[ListedRecording],
    *,
    bearing: str | None = None,
    window_length: int | None = None,
    outputs: int | None = None,
    reporter: Reporter | None = None,
) -> Case:
    """Return the case of the recordings of a table: what ``skarxlag fit`` would save.

    The rows are those of ``skarxlag fit``. Recordings that are tested are never those
    of the training. If the table has a column ``campaign``, neither are their campaigns
    across speeds.

    Parameters
    ----------
    table : Path
        The table, folder or glob.
    recordings : list of ListedRecording
        Its recordings.
    bearing : str or None, default=None
        As in ``skarxlag fit``.
    window_length : int or None, default=None
        Samples in a window. None: rows as long as the recordings allow.
    outputs : int or None, default=None
        Channels that are sensors.
    reporter : Reporter or None, default=None
        Counts the recordings that are read.

    Raises
    ------
    UsageError
        If the table lacks speeds or conditions, or if none can be left out.
    """
    rows = training_rows(
        recordings, table, window_length=window_length, reporter=reporter
    )
    if not {"condition", "rpm"} <= {*rows.facts}:
        raise UsageError(f"{table}: needs the columns condition and rpm")
    rows = rows.with_signal(table, outputs or 1)
    facts = rows.facts
    # Recordings of varying speed are left out by their mean speed.
    rpm = facts.get("mean_rpm", facts["rpm"])
    log_speeds, group = group_speeds(np.log(rpm.to_numpy()))
    facts = facts.assign(rpm=np.exp(log_speeds).round(1)[group])
    sentences = []
    if "campaign" not in facts:
        sentences.append(
            "The table has no column campaign. If nothing was remounted between "
            "training and test, the shares may be too high."
        )
    y = rows.y
    splits, unmeasured = protocol_splits(y, facts, window_length=rows.X.shape[-1])
    if not splits or len(set(y)) < 2:
        conditions = ", ".join(map(str, sorted(set(y))))
        raise UsageError(
            f"{table}: conditions {conditions} at "
            f"{speeds_as_text(np.unique(facts['rpm']))} rpm; expected at least two of "
            f"each, and that one can be left out. {' '.join(unmeasured)}"
        )
    rate = rows.sampling_rate
    compares_orders = bearing is not None or rows.word == "stretches"
    diagnoser = diagnosers.make_diagnoser(
        sampling_rate=rate if compares_orders else None, bearing=bearing
    )
    if outputs is not None:
        diagnoser = SensorFusion(estimator=diagnoser, n_outputs=outputs)
    spectra = FunctionTransformer(log_spectrum)
    methods = {
        RECOMMENDED: diagnoser,
        PEER: make_pipeline(spectra, LinearDiscriminantAnalysis()),
    }
    params = {"specimen": y} | rows.metadata
    sentences += unmeasured
    return Case(str(table), methods, splits, rows.X, y, facts, rate, params, sentences)


def log_spectrum(X: NDArray[Any]) -> NDArray[Any]:
    """Compute the log power spectrum of the output at unit RMS, by Welch's method.

    Parameters
    ----------
    X : ndarray of shape (n_rows, n_samples) or (n_rows, n_channels, n_samples)
        Rows.

    Returns
    -------
    ndarray of shape (n_rows, n_bands)
        Natural logarithms.
    """
    y = scale(output_of_windows(X), axis=1)
    power = welch(y, nperseg=_SEGMENT, axis=1)[1][:, 1:]
    return np.log(power + np.finfo(float).tiny)
