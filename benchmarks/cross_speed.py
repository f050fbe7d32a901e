"""Verdicts at shaft speeds that were not used for training, by ours and by peers.

First halves of the recordings train, second halves test, so nothing of a second half
enters a fit. "One speed" trains at one speed and tests at each other. "Others" trains at
all speeds but one and tests at that one. Training and test share the specimen and its
mounting.
"""

from functools import partial

import numpy as np

from benchmarks.peers import BATCH, PEERS, SLOW, WITH_TORQUE, OverOrders
from benchmarks.rigs import SIX_RIGS, read_rigs, rows_of
from benchmarks.tallies import tally, tally_probability
from skarxlag import make_alpio, make_diagnoser, make_extended_state_pio

#: Samples of a row, or None for a second.
LENGTHS = {"1200": 1200, "4800": 4800, "1 s": None}
#: Samples of the windows that vote on a row of a second, for methods of windows.
_VOTING = 1200
_LEAST = 1e-6
TRAINED = ("one speed", "others")
SIMULATED = ("simulated 3 mm", "simulated 6 mm")


def ours(train, tests, rate, *, states_speed=True, speed_error=0.0):
    """Yield verdicts and probabilities of make_diagnoser for each test set.

    Parameters
    ----------
    train : Rows
        Training rows.
    tests : iterable of Rows
        Test rows of one speed each.
    rate : float
        Sampling rate in Hz.
    states_speed : bool
        Whether `predict` receives the speed.
    speed_error : float
        Share by which the speeds of `predict` are wrong.
    """
    is_second = train.X.shape[-1] >= int(rate)
    diagnoser = make_diagnoser(sampling_rate=rate if is_second else None)
    diagnoser.fit(train.X, train.condition, rpm=train.rpm)
    for rows in tests:
        speeds = {"rpm": rows.rpm * (1 + speed_error)} if states_speed else {}
        probability = diagnoser.predict_proba(rows.X, **speeds)
        yield tally_probability(probability, diagnoser.classes_, rows.condition)


def ours_by_vote(train, tests, rate, *, make):
    """Yield verdicts of a diagnoser of windows, without a stated speed."""
    diagnoser = make().fit(train.X, train.condition)
    for rows in tests:
        yield tally(diagnoser.predict(rows.X), rows.condition)


def peer(train, tests, rate, *, make):
    """Yield verdicts of a peer; the windows of a row of a second vote by their evidence."""
    X, n = windows(train.X)
    classifier = make().fit(X, np.repeat(train.condition, n))
    for rows in tests:
        X, n = windows(rows.X)
        total = evidence(classifier, X).reshape(len(rows.X), n, -1).sum(axis=1)
        yield tally(classifier.classes_[total.argmax(axis=1)], rows.condition)


def peer_with_speed(train, tests, rate, *, make):
    """Yield verdicts of a peer that receives the speed."""
    X, n = windows(train.X)
    y, rpm = np.repeat(train.condition, n), np.repeat(train.rpm, n)
    classifier = make().fit(X, y, rpm)
    for rows in tests:
        X, n = windows(rows.X)
        probability = classifier.predict_proba(X, np.repeat(rows.rpm, n))
        logs = np.log(np.maximum(probability, _LEAST)).reshape(len(rows.X), n, -1)
        verdict = classifier.classes_[logs.sum(axis=1).argmax(axis=1)]
        yield tally(verdict, rows.condition)


def windows(X):
    """Cut rows of a second into windows; shorter rows are one window each."""
    length = X.shape[-1] if X.shape[-1] <= LENGTHS["4800"] else _VOTING
    n = X.shape[-1] // length
    cut = X[..., : n * length].reshape(*X.shape[:-1], n, length)
    return np.moveaxis(cut, -2, 1).reshape(-1, *X.shape[1:-1], length), n


def evidence(classifier, X):
    """Return log probabilities, or else the decision function, or else votes."""
    if hasattr(classifier, "predict_proba"):
        return np.log(np.maximum(classifier.predict_proba(X), _LEAST))
    if hasattr(classifier, "decision_function"):
        decision = classifier.decision_function(X)
        return decision if decision.ndim == 2 else np.outer(decision, [-1, 1])
    return classifier.predict(X)[:, np.newaxis] == classifier.classes_


METHODS = {
    "make_diagnoser": ours,
    "make_diagnoser, speed not stated": partial(ours, states_speed=False),
    "make_extended_state_pio": partial(ours_by_vote, make=make_extended_state_pio),
    "make_alpio": partial(ours_by_vote, make=make_alpio),
    **{name: partial(peer, make=make) for name, make in (PEERS | BATCH | SLOW).items()},
    "spectrum over orders, with the speed + shrinkage LDA": partial(
        peer_with_speed, make=OverOrders
    ),
}
OURS = tuple(METHODS)[:4]
#: Methods of rows of a second only.
WRONG_SPEEDS = {
    f"make_diagnoser, speed {100 * error:+.0f} %": partial(ours, speed_error=error)
    for error in (0.03, -0.1)
}
#: Methods of the rig that has a torque.
SIMULATED_METHODS = {
    "make_diagnoser": ours,
    "make_extended_state_pio": METHODS["make_extended_state_pio"],
    "make_alpio": METHODS["make_alpio"],
    "log spectrum + shrinkage LDA": METHODS["log spectrum + shrinkage LDA"],
    **{name: partial(peer, make=make) for name, make in WITH_TORQUE.items()},
}


def splits(rows, trained):
    """Yield the speeds that train, and those that test, of one protocol."""
    speeds = np.unique(rows.rpm)
    for speed in speeds:
        others = speeds[speeds != speed]
        yield (([speed], others) if trained == "one speed" else (others, [speed]))


def lines(
    home=None,
    rigs=(*SIX_RIGS, *SIMULATED),
    lengths=LENGTHS,
    methods=None,
    most_splits=None,
):
    """Yield the counts of each rig, length of rows, protocol, method and pair of speeds.

    Parameters
    ----------
    home : path or None
        Folder of the rigs.
    rigs, lengths, methods : sequence of str
        Those that are computed. None: all methods but the slow ones.
    most_splits : int or None
        Pairs of training and test speeds of each protocol, at most.
    """
    for rig in read_rigs(rigs, home):
        is_simulated = rig.name in SIMULATED
        for length in lengths:
            if is_simulated and length == "1 s":
                continue
            rows = rows_of(rig, LENGTHS[length] or int(rig.sampling_rate))
            known = SIMULATED_METHODS if is_simulated else METHODS
            known = known | (WRONG_SPEEDS if length == "1 s" else {})
            chosen = methods or [name for name in known if name not in SLOW]
            for name in (name for name in chosen if name in known):
                facts = {"rig": rig.name, "length": length, "method": name}
                for trained in TRAINED:
                    pairs = list(splits(rows, trained))[:most_splits]
                    for line in _of_method(known[name], rows, rig, pairs):
                        yield facts | {"trained at": trained} | line


def _of_method(method, rows, rig, pairs):
    for speeds, tested in pairs:
        train = rows[~rows.is_late & np.isin(rows.rpm, speeds)]
        tests = [rows[rows.is_late & (rows.rpm == speed)] for speed in tested]
        counts = method(train, tests, rig.sampling_rate)
        for speed, counted in zip(tested, counts, strict=True):
            trained_rpm = " ".join(f"{each:g}" for each in speeds)
            yield {"trained rpm": trained_rpm, "rpm": speed} | counted
