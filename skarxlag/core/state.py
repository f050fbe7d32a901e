"""Consistency of fitted attributes, which compiled loops rely on.

Compiled loops do not check bounds: arrays of wrong shapes would make them read and
write foreign memory. Each estimator declares the shapes and ranges of its fitted
attributes in the table `_state`. They are compared with it when a model is loaded, and
before the first prediction after an attribute was replaced.
"""

import contextlib
import copy
import functools
import operator
import weakref
from collections.abc import Callable, Iterator
from numbers import Integral, Real
from typing import Any, ClassVar, NamedTuple

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import Pipeline
from sklearn.utils import check_scalar
from sklearn.utils.validation import check_is_fitted

#: Parameters that do not change results. Prediction uses their present values.
_FREE_PARAMETERS = {"n_jobs", "verbose"}
#: Types and name of a number, types and name of an array.
_KINDS: dict[str, tuple[Any, str, tuple[Any, ...], str]] = {
    "f": (
        Real,
        "a finite number",
        (np.float64, np.float32),
        "finite float64 or float32 numbers",
    ),
    "i": (Integral, "an integer", (np.int64, np.int32), "int64 or int32 numbers"),
}
#: Values, contents of small arrays, and checked copy of each estimator that was used.
_checked: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()

#: Ranges of fitted values in words, before a bound.
_RANGES = {"above": operator.gt, "at least": operator.ge, "below": operator.lt}
# Squares of larger values overflow when they are summed.
_RANGES["within"] = lambda value, bound: np.abs(value) < bound


class Values(NamedTuple):
    """Fitted number, or array of numbers: its shape, range and kind.

    `shape` is () for a number, a tuple, or a function of the estimator that returns a
    tuple, with None for any length. The function may use the attributes that stand
    earlier in the table. `range` is a text such as "at least 1", or a condition on the
    value and the estimator, and its words.
    """

    shape: Any = ()
    range: str | tuple[Callable[..., Any], str] | None = None
    kind: str = "f"

    def check(self, estimator: Any, name: str, value: Any) -> None:
        """Raise a ValueError that names the attribute if a value is not as the table states."""
        number, one, types, several = _KINDS[self.kind]
        shape = self.shape(estimator) if callable(self.shape) else self.shape
        if shape == ():
            fits, expected = (
                isinstance(value, number) and not isinstance(value, bool),
                one,
            )
        else:
            fits = isinstance(value, np.ndarray) and value.dtype in types
            expected = f"an array of {several}"
        expect(fits and np.isfinite(value), name, value, expected)
        found = np.shape(value)
        wanted = [m if n is None else n for n, m in zip(shape, found, strict=False)]
        if len(found) != len(shape) or wanted != list(found):
            listed = str(shape).replace("None", "any")
            raise ValueError(f"{name} has shape {found}, expected {listed}.")
        if isinstance(self.range, str):
            phrase, bound = self.range.rsplit(" ", 1)
            expect(_RANGES[phrase](value, float(bound)), name, value, self.range)
        elif self.range is not None:
            condition, expected = self.range
            expect(condition(value, estimator), name, value, expected)


class Labels:
    """Fitted array of conditions, sorted and different."""

    def check(self, estimator: Any, name: str, value: Any) -> None:
        """Raise a ValueError that names the attribute if a value is no such array."""
        is_array = isinstance(value, np.ndarray) and value.ndim == 1 and len(value) > 0
        is_labels = is_array and (
            value.dtype.kind in "biufU"
            or all(isinstance(label, str) for label in value)
        )
        expect(is_labels, name, value, "an array of labels")
        expect(value[:-1] < value[1:], name, value, "different labels, sorted")


