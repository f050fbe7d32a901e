"""Methods that name the place of rows: ours, with and without the bearing, and peers."""

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
    """Fit make_diagnoser; return its function from rows and speeds to probabilities of places."""
    diagnoser = make_diagnoser(sampling_rate=rig.sampling_rate, bearing=bearing)
    diagnoser.fit(train.X, train.condition, rpm=train.rpm, specimen=specimen)
    place = dict(zip(train.condition, train.place, strict=True))
    of_class = np.array([place[name] for name in diagnoser.classes_])

    def probabilities(X, rpm):
        logs = diagnoser.diagnose(X, rpm=rpm).log_probability
        return by_place(np.exp(logs[:, :-1]), of_class)

    return probabilities


def ours(rig, train, tests, bearing=None):
    """Yield the probabilities of places by make_diagnoser for each test set."""
    probabilities = fitted(rig, train, bearing, train.specimen)
    for name, rows in tests.items():
        yield name, probabilities(rows.X, rows.rpm)


def with_bearing(rig, train, tests):
    """Yield the same with the bearing of the rig."""
    return ours(rig, train, tests, BEARINGS[rig.name])


def combs_alone(rig, train, tests):
    """Yield the probabilities by the orders of the bearing, with the limits of healthy rows."""
    options = {"bearing": BEARINGS[rig.name], "sampling_rate": rig.sampling_rate}
    healthy = train.place == "healthy"
    classifier = make_fault_order_classifier(**options)
    if healthy.any():
        labels = np.full(healthy.sum(), "healthy")
        classifier.fit(train.X[healthy], labels, rpm=train.rpm[healthy])
    else:
        classifier.fit(train.X)
    places = set(train.place)
    for name, rows in tests.items():
        probability = classifier.predict_proba(rows.X, rpm=rows.rpm)
        known = by_place(probability, classifier.classes_)
        # Places that no row of the rig has are no answer for the other methods, either.
        known *= [place in places for place in FAULT_LOCATIONS]
        yield name, known / known.sum(axis=1, keepdims=True)


def _peer(classifier):
    def of_folds(rig, train, tests):
        spectra = FunctionTransformer(lambda X: log_spectrum(unit_rms(X)))
        fitted = make_pipeline(spectra, classifier()).fit(train.X, train.place)
        for name, rows in tests.items():
            yield name, by_place(fitted.predict_proba(rows.X), fitted.classes_)

    return of_folds


def by_place(probability, places):
    """Sum the probabilities of the classes of each place, in the order of `FAULT_LOCATIONS`."""
    return np.stack(
        [probability[:, places == place].sum(axis=1) for place in FAULT_LOCATIONS],
        axis=1,
    )


#: Functions from a rig, training rows and test rows to probabilities of the places of
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
