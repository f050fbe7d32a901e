"""Compare make_diagnoser with peers on every rig, across speeds, with calibration errors.

Run ``python -m benchmarks.recipe targets`` from the root of the repository. First halves of the
recordings are for training and second halves for testing. "One speed" is trained at one speed and
tested at every other, "others" is trained at all speeds but one and tested at that one; each number
is the mean over the pairs. The folder of the rigs is ``$SKARXLAG_DATA``.
"""

import os
from functools import partial

import numpy as np
import pandas as pd

from benchmarks.cross_speed import peers
from benchmarks.cross_speed.command import check_installed
from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.recipe.calibration import expected_calibration_error
from benchmarks.recipe.rigs import real_rigs, simulated_rigs
from benchmarks.stretches.methods import WindowsVote
from skarxlag import make_diagnoser

#: Samples of a row; None means one second.
ROWS = {"windows of 1200": 1200, "windows of 4800": 4800, "stretches of 1 s": None}
STATED, UNSTATED = "make_diagnoser", "make_diagnoser, rpm not stated"
VOTE = "make_diagnoser, windows of 4800 vote"
PEERS = {
    "log spectrum + LDA": peers.spectrum_lda,
    "log spectrum + SVM": peers.spectrum_svm,
    "band energies + random forest": peers.bands_forest,
    "MiniRocket": peers.minirocket,
}


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
    X, y, rpm = [], [], []
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
    """Verdicts of the windows of a stretch, which add up their evidence."""

    class Stated:
        """make_diagnoser with the speed of the stretch."""

        def __init__(self):
            self.fitted = make_diagnoser()

        def fit(self, X, y):
            self.fitted.fit(X, y, rpm=np.repeat(train[2], len(X) // len(train[0])))
            self.classes_ = self.fitted.classes_
            return self

        def predict_proba(self, X):
            n = len(X) // len(test[0])
            return self.fitted.predict_proba(X, rpm=np.repeat(test[2], n))

        def predict(self, X):
            return self.classes_[self.predict_proba(X).argmax(axis=1)]

    voting = WindowsVote(Stated, 4800).fit(*train)
    return voting.predict(test[0], test[2]), None


def of_peer(make, train, test):
    """Verdicts of a peer; of stretches those of its windows of 1200."""
    if train[0].shape[-1] > 4800:
        return WindowsVote(make, 1200).fit(*train).predict(test[0], test[2]), None
    return make().fit(train[0], train[1]).predict(test[0]), None


def scores(rig, kinds, methods):
    """Yield a row for each method, kind of rows, protocol and pair of speeds."""
    for kind in kinds:
        length = ROWS[kind] or int(rig.sampling_rate)
        for protocol, trained, tested in folds(rig):
            train, test = (
                rows_of(rig, length, half, speeds) for half, speeds in enumerate((trained, tested))
            )
            for method in methods:
                if method == VOTE and ROWS[kind] is not None:
                    continue
                verdict, confidence = _verdicts(method, train, test, rig, kind)
                for speed in tested:
                    at = test[2] == speed
                    yield {
                        "rig": rig.name,
                        "rows": kind,
                        "trained at": protocol,
                        "method": method,
                        "rpm": speed,
                        "right": np.mean(verdict[at] == test[1][at]),
                        "verdicts": verdict[at] == test[1][at],
                        "confidence": None if confidence is None else confidence[at],
                    }


def _verdicts(method, train, test, rig, kind):
    if method == VOTE:
        return of_votes(train, test)
    if method in PEERS:
        return of_peer(PEERS[method], train, test)
    rate = rig.sampling_rate if ROWS[kind] is None else None
    return of_ours(train, test, rate, method == STATED)


def accuracy_table(found):
    """Mean accuracy over pairs: a row for each kind, protocol and method, a column for each rig."""
    table = found.pivot_table(
        index=["rows", "trained at", "method"], columns="rig", values="right", sort=False
    )
    return table.reset_index()


def calibration_table(found):
    """Expected calibration error over all pairs, where probabilities are stated."""
    rows = {}
    keys = ["rows", "trained at", "rig"]
    for key, group in found[found.method == STATED].groupby(keys, sort=False):
        confidence, right = (np.concatenate(list(group[n])) for n in ("confidence", "verdicts"))
        rows[key] = expected_calibration_error(confidence, right)
    index = pd.MultiIndex.from_tuples(rows, names=keys)
    return pd.Series(rows.values(), index).unstack("rig", sort=False).reset_index()


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "targets")
    parser.add_argument("--rig", nargs="*", help="names of rigs; default: all and the simulated")
    parser.add_argument("--rows", nargs="*", default=list(ROWS), choices=list(ROWS))
    parser.add_argument("--no-peers", action="store_true")
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    methods = [STATED, UNSTATED, VOTE]
    if not options.no_peers:
        check_installed(PEERS)
        methods += PEERS
    rigs = list(real_rigs(options.rig, options.data_home))
    sources = [partial(scores, rig, options.rows, methods) for rig in rigs]
    if options.rig is None:
        windows = [kind for kind in options.rows if ROWS[kind] is not None]
        sources += [partial(scores, rig, windows, methods) for rig in simulated_rigs()]
    found = []
    for source in sources:
        found += source()
        table = pd.DataFrame(found)
        table.drop(columns=["verdicts", "confidence"]).to_csv(
            options.output / "pairs.csv", index=False, float_format="%.4f"
        )
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
