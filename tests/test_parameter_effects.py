"""Every public parameter of every estimator changes what it computes."""

import numpy as np
import pytest

from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    FaultDetector,
    KnownConditions,
    LogSpectra,
    PIObserver,
    SpectralDistance,
    ThresholdLadder,
)


def trajectory(estimator, X, y):
    return estimator.fit(X, y).observe(X).residual


def levels(estimator, X, y):
    return estimator.fit(X, y).transform(X)


def distances(estimator, X, y):
    return levels(estimator, LogSpectra().fit_transform(X), y)


def thresholds(estimator, X, y):
    fitted = estimator.fit(np.abs(X[:, :1]) + y[:, np.newaxis], y)
    return np.array([fitted.detection_threshold_])


OBSERVER_EFFECTS = {
    "pole": ({}, 0.8, levels),
    "kp": ({}, 0.7, levels),
    "ki": ({}, 0.3, levels),
    "n_observers": ({}, 4, levels),
    "evaluation": ({}, "switching_gain", levels),
    "sliding_slope": ({"evaluation": "switching_gain"}, 0.2, levels),
    "adaptation_step": ({"evaluation": "switching_gain"}, 0.3, levels),
    "boundary_layer": ({}, 2.0, trajectory),
}
SINGLE = {"n_observers": 1}


def log_p_values(estimator, X, y):
    fitted = estimator.fit(X, rpm=1000)
    new = X[::-1] + 3 * np.roll(X, 5, axis=1)
    return fitted.decision_function(new, rpm=1000)


ALARM_EFFECTS = {"false_alarm_rate": ({}, 0.5, thresholds)}
EFFECTS = {
    ARXLaguerre: {
        "order": ({}, 8, levels),
        "pole": ({}, 0.6, levels),
        "alpha": ({}, 100.0, levels),
        "bank": ({}, False, levels),
        "healthy": ({}, 1, levels),
        "unit_rms": ({}, False, levels),
        "forgetting_factor": ({}, 0.5, levels),
    },
    PIObserver: OBSERVER_EFFECTS,
    ExtendedStatePIObserver: {
        name: (SINGLE | base, value, effect)
        for name, (base, value, effect) in OBSERVER_EFFECTS.items()
    }
    | {
        **{name: OBSERVER_EFFECTS[name] for name in ("pole", "kp", "ki")},
        "evaluation": (SINGLE, "power", levels),
        "adaptation_step": ({}, 0.3, levels),
        "n_observers": ({}, 32, levels),
        "saturation": ({}, 0.3, levels),
    },
    LogSpectra: {
        "spectrum_order": ({}, 16, levels),
    },
    SpectralDistance: {
        "smooth_drift": ({}, 1.0, distances),
        "rough_drift": ({}, 0.1, distances),
        "frequency_drift": ({}, 1.0, distances),
    },
    ThresholdLadder: ALARM_EFFECTS | {"healthy": ({}, 1, thresholds)},
    FaultDetector: {
        "false_alarm_rate": ({}, 0.5, log_p_values),
        "fixed_gain": ({}, True, log_p_values),
        "window_length": ({}, 400, log_p_values),
    },
    KnownConditions: {
        "false_rejection_rate": ({}, 0.5, log_p_values),
        "window_length": ({}, 400, log_p_values),
    },
}


@pytest.mark.filterwarnings("ignore:20 healthy rows are too few:UserWarning")
@pytest.mark.filterwarnings("ignore:20 rows of condition known are too few:UserWarning")
@pytest.mark.filterwarnings("ignore:All .* have one speed:UserWarning")
@pytest.mark.parametrize(
    ("estimator", "name"),
    [(estimator, name) for estimator, effects in EFFECTS.items() for name in effects],
)
def test_every_parameter_has_an_effect(estimator, name):
    base, value, output = EFFECTS[estimator][name]
    # Quiet, coloured and with a trend, so that no part of an observer idles.
    X = np.cumsum(np.random.default_rng(0).normal(size=(20, 1200)), axis=1)
    y = np.arange(20) % 2
    before = output(estimator(**base), X, y)
    after = output(estimator(**base | {name: value}), X, y)
    assert (
        before.shape != after.shape
        or np.abs(before - after).max() > 1e-6 * np.abs(before).max()
    )


@pytest.mark.parametrize("estimator", EFFECTS)
def test_no_parameter_is_left_out(estimator):
    tested = set(EFFECTS[estimator])
    assert tested | {"n_jobs"} >= set(estimator().get_params())