class FittedOn(NamedTuple):
    """Fitted estimator of the conditions in `classes_`; None is accepted if it is optional."""

    optional: bool = False

    def check(self, estimator: Any, name: str, value: Any) -> None:
        """Raise a ValueError that names the attribute if a value is no such estimator."""
        fits = value is None and self.optional
        with contextlib.suppress(AttributeError):
            fits = fits or np.array_equal(value.classes_, estimator.classes_)
        known = f"a fitted estimator of the conditions {estimator.classes_.tolist()}"
        expect(fits, name, value, known)


def expect(holds: Any, name: str, value: object, expected: str) -> None:
    """Raise a ValueError that names a value, and what was expected, unless all of `holds` is true.

    Examples
    --------
    >>> expect(False, "order", -1, "at least 1")
    Traceback (most recent call last):
        ...
    ValueError: order == -1, expected at least 1.
    """
    # NumPy takes longer to look at one flag than most checks take.
    if holds is not True and not np.all(holds):
        text = " ".join(repr(value).split())
        shown = text if len(text) <= 100 else f"{text[:97]}..."
        raise ValueError(f"{name} == {shown}, expected {expected}.")


#: Training speeds in revolutions per minute.
SPEEDS = Values(
    (None,),
    (
        lambda v, e: np.all(v > 0) and np.all(np.diff(v) > 0),
        "speeds above 0, ascending",
    ),
)


def _fits_rows(shape, estimator):
    return (
        len(shape) in (1, 2)
        and np.all(shape >= 1)
        and shape[0] == estimator.n_features_in_
    )


def _fits_models(n, estimator):
    return n == (estimator.n_features_in_ if len(estimator.window_shape_) == 2 else 0)


#: Fitted attributes of estimators whose rows are plain.
TABLE: dict[str, Values | Labels | FittedOn] = {
    "n_features_in_": Values((), "at least 1", "i")
}
#: Fitted attributes of estimators whose rows are windows.
WINDOWS = TABLE | {
    "window_shape_": Values(
        (None,), (_fits_rows, "1 or 2 lengths, first n_features_in_"), "i"
    )
}
#: Fitted attributes of estimators whose rows are innovations, or plain windows.
INNOVATIONS = WINDOWS | {
    "n_models_": Values(
        (), (_fits_models, "that of window_shape_, or 0 for plain rows"), "i"
    )
}


class CheckedEstimator:
    """Estimator that declares the shapes and ranges of its fitted attributes in `_state`."""

    _state: ClassVar[dict[str, Values | Labels | FittedOn]] = {}

    def _check_parameters(self):
        """Raise an error that names the parameter that is out of its range."""

    def _check_relations(self):
        """Raise a ValueError if fitted attributes contradict each other."""

    def _capabilities(self):
        """Return fields of `Capabilities` by name."""
        return {}


def check_state(estimator: CheckedEstimator) -> None:
    """Raise a ValueError that names the fitted attribute or parameter that `fit` cannot have set.

    The attributes are checked in the order of the table.
    """
    estimator._check_parameters()
    for name, wanted in estimator._state.items():
        wanted.check(estimator, name, vars(estimator).get(name))
    estimator._check_relations()


def finish_fit(estimator: Any) -> Any:
    """Store the parameters, to which `as_fitted` returns, and return the estimator."""
    estimator._fitted_parameters = {
        name: copy.deepcopy(value)
        for name, value in estimator.get_params(deep=False).items()
        # Prediction uses the fitted copies of other estimators, never the parameter.
        if name not in _FREE_PARAMETERS and not isinstance(value, BaseEstimator)
    }
    return estimator


