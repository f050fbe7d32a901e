"""Fault locations on another bearing, at the same and at other speeds and loads.

Rows are 1 s long. A fold leaves one specimen of each location out of the training: a
size of a fault (CWRU), an arc (HIT-SM) or a bearing of each class (Paderborn). The rest
trains at one speed and load, on the first halves of the recordings: at the slowest and
at the fastest setting in turn. A location with one specimen is never left out.
"""

from functools import partial

import numpy as np
from sklearn.ensemble import RandomForestClassifier

from benchmarks.fault_orders import order_contrasts
from benchmarks.peers import log_spectrum, of_features, shrinkage_lda, unit_rms
from benchmarks.rigs import SPECIMEN_RIGS, read_rigs, rows_of
from benchmarks.tallies import tally_probability
from skarxlag import make_diagnoser, make_fault_order_classifier

SAME = "same bearing, other speed"
ANOTHER = "another bearing, same speed"
ANOTHER_SPEED = "another bearing, other speed"
ANOTHER_LOAD = "another bearing, other load"
LOCATIONS = np.array(["ball", "healthy", "inner", "outer"])


def folds(rig, most_settings=2, length=None):
    """Yield the number of each fold, its setting, training rows, and test rows by protocol.

    Rows have `length` samples, by default a second.
    """
    rows = rows_of(rig, length or int(rig.sampling_rate))
    specimens = {
        location: np.unique(rows.specimen[rows.location == location])
        for location in np.unique(rows.location)
    }
    several = [names for names in specimens.values() if len(names) > 1]
    for number in range(-1, max(map(len, several), default=0)):
        left = [names[number] for names in several if 0 <= number < len(names)]
        is_left = np.isin(rows.specimen, left)
        settings = sorted(set(zip(rows.rpm.tolist(), rows.load.tolist(), strict=True)))
        for rpm, load in (settings[0], settings[-1])[:most_settings]:
            at_speed = rows.rpm == rpm
            at = at_speed & (rows.load == load)
            tests = {
                ANOTHER: is_left & at,
                ANOTHER_SPEED: is_left & ~at_speed,
                ANOTHER_LOAD: is_left & at_speed & ~at,
                SAME: ~at_speed & rows.is_late & (number < 0),
            }
            tests = {name: rows[test] for name, test in tests.items() if test.any()}
            setting = f"{rpm:g} rpm {load}".strip()
            if tests:
                yield number, setting, rows[at & ~is_left & ~rows.is_late], tests


def by_location(probability, locations):
    """Sum the class probabilities of each location, in the order of `LOCATIONS`."""
    columns = [probability[:, locations == name].sum(axis=1) for name in LOCATIONS]
    return np.stack(columns, axis=1)


def diagnoser(rig, train, *, with_bearing, n_specimens=None, **settings):
    """Return a function from rows to location probabilities of make_diagnoser."""
    if n_specimens:
        train = train[_first_specimens(train, n_specimens)]
    bearing = rig.bearing if with_bearing else None
    fitted = make_diagnoser(sampling_rate=rig.sampling_rate, bearing=bearing)
    fitted.set_params(**settings)
    names = [f"{c} {s}" for c, s in zip(train.condition, train.specimen, strict=True)]
    fitted.fit(train.X, names, rpm=train.rpm, specimen=train.specimen)
    location = dict(zip(names, train.location, strict=True))
    of_class = np.array([location[name] for name in fitted.classes_])

    def probabilities(rows):
        logs = fitted.diagnose(rows.X, rpm=rows.rpm).log_probability
        return by_location(np.exp(logs[:, :-1]), of_class)

    return probabilities


def _first_specimens(train, n_specimens):
    keep = np.zeros(len(train.X), dtype=bool)
    for location in np.unique(train.location):
        here = train.location == location
        names = np.unique(train.specimen[here])[:n_specimens]
        keep |= here & np.isin(train.specimen, names)
    return keep


