"""Compare make_diagnoser with peers on every rig, across speeds, with calibration errors.

Run ``python -m benchmarks.recipe targets`` from the root of the repository. First
halves of the recordings are for training and second halves for testing. "One speed" is
trained at one speed and tested at every other, "others" is trained at all speeds but
one and tested at that one; each number is the mean over the pairs. Two peers receive
the speed, as `make_diagnoser` does. The folder of the rigs is ``$SKARXLAG_DATA``. The
verdicts of each rig, method and kind of rows are kept in a file of the folder
``--output``, and are not computed again until the code changes.
"""

import os
import sys
from functools import partial
from itertools import product

import numpy as np
import pandas as pd

from benchmarks.cross_speed import peers
from benchmarks.cross_speed.peers_with_speed import SpectrumWithSpeed
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.pages.kept import kept_or_computed
from benchmarks.recipe.calibration import expected_calibration_error
from benchmarks.recipe.rigs import real_rigs, simulated_rigs
from benchmarks.stretches.methods import WindowsVote
from skarxlag import make_diagnoser
from skarxlag.kernels.evidence import SMALLEST_PROBABILITY

#: Samples of a row; None means one second.
ROWS = {"windows of 1200": 1200, "windows of 4800": 4800, "stretches of 1 s": None}
STATED = "make_diagnoser"
UNSTATED = "make_diagnoser, rpm not stated"
VOTE = "make_diagnoser, windows of 4800 vote"
PEERS = {
    "log spectrum + shrinkage LDA": peers.spectrum_shrinkage_lda,
    "log spectrum + SVM": peers.spectrum_svm,
    "STFT percentiles + shrinkage LDA": peers.percentiles_lda,
    "STFT percentiles + shrinkage LDA, augmented": peers.percentiles_lda_augmented,
}
#: Peers that receive the speed in `fit` and in `predict`.
WITH_SPEED = {
    "log spectrum + shrinkage LDA, speed as a feature": SpectrumWithSpeed,
    "log spectrum over orders + shrinkage LDA": partial(
        SpectrumWithSpeed, over_orders=True
    ),
}
METHODS = [STATED, UNSTATED, *PEERS, *WITH_SPEED, VOTE]
#: Samples of the windows in a stretch that vote, of ours and of peers.
VOTING_WINDOW, PEER_WINDOW = 4800, 1200


def rows_of(rig, length, half, speeds):
    """Rows of one half of the recordings at some speeds: samples, conditions, speeds.

    Parameters
    ----------
    rig : Rig
        As `real_rigs` yields it.
    length : int
        Samples of a row.
    half : {0, 1}
        First or second half.
    speeds : collection of float
        Speeds of the recordings.
    """
    X = []
    y = []
    rpm = []
    for recording in rig.recordings:
        if recording.rpm not in speeds:
            continue
        middle = recording.samples.shape[-1] // 2
        part = recording.samples[..., middle * half : middle * (half + 1)]
        n = part.shape[-1] // length
        rows = part[..., : n * length].reshape(*part.shape[:-1], n, length)
        X.append(np.moveaxis(rows, -2, 0))
        y += n * [recording.condition]
        rpm += n * [recording.rpm]
    return np.concatenate(X), np.array(y), np.array(rpm)


def folds(rig):
    """Yield the name of the protocol, the training speeds and the test speeds."""
    speeds = sorted({recording.rpm for recording in rig.recordings})
    for speed in speeds:
        others = [each for each in speeds if each != speed]
        yield "one speed", [speed], others
        yield "others", others, [speed]


def of_ours(train, test, sampling_rate, stated):
    """Verdicts and probabilities of make_diagnoser, with or without the speed in `predict`."""
    X, y, rpm = train
    fitted = make_diagnoser(sampling_rate=sampling_rate).fit(X, y, rpm=rpm)
    probability = fitted.predict_proba(test[0], **({"rpm": test[2]} if stated else {}))
    return fitted.classes_[probability.argmax(axis=1)], probability.max(axis=1)


def of_votes(train, test):
    """Verdicts on stretches by the mean evidence of their windows."""
    X, y, rpm = train
    windows, n = _windows(X, VOTING_WINDOW)
    fitted = make_diagnoser().fit(windows, np.repeat(y, n), rpm=np.repeat(rpm, n))
    X, _, rpm = test
    windows, n = _windows(X, VOTING_WINDOW)
    evidence = fitted.diagnose(windows, rpm=np.repeat(rpm, n)).row_evidence
    means = evidence.reshape(len(X), n, -1).mean(axis=1)
    return fitted["decide"].join(means, n).verdict, None


def of_peer(make, train, test):
    """Verdicts of a peer; of stretches those of its windows of 1200."""
    if train[0].shape[-1] > 4800:
        return WindowsVote(make, PEER_WINDOW).fit(*train).predict(
            test[0], test[2]
        ), None
    return make().fit(train[0], train[1]).predict(test[0]), None


