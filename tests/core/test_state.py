"""No fitted state that `fit` could not have made reaches a compiled loop."""

import copy
import warnings
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from sklearn.base import clone

from skarxlag import (
    KnownConditions,
    PIObserver,
    SensorFusion,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
)
from skarxlag.core.state import check_model_state, check_state
from tests.estimators import ESTIMATORS, labels, outputs, signals

#: One of each class is enough where the class decides.
OF_EACH_CLASS = list({type(e): e for e in ESTIMATORS}.values())
TABLE = signals((12, 40))
#: Attributes that no loop uses, and those of estimators that check themselves.
CHECKED_AT_LOAD = {"rungs_", "detectors_", "estimators_"}
#: Their loops are those of the estimators that they hold.
OF_PARTS = (KnownConditions, SensorFusion)


@cache
def fitted_once(estimator):
    """Return the fitted estimator, which no test may change."""
    with warnings.catch_warnings():
        # A detector says that it has few windows.
        warnings.simplefilter("ignore", UserWarning)
        return clone(estimator).fit(TABLE, labels(12))


def tampered(value):
    """Yield values in place of a fitted attribute: name of the case, and the value."""
    yield "nothing", None
    yield "text", "nonsense"
    if isinstance(value, np.ndarray) and value.size == 0:
        yield "row more", np.ones(3)
    elif isinstance(value, np.ndarray):
        yield "empty", value[:0]
        yield "row more", np.concatenate([value, value[-1:]])
        yield "row less", value[:-1]
        yield "axis more", value[np.newaxis]
        yield "scalar", value.flat[0]
        yield "list", value.tolist()
        yield "objects", np.array([object()] * value.size).reshape(value.shape)
        if value.ndim > 1:
            yield "column more", np.concatenate([value, value[..., -1:]], axis=-1)
            yield "no column", value[..., :0]
        if value.dtype.kind == "f":
            for entry in (np.nan, np.inf, -np.inf):
                yield str(entry), np.full_like(value, entry)
            yield "complex", value.astype(complex)
            yield "foreign bytes", value.astype(value.dtype.newbyteorder())
        if value.dtype.kind in "iu":
            for entry in (-5, 0, 10**6, 2**62):
                yield str(entry), np.full_like(value, entry)
            yield "real", value + 0.5
    else:
        yield "array", np.array([value, value])
        yield "nan", float("nan")
        yield "infinite", float("inf")
        if isinstance(value, int):
            yield "huge", 10**9
            yield "real", value + 0.5


def learnt(estimator):
    return {k: v for k, v in vars(estimator).items() if k.endswith("_")}


#: Alterations that leave a state that `fit` could have made: a plain table may have any
#: number of columns, a condition may be called by any number, conditions may share a
#: place, a count of rows may be large, rows may be compared without orders, or without
#: spectra, and a single observer compares nothing.
POSSIBLE = {
    ("classes_", "real"),
    ("class_locations_", "0"),
    ("order_residual_", "nothing"),
    ("conditions_", "nothing"),
    ("distance_", "nothing"),
    *((f"n_{n}_", "huge") for n in ("features_in", "rows", "blocks")),
}
#: Attributes, and values for them that are plausible by themselves but not in their
#: place.
OUT_OF_RANGE = {
    "poles_": [1.5, 1.0, -1.0, 1.0000001],
    "coef_": [1e300],
    "noise_level_": [-1.0],
    "weights_": [-1.0],
    "detection_threshold_": [-1.0],
    "confidence_scale_": [-1.0, 0.0],
    "healthy_index_": [-2, 2],
    "whitener_": [1e300],
}


def alterations(fitted):
    """Name of an attribute, name of the case, and a value that must be refused."""
    for name, original in learnt(fitted).items():
        for case, value in tampered(original):
            # The only condition may be called by any number.
            is_label = name == "classes_" and np.size(original) == np.size(value) == 1
            if (name, case) not in POSSIBLE and not (
                is_label and case.strip("-").isdecimal()
            ):
                yield name, case, value
        for value in OUT_OF_RANGE.get(name, ()):
            is_array = isinstance(original, np.ndarray)
            yield name, str(value), np.full_like(original, value) if is_array else value