def combs_alone(rig, train):
    """Return probabilities by the orders of the bearing, without recorded faults."""
    fitted = make_fault_order_classifier(
        bearing=rig.bearing, sampling_rate=rig.sampling_rate
    )
    is_healthy = train.location == "healthy"
    if is_healthy.any():
        labels = train.location[is_healthy]
        fitted.fit(train.X[is_healthy], labels, rpm=train.rpm[is_healthy])
    else:
        fitted.fit(train.X)
    is_known = np.isin(LOCATIONS, train.location)

    def probabilities(rows):
        probability = fitted.predict_proba(rows.X, rpm=rows.rpm)
        named = by_location(probability, fitted.classes_) * is_known
        return named / named.sum(axis=1, keepdims=True)

    return probabilities


def peer(rig, train, *, make):
    """Return probabilities by a classifier of spectra."""
    fitted = make().fit(train.X, train.location)
    return lambda rows: by_location(fitted.predict_proba(rows.X), fitted.classes_)


def forest_of_orders(rig, train):
    """Return probabilities by a forest of log spectra and the bearing's order contrasts."""

    def features(rows):
        contrasts = order_contrasts(rows.X, rows.rpm, rig.sampling_rate, rig.bearing)
        return np.hstack([log_spectrum(unit_rms(rows.X)), contrasts])

    forest = RandomForestClassifier(random_state=0).fit(features(train), train.location)
    return lambda rows: by_location(
        forest.predict_proba(features(rows)), forest.classes_
    )


def largest_contrast(rig, train):
    """Return votes for the location with the largest order contrast; nothing is trained."""
    faults = np.array(["ball", "inner", "outer"])
    faults = faults[np.isin(faults, train.location)]

    def votes(rows):
        contrasts = order_contrasts(rows.X, rows.rpm, rig.sampling_rate, rig.bearing)
        known = contrasts[:, np.isin(["ball", "inner", "outer"], faults)]
        named = faults[known.argmax(axis=1)]
        return (named[:, np.newaxis] == LOCATIONS).astype(float)

    return votes


METHODS = {
    "make_diagnoser with the bearing": partial(diagnoser, with_bearing=True),
    "make_diagnoser": partial(diagnoser, with_bearing=False),
    "combs alone": combs_alone,
    "largest order contrast": largest_contrast,
    "order contrasts, spectra + forest": forest_of_orders,
    "log spectrum + shrinkage LDA": partial(
        peer, make=lambda: of_features(log_spectrum, shrinkage_lda())
    ),
    "log spectrum + random forest": partial(
        peer,
        make=lambda: of_features(log_spectrum, RandomForestClassifier(random_state=0)),
    ),
}
OURS = tuple(METHODS)[:3]
WITH_BEARING = tuple(METHODS)[:1] + tuple(METHODS)[2:5]
#: A variant of make_diagnoser with the bearing: fewer specimens.
ONE_SPECIMEN = "one bearing of each location"
VARIANTS = {ONE_SPECIMEN: partial(diagnoser, with_bearing=True, n_specimens=1)}


def lines(
    home=None,
    rigs=SPECIMEN_RIGS,
    methods=METHODS | VARIANTS,
    folds_kept=None,
    most_settings=2,
):
    """Yield the counts of each rig, method, fold, setting, protocol and location."""
    known = METHODS | VARIANTS
    for rig in read_rigs(rigs, home):
        for number, setting, train, tests in folds(rig, most_settings):
            if folds_kept is not None and number not in folds_kept:
                continue
            for method in methods:
                if method == ONE_SPECIMEN and SAME in tests:
                    continue
                judge = known[method](rig, train)
                for protocol, rows in tests.items():
                    facts = {"rig": rig.name, "method": method, "fold": number}
                    facts |= {"trained at": setting, "protocol": protocol}
                    probability = judge(rows)
                    for location in np.unique(rows.location):
                        here = rows.location == location
                        counts = tally_probability(
                            probability[here], LOCATIONS, rows.location[here]
                        )
                        yield facts | {"location": location} | counts