def of_peer_with_speed(make, train, test):
    """Verdicts of a peer that receives the speed; of stretches by the evidence of its windows."""
    length = PEER_WINDOW if train[0].shape[-1] > 4800 else train[0].shape[-1]
    (X, y, rpm), (X_test, _, rpm_test) = train, test
    windows, n = _windows(X, length)
    fitted = make().fit(windows, np.repeat(y, n), np.repeat(rpm, n))
    windows, n = _windows(X_test, length)
    probability = fitted.predict_proba(windows, np.repeat(rpm_test, n))
    logs = np.log(np.maximum(probability, SMALLEST_PROBABILITY))
    evidence = logs.reshape(len(X_test), n, -1).sum(axis=1)
    return fitted.classes_[evidence.argmax(axis=1)], None


def _windows(X, length):
    """Cut the output channel of rows into windows; their number in a row."""
    X = X[:, 0] if X.ndim == 3 else X
    n = X.shape[1] // length
    return X[:, : n * length].reshape(-1, length), n


def verdicts(rig, kind, method):
    """Return a frame with a row for each verdict of a method on one kind of rows of a rig.

    Returns
    -------
    DataFrame
        ``rig``, ``rows``, ``trained at``, ``method``, ``trained rpm``, ``rpm``,
        ``right`` and ``confidence``, NaN where no probability is stated.
    """
    length = ROWS[kind] or int(rig.sampling_rate)
    frames = []
    for protocol, trained, tested in folds(rig):
        train = rows_of(rig, length, 0, trained)
        test = rows_of(rig, length, 1, tested)
        verdict, confidence = _verdicts(method, train, test, rig, kind)
        columns = {
            "rig": rig.name,
            "rows": kind,
            "trained at": protocol,
            "method": method,
            "trained rpm": " ".join(f"{speed:g}" for speed in trained),
            "rpm": test[2],
            "right": (verdict == test[1]).astype(int),
            "confidence": np.nan if confidence is None else confidence,
        }
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames)


def _verdicts(method, train, test, rig, kind):
    if method == VOTE:
        return of_votes(train, test)
    if method in PEERS:
        return of_peer(PEERS[method], train, test)
    if method in WITH_SPEED:
        return of_peer_with_speed(WITH_SPEED[method], train, test)
    rate = rig.sampling_rate if ROWS[kind] is None else None
    return of_ours(train, test, rate, method == STATED)


def accuracy_table(scored):
    """Mean accuracy over pairs: a row for each kind, protocol and method, a column for each rig."""
    keys = ["rows", "trained at", "method", "rig"]
    of_pair = scored.groupby([*keys, "trained rpm", "rpm"], sort=False).right.mean()
    table = of_pair.groupby(keys, sort=False).mean().unstack("rig", sort=False)
    is_real = ~table.columns.str.startswith("simulated")
    table.insert(0, "mean of rigs", table.loc[:, is_real].mean(axis=1))
    return table.reset_index()


def calibration_table(scored):
    """Expected calibration error over all pairs, where probabilities are stated."""
    keys = ["rows", "trained at", "rig"]
    stated = scored[scored.method == STATED].groupby(keys, sort=False)
    errors = {
        key: expected_calibration_error(of.confidence, of.right) for key, of in stated
    }
    index = pd.MultiIndex.from_tuples(errors, names=keys)
    return pd.Series(errors.values(), index).unstack("rig", sort=False).reset_index()


def cells(methods, kinds):
    """Return the methods and kinds of rows that are scored: windows of windows do not vote."""
    return [
        (method, kind)
        for method, kind in product(methods, kinds)
        if method != VOTE or ROWS[kind] is None
    ]


def in_order(scored):
    """Sort verdicts as the tables list them."""
    order = {
        "rows": list(ROWS),
        "trained at": ["one speed", "others"],
        "method": METHODS,
    }
    ranks = {name: scored[name].map(values.index) for name, values in order.items()}
    return scored.iloc[
        pd.DataFrame(ranks).sort_values(list(order), kind="stable").index
    ]


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "targets")
    parser.add_argument(
        "--rig", nargs="*", help="names of rigs; default: all and the simulated"
    )
    parser.add_argument("--rows", nargs="*", default=list(ROWS), choices=list(ROWS))
    parser.add_argument("--method", nargs="*", default=METHODS, choices=METHODS)
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sources = [(rig, options.rows) for rig in real_rigs(options.rig, options.data_home)]
    if options.rig is None:
        windows = [kind for kind in options.rows if ROWS[kind] is not None]
        sources += [(rig, windows) for rig in simulated_rigs()]
    frames = []
    for rig, kinds in sources:
        for method, kind in cells(options.method, kinds):
            path = options.output / f"{rig.name}; {method}; {kind}.csv"
            compute = partial(verdicts, rig, kind, method)
            frames.append(kept_or_computed(path, "targets", compute))
            print(path.stem, file=sys.stderr, flush=True)
    table = in_order(pd.concat(frames, ignore_index=True))
    calibration = calibration_table(table)
    accuracy = accuracy_table(table)
    accuracy.to_csv(options.output / "accuracy.csv", index=False, float_format="%.4f")
    calibration.to_csv(options.output / "calibration.csv", index=False)
    parts = [
        "Accuracy, mean over pairs of different speeds.",
        markdown(accuracy),
        "Expected calibration error of `make_diagnoser`, 10 bins, all pairs of different speeds.",
        markdown(calibration),
    ]
    publish(options, {"targets": "\n\n".join(parts)})


if __name__ == "__main__":
    main()
