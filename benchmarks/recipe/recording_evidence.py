"""Compare two ways to diagnose a recording by the rows that it is cut into.

Run ``python -m benchmarks.recipe recording-evidence`` from the root of the repository;
the folder of the rigs is ``$SKARXLAG_DATA``.

`make_diagnoser` is fitted on some recordings, and each of the others gets one verdict.
"Sum" adds the log probabilities of its rows, with the effective number of rows of
`skarxlag.kernels.evidence`. "Mean residuals" asks the questions once, about the mean
log residuals of its rows (`ConditionClassifier.join`). There, noise counts as that of
the effective number of rows, for several correlations of rows. Only real rigs choose:
the correlation is the one with the least log loss on all rigs but one, and it is
reported for that rig. Answers on a rig are kept in a csv file in the output folder and
are not computed again.
"""

import os
import warnings
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import log_softmax

from benchmarks.another_bearing import protocol
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.recipe.calibration import expected_calibration_error
from benchmarks.recipe.rigs import SAME_BEARING, real_rigs
from benchmarks.recipe.targets import ROWS, folds, rows_of
from skarxlag import make_diagnoser
from skarxlag.core.fault_locations import location_of_label
from skarxlag.kernels.evidence import (
    CORRELATION,
    SMALLEST_PROBABILITY,
    effective_number,
)
from skarxlag.kernels.posterior import decided

#: Correlations of the noise of two rows. That in use is the first.
CORRELATIONS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
SUM = "sum"
SAME, ANOTHER = "same bearing, other speed", "another bearing, rows of 1 s"


class Answer(NamedTuple):
    """Verdict of one way on one recording.

    Parameters
    ----------
    right : bool
        Whether the verdict is the true answer.
    confidence : float
        Its probability.
    loss : float
        Negative natural logarithm of the probability of the true answer.
    """

    right: bool
    confidence: float
    loss: float


def answer(log_probability, decide, groups, true):
    """Return the answer by the log probabilities of a recording.

    Parameters
    ----------
    log_probability : array of shape (n_classes + 1,)
        Of the conditions, and of an unknown one.
    decide : ConditionClassifier
        The classifier.
    groups : sequence of str of length n_classes
        The answer that each class stands for.
    true : str
        The true answer.
    """
    shares = decided(log_probability[np.newaxis], decide.classes_, *decide.questions())
    probability = pd.Series(shares["probability"][0]).groupby(list(groups)).sum()
    verdict = groups[int(shares["probability"][0].argmax())]
    loss = -np.log(max(probability.get(true, 0.0), SMALLEST_PROBABILITY))
    return Answer(verdict == true, float(probability[verdict]), float(loss))


def answers(diagnosed, decide, groups, true):
    """Yield the name of each way, and its answer for the rows of a recording.

    Parameters
    ----------
    diagnosed : Bunch
        Result of `diagnose` for the rows.
    decide, groups, true
        As in `answer`.
    """
    n_rows = len(diagnosed.log_probability)
    floor = np.log(SMALLEST_PROBABILITY)
    mean = np.maximum(diagnosed.log_probability, floor).mean(axis=0)
    logs = log_softmax(effective_number(n_rows, CORRELATION) * mean)
    yield SUM, answer(logs, decide, groups, true)
    mean = diagnosed.row_evidence.mean(axis=0, keepdims=True)
    for correlation in CORRELATIONS:
        joined = decide.join(mean, effective_number(n_rows, correlation))
        logs = joined.log_probability[0]
        yield str(correlation), answer(logs, decide, groups, true)


def other_speeds(rig, kind):
    """Yield the answers for the second halves at speeds that were not fitted at.

    Parameters
    ----------
    rig : Rig
        As `real_rigs` yields it.
    kind : str
        A name in `ROWS`.
    """
    length = ROWS[kind] or int(rig.sampling_rate)
    sampling_rate = rig.sampling_rate if ROWS[kind] is None else None
    for _, trained, tested in folds(rig):
        X, y, rpm = rows_of(rig, length, 0, trained)
        with warnings.catch_warnings(action="ignore"):
            diagnoser = make_diagnoser(sampling_rate=sampling_rate).fit(X, y, rpm=rpm)
        decide = diagnoser["decide"]
        classes = decide.classes_.tolist()
        for recording in rig.recordings:
            if recording.rpm not in tested:
                continue
            one = rig._replace(recordings=[recording])
            X, _, rpm = rows_of(one, length, 1, tested)
            diagnosis = diagnoser.diagnose(X, rpm=rpm)
            yield from answers(diagnosis, decide, classes, recording.condition)