def as_fitted(estimator: Any) -> Any:
    """Return a shallow copy that has the parameters of `fit` and a checked state.

    A comparison of identities, which takes some microseconds, decides whether the
    checks must run again because an attribute was replaced. Values that are changed in
    place are noticed in arrays of up to 16 entries, such as the orders of a network; in
    larger arrays they cannot change a shape.

    Raises
    ------
    NotFittedError
        If `fit` was not called.
    ValueError
        As in `check_state`.
    """
    values = list(vars(estimator).values())
    known, small, contents, checked = _checked.get(estimator, ((), (), [], None))
    if (
        len(known) == len(values)
        and all(map(operator.is_, known, values))
        and list(map(np.ndarray.tobytes, small)) == contents
    ):
        return checked
    check_is_fitted(estimator)
    fitted = vars(estimator).get("_fitted_parameters")
    is_of_fit = (
        isinstance(fitted, dict) and fitted.keys() <= estimator.get_params().keys()
    )
    expect(is_of_fit, "_fitted_parameters", fitted, "parameters of fit")
    checked = object.__new__(type(estimator))
    vars(checked).update(vars(estimator) | fitted)
    check_state(checked)
    small = [
        value for value in values if isinstance(value, np.ndarray) and value.size <= 16
    ]
    _checked[estimator] = values, small, list(map(np.ndarray.tobytes, small)), checked
    return checked


def uses_fitted(method: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a method so that it runs on what `as_fitted` returns."""

    @functools.wraps(method)
    def run(self, *args, **kwargs):
        return method(as_fitted(self), *args, **kwargs)

    return run


def estimators_within(value: Any) -> Iterator[Any]:
    """Yield a model or the models in a list, and every estimator inside them.

    Estimators, and objects that hold some, are those of scikit-learn and of this
    package.
    """
    parts = ()
    if isinstance(value, list | tuple):
        parts = value
    elif type(value).__module__.split(".")[0] in ("sklearn", "skarxlag"):
        yield value
        # Compiled objects of scikit-learn, such as a loss, have no attributes.
        with contextlib.suppress(TypeError):
            parts = vars(value).values()
    for part in parts:
        yield from estimators_within(part)


def is_fitted(estimator: BaseEstimator) -> bool:
    """Return whether `fit` has been called."""
    try:
        check_is_fitted(estimator)
    except NotFittedError:
        return False
    return True


def check_model_state(model: Any) -> None:
    """Check that a model is fitted, and the parameters and fitted attributes within it.

    Parameters
    ----------
    model : estimator
        A fitted pipeline, or an estimator of scikit-learn that holds pipelines, such as
        `CalibratedClassifierCV`.

    Raises
    ------
    NotFittedError
        If the model is not fitted.
    ValueError
        If a value is out of its range, or steps of a pipeline do not fit together. The
        message names the step, the attribute, its value and what was expected.
    """
    check_is_fitted(model)
    pipelines, places = [], {}
    for part in (
        each for each in estimators_within(model) if isinstance(each, BaseEstimator)
    ):
        if isinstance(part, Pipeline):
            places.update({id(step): f"Step {name!r}" for name, step in part.steps})
            # CalibratedClassifierCV keeps the pipeline that it was made from, which is
            # not fitted.
            pipelines += [part] if is_fitted(part) else []
        stated = part.get_params(deep=False)
        try:
            check_scalar(stated.get("n_jobs"), "n_jobs", (Integral, type(None)))
            expect(
                stated.get("n_jobs") != 0, "n_jobs", 0, "a number of threads, or None"
            )
            if isinstance(part, CheckedEstimator):
                part._check_parameters()
                if is_fitted(part):
                    as_fitted(part)
        # Values of wrong types raise errors of all kinds, which may not name the
        # parameter.
        except Exception as error:
            text = (
                error
                if isinstance(error, ValueError)
                else f"{error}; parameters: {stated}"
            )
            raise ValueError(
                f"{places.get(id(part), type(part).__name__)}: {text}"
            ) from error
    for pipeline in pipelines:
        width = None
        for name, step in pipeline.steps:
            n_features = vars(step).get("n_features_in_", width)
            expected = f"{width}: the step before returns {width} columns"
            is_fit = width in (None, n_features)
            expect(is_fit, f"Step {name!r}: n_features_in_", n_features, expected)
            # The last step may be no transformer.
            if step is not pipeline.steps[-1][1]:
                width = len(step.get_feature_names_out())
