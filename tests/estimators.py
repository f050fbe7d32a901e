"""Every estimator with the parameters that are tested, and its outputs on noise."""

import numpy as np

import skarxlag
from skarxlag import make_detector, make_diagnoser
from skarxlag.core.registry import ESTIMATORS as REGISTRY
from skarxlag.models.observer_base import EVALUATIONS

#: Parameters of estimators that are tested with other ones than the defaults.
VARIANTS = {
    "ARXLaguerre": [
        {},
        {"pole": "optimise", "order": 4},
        {"bank": False, "unit_rms": False},
    ],
    "PIObserver": [{"evaluation": name} for name in EVALUATIONS],
    "ExtendedStatePIObserver": [
        {"n_observers": 8},
        *({"n_observers": 1, "evaluation": name} for name in EVALUATIONS),
    ],
    "FaultOrderClassifier": [
        {"bearing": "6205", "sampling_rate": 100.0, "speed_range": (2000.0, 2600.0)}
    ],
    "SensorFusion": [{"estimator": make_diagnoser()}, {"estimator": make_detector()}],
}
# A Pipeline cannot be checked without its steps; those of the makers are, below.
ESTIMATORS = [
    getattr(skarxlag, name)(**parameters)
    for name in REGISTRY
    if name != "DiagnosisPipeline"
    for parameters in VARIANTS.get(name, [{}])
]


def signals(shape, seed=0):
    return np.random.default_rng(seed).normal(size=shape)


def labels(n):
    return np.arange(n) % 2


def outputs(estimator, X):
    """Everything that a fitted estimator says of X."""
    methods = (
        "transform",
        "predict",
        "decision_function",
        "predict_proba",
        "score_samples",
    )
    return [getattr(estimator, m)(X) for m in methods if hasattr(estimator, m)]
