"""A warning points to the line of the user, however deep the estimator stands."""

import numpy as np
import pytest

from skarxlag import (
    ARXLaguerre,
    SensorFusion,
    StretchResidual,
    make_detector,
    make_diagnoser,
)

RNG = np.random.default_rng(0)
X, Y = RNG.normal(size=(40, 400)), np.repeat(["good", "worn"], 20)
X[20:] = X[20:].cumsum(axis=1)
RPM = np.tile([900.0, 1200.0], 20)


def step():
    rows = ARXLaguerre().fit_transform(X)
    compare = StretchResidual().fit(rows, Y, rpm=RPM)
    return lambda rpm: compare.transform(rows, rpm=rpm)


def pipeline(method):
    fitted = make_diagnoser(healthy="good").fit(X, Y, rpm=RPM)
    return lambda rpm: getattr(fitted, method)(X, rpm=rpm)


def fusion():
    fitted = SensorFusion(estimator=make_diagnoser(healthy="good")).fit(X, Y, rpm=RPM)
    return lambda rpm: fitted.predict_proba(X, rpm=rpm)


def detector():
    fitted = make_detector(false_alarm_rate=0.1).fit(X[:20], rpm=RPM[:20])
    return lambda rpm: fitted.predict(X, rpm=rpm)


@pytest.mark.parametrize(
    "make",
    [step, lambda: pipeline("predict"), lambda: pipeline("diagnose"), fusion, detector],
)
def test_a_warning_names_the_file_of_its_caller(make):
    ask = make()
    with pytest.warns(UserWarning) as caught:
        ask(15.0)
    assert {each.filename for each in caught} == {__file__}
