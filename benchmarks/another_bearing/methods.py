"""Methods that name fault locations: ours, with and without the bearing, and peers."""

import numpy as np
from sklearn.calibration import CalibratedClassifierCV
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.svm import SVC

from benchmarks.another_bearing.protocol import BEARINGS
from benchmarks.cross_speed.peers import log_spectrum, unit_rms
from skarxlag import make_diagnoser, make_fault_order_classifier
from skarxlag.core.fault_locations import FAULT_LOCATIONS


def fitted(rig, train, bearing=None, specimen=None):
    """Fit make_diagnoser and return a function from rows and speeds to location probabilities."""
    diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate, bearing=bearing)
    diagnoser.fit(train.X, train.condition, rpm=train.rpm, specimen=specimen)
    location = dict(zip(train.condition, train.location, strict=True))
    of_class = np.array([location[name] for name in diagnoser.classes_])

    def probabilities(X, rpm):
        logs = diagnoser.diagnose(X, rpm=rpm).log_probability
        return by_location(np.exp(logs[:, :-1]), of_class)

    return probabilities


def ours(rig, train, tests, bearing=None):
    """Yield the probabilities of locations by make_diagnoser for each test set."""
    probabilities = fitted(rig, train, bearing, train.specimen)
    for name, rows in tests.items():
        yield name, probabilities(rows.X, rows.rpm)


def with_bearing(rig, train, tests):
    """Yield the same with the bearing of the rig."""
    return ours(rig, train, tests, BEARINGS[rig.name])


def combs_alone(rig, train, tests):
    """Yield the probabilities by the orders of the bearing, with the limits of healthy rows."""
    options = {"bearing": BEARINGS[rig.name], "sampling_rate": rig.sampling_rate}
    healthy = train.location == "healthy"
    classifier = make_fault_order_classifier(**options)
    if healthy.any():
        labels = np.full(healthy.sum(), "healthy")
        classifier.fit(train.X[healthy], labels, rpm=train.rpm[healthy])
    else:
        classifier.fit(train.X)
    locations = set(train.location)
    for name, rows in tests.items():
        probability = classifier.predict_proba(rows.X, rpm=rows.rpm)
        by_classifier = by_location(probability, classifier.classes_)
        # The other methods cannot name locations that no row of the rig has, either.
        by_classifier *= [location in locations for location in FAULT_LOCATIONS]
        yield name, by_classifier / by_classifier.sum(axis=1, keepdims=True)


def _peer(classifier):
    def of_folds(rig, train, tests):
        spectra = FunctionTransformer(lambda X: log_spectrum(unit_rms(X)))
        fitted = make_pipeline(spectra, classifier()).fit(train.X, train.location)
        for name, rows in tests.items():
            yield name, by_location(fitted.predict_proba(rows.X), fitted.classes_)

    return of_folds


def by_location(probability, locations):
    """Sum the class probabilities of each location, in the order of `FAULT_LOCATIONS`."""
    return np.stack(
        [
            probability[:, locations == location].sum(axis=1)
            for location in FAULT_LOCATIONS
        ],
        axis=1,
    )


#: Functions from a rig, training rows and test rows to probabilities of the locations of
#: the rows.
METHODS = {
    "`make_diagnoser` with the bearing (ours)": with_bearing,
    "`make_diagnoser` (ours)": ours,
    "combs alone (ours)": combs_alone,
    "log spectrum + shrinkage LDA": _peer(
        lambda: LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")
    ),
    "log spectrum + SVM": _peer(
        lambda: CalibratedClassifierCV(
            make_pipeline(StandardScaler(), SVC(C=10.0)), cv=2, ensemble=False
        )
    ),
}