def other_bearings(rig):
    """Yield the answers for recordings of specimens that were left out.

    Parameters
    ----------
    rig : Rig
        As `real_rigs` yields it. Rigs without several specimens yield nothing.
    """
    for fold in protocol.folds(rig):
        tests = {k: v for k, v in fold.tests.items() if k != protocol.SAME_BEARING}
        if not tests:
            continue
        train = fold.train
        diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate)
        diagnoser.fit(train.X, train.condition, rpm=train.rpm)
        decide = diagnoser["decide"]
        of_condition = dict(zip(train.condition, train.location, strict=True))
        groups = [of_condition[name] for name in decide.classes_]
        for rows in tests.values():
            facts = zip(rows.condition, rows.rpm, rows.load, strict=True)
            labels = pd.factorize(pd.Series(list(facts)))[0]
            for label in range(labels.max() + 1):
                recording = rows[labels == label]
                true = recording.location[0]
                # A location without any training row cannot be named.
                if location_of_label(true) is None or true not in groups:
                    continue
                diagnosis = diagnoser.diagnose(recording.X, rpm=recording.rpm)
                yield from answers(diagnosis, decide, groups, true)


def frame(rig):
    """Return a row for each answer on the recordings of a rig."""
    kinds = ROWS if rig.name in SAME_BEARING else ()
    sources = {f"{SAME}, {kind}": other_speeds(rig, kind) for kind in kinds}
    sources[ANOTHER] = other_bearings(rig)
    rows = [
        {"rig": rig.name, "test": test, "way": way} | answer_of_way._asdict()
        for test, source in sources.items()
        for way, answer_of_way in source
    ]
    return pd.DataFrame(rows)


def chosen_correlation(results):
    """Return the correlation with the least log loss: mean over both tests of each rig."""
    is_same = results["test"] != ANOTHER
    losses = results.groupby(["way", results["rig"], is_same])["loss"].mean()
    by_way = losses.groupby(level=0).mean().drop(SUM)
    return float(by_way.idxmin())


def table(results):
    """Tabulate both ways for each test and rig, with the choice of the other rigs."""
    rows = []
    is_another = results["test"] == ANOTHER
    for title, of_test in {
        SAME: results[~is_another],
        ANOTHER: results[is_another],
    }.items():
        left_out = []
        for rig, of_rig in of_test.groupby("rig", sort=False):
            correlation = chosen_correlation(results[results["rig"] != rig])
            chosen = of_rig[of_rig["way"].isin([SUM, str(correlation)])]
            left_out.append(chosen)
            facts = {"test": title, "rig": rig, "correlation": correlation}
            rows.append(facts | summary(chosen))
        rows.append({"test": title, "rig": "all"} | summary(pd.concat(left_out)))
    return pd.DataFrame(rows)


def summary(chosen):
    """Return number of recordings, accuracy, calibration error and log loss of both ways."""
    is_sum = chosen["way"] == SUM
    entries = {"recordings": int(is_sum.sum())}
    for name, rows in {
        "sum": chosen[is_sum],
        "mean residuals": chosen[~is_sum],
    }.items():
        error = expected_calibration_error(rows["confidence"], rows["right"])
        entries[f"accuracy, {name}"] = rows["right"].mean()
        entries[f"error, {name}"] = error
        entries[f"log loss, {name}"] = rows["loss"].mean()
    return entries


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "recording-evidence")
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    names = dict.fromkeys([*SAME_BEARING, *protocol.BEARINGS])
    frames = []
    for rig in real_rigs(names, home=options.data_home):
        path = options.output / f"{rig.name}.csv"
        if not path.exists():
            frame(rig).to_csv(path, index=False)
        frames.append(pd.read_csv(path))
    results = pd.concat(frames)
    text = (
        f"{len(CORRELATIONS)} correlations of the noise of rows were scored; all rigs "
        f"choose {chosen_correlation(results):g}, and a row has the choice of the other "
        "rigs. *Same bearing*: the condition of second halves at the speeds that were "
        "not fitted at, with rows of 1200 samples, 4800 samples and 1 s; training and "
        "test share the specimen and its mounting. *Another bearing*: the fault "
        "location of recordings of left-out specimens. *Error*: expected calibration "
        "error, 10 bins."
    )
    publish(options, {"recording evidence": f"{text}\n\n{markdown(table(results))}"})