@pytest.mark.parametrize("estimator", OF_EACH_CLASS, ids=lambda e: type(e).__name__)
def test_altered_attribute_is_refused_by_name_before_it_is_used(estimator):
    fitted = fitted_once(estimator)
    names, passed = learnt(fitted), []
    estimator = copy.copy(fitted)
    outputs(estimator, TABLE)
    for name, case, value in alterations(fitted):
        setattr(estimator, name, value)
        calls = [check_state]
        if name not in CHECKED_AT_LOAD and not isinstance(fitted, OF_PARTS):
            calls.append(lambda e: outputs(e, TABLE[:2]))
        for call in calls:
            try:
                call(estimator)
                passed.append((name, case))
            except ValueError as error:
                # Of two attributes that contradict each other either may be named.
                if not any(n in str(error) for n in names):
                    passed.append((name, case, str(error)))
        setattr(estimator, name, names[name])
    assert passed == []
    outputs(estimator, TABLE)


def test_array_that_was_changed_in_place_is_refused():
    model = copy.deepcopy(fitted_once(ESTIMATORS[0]))
    model.orders_[0] = 10**6
    with pytest.raises(ValueError, match="coef_ has shape"):
        model.transform(TABLE)


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=str)
def test_every_estimator_accepts_its_own_state(estimator):
    estimator = fitted_once(estimator)
    check_state(estimator)
    check_state(copy.deepcopy(estimator))


@pytest.mark.parametrize("estimator", OF_EACH_CLASS, ids=lambda e: type(e).__name__)
def test_parameters_that_no_fit_accepts_are_refused_or_not_used(estimator):
    fitted = copy.copy(fitted_once(estimator))
    expected = outputs(fitted, TABLE)
    for name, value in fitted.get_params(deep=False).items():
        if name == "n_jobs" or not isinstance(value, float | int):
            continue
        fitted.set_params(**{name: "nonsense"})
        try:
            found = outputs(fitted, TABLE)
        except (ValueError, TypeError):
            found = expected
        for one, other in zip(found, expected, strict=True):
            assert_array_equal(one, other)
        fitted.set_params(**{name: value})


@pytest.mark.parametrize("changed", [{"ki": 0.9}, {"kp": 0.3}, {"n_observers": 4}])
def test_observer_with_other_gains_than_those_of_fit_is_refused(changed):
    model = copy.deepcopy(fitted_once(PIObserver())).set_params(**changed)
    with pytest.raises(ValueError, match=r"parameters changed since fit: call fit"):
        model.transform(TABLE)


MAKERS = [make_alpio, make_extended_state_pio, make_diagnoser]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("n_samples", [150, 1200])
def test_windows_of_several_channels_keep_their_length(make, n_samples):
    diagnoser = make().fit(signals((20, 2, 300)), labels(20))
    with pytest.raises(
        ValueError, match=r"windows of shape \(.*\), but .* was fitted on"
    ):
        diagnoser.predict(signals((4, 2, n_samples)))


@pytest.mark.parametrize("make", MAKERS)
def test_wrong_channels_are_called_channels(make):
    diagnoser = make().fit(signals((20, 2, 300)), labels(20))
    for shape in [(4, 300), (4, 1, 300), (4, 3, 300)]:
        with pytest.raises(ValueError, match=r"fitted on windows of shape .*channels"):
            diagnoser.predict(signals(shape))


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("shape", [(40, 300, 2), (40, 1200, 2), (4, 2, 1)])
def test_more_channels_than_samples_are_transposed_windows(make, shape):
    with pytest.raises(ValueError, match=rf"X.shape == \({shape[0]}, .*transpose"):
        make().fit(signals(shape), labels(shape[0]))


def test_an_error_names_the_step():
    diagnoser = make_alpio().fit(signals((12, 40)), labels(12))
    check_model_state(diagnoser)
    diagnoser["observe"].kp_ = None
    with pytest.raises(ValueError, match=r"Step 'observe': kp_ is missing"):
        check_model_state(diagnoser)
