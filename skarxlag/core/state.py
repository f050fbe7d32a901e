"""Consistency of fitted attributes, which compiled loops rely on.

Compiled loops do not check bounds: arrays of wrong shapes would make them read and
write foreign memory. Each estimator declares the shapes and ranges of its fitted
attributes in the table `_state`. They are compared with it when a model is loaded, and
before a prediction if they were not compared yet or a user has replaced one.
"""

import contextlib
import functools
import math
import operator
from collections.abc import Callable, Iterator
from numbers import Integral, Real
from typing import Any, ClassVar, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import Pipeline
from sklearn.utils import check_scalar
from sklearn.utils.validation import check_is_fitted

#: Types of arrays that compiled loops take.
_FLOATS = (np.dtype(np.float64), np.dtype(np.float32))
_INTEGERS = (np.dtype(np.int64), np.dtype(np.int32))
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
        shape = self.shape(estimator) if callable(self.shape) else self.shape
        if shape == ():
            self._check_number(name, value)
        else:
            self._check_array(name, value, shape)
        if isinstance(self.range, str):
            phrase, bound = self.range.rsplit(" ", 1)
            expect(_RANGES[phrase](value, float(bound)), name, value, self.range)
        elif self.range is not None:
            condition, expected = self.range
            expect(condition(value, estimator), name, value, expected)

    def _check_number(self, name, value):
        kind, expected = (Real, "a finite number")
        if self.kind == "i":
            kind, expected = (Integral, "an integer")
        is_number = isinstance(value, kind) and not isinstance(value, bool)
        expect(is_number and math.isfinite(value), name, value, expected)

    def _check_array(self, name, value, shape):
        types, numbers = (_FLOATS, "finite float64 or float32 numbers")
        if self.kind == "i":
            types, numbers = (_INTEGERS, "int64 or int32 numbers")
        is_array = isinstance(value, np.ndarray) and value.dtype in types
        is_finite = is_array and bool(np.isfinite(value).all())
        expect(is_finite, name, value, f"an array of {numbers}")
        lengths = value.shape
        if len(lengths) != len(shape) or any(
            expected not in (None, length)
            for expected, length in zip(shape, lengths, strict=True)
        ):
            listed = str(tuple(map(str, shape))).replace("'", "").replace("None", "any")
            raise ValueError(f"{name} has shape {lengths}, expected {listed}.")


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

    The value of a parameter is shown as `sklearn.utils.check_scalar` shows it, and that
    of a description in words after a colon.

    Examples
    --------
    >>> expect(False, "order", -1, "at least 1")
    Traceback (most recent call last):
        ...
    ValueError: order == -1, expected at least 1.
    >>> expect(False, "Number of models in X", np.int64(4), "1")
    Traceback (most recent call last):
        ...
    ValueError: Number of models in X: 4, expected 1.
    >>> expect(False, "rpm", None, "the speed of each row")
    Traceback (most recent call last):
        ...
    ValueError: rpm is missing, expected the speed of each row.
    """
    # NumPy takes longer to look at one flag than most checks take.
    if holds is not True and not np.all(holds):
        if value is None and " " not in name:
            raise ValueError(f"{name} is missing, expected {expected}.")
        plain = value.item() if isinstance(value, np.generic) else value
        text = " ".join(repr(plain).split())
        shown = text if len(text) <= 100 else f"{text[:97]}..."
        relation = ":" if " " in name else " =="
        raise ValueError(f"{name}{relation} {shown}, expected {expected}.")


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
    """Raise an error that names the fitted attribute or parameter that `fit` cannot have set.

    Raises
    ------
    NotFittedError
        If `fit` was not called.
    ValueError
        If a value is not as the table states, or contradicts another one.
    """
    check_is_fitted(estimator)
    _check_table(estimator)
    estimator._check_relations()


def _check_table(estimator):
    """Check the parameters, and the fitted attributes in the order of the table."""
    estimator._check_parameters()
    for name, expected in estimator._state.items():
        expected.check(estimator, name, getattr(estimator, name, None))


#: Attributes of each estimator when they were last checked, which takes 0.03 to 0.15 ms.
_CHECKED: WeakKeyDictionary[Any, tuple[Any, ...]] = WeakKeyDictionary()


def uses_fitted(method: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a method so that it refuses values that its compiled loops cannot take.

    A user may have replaced a fitted attribute or a parameter since `fit`. Values that
    were checked are not checked again until one of them is replaced. Only
    `check_state`, when a model is loaded, compares attributes by what else they must
    have in common.
    """

    @functools.wraps(method)
    def checked(self, *args, **kwargs):
        values = tuple(vars(self).values())
        checked_values = _CHECKED.get(self, ())
        is_checked = len(values) == len(checked_values) and all(
            map(operator.is_, values, checked_values)
        )
        if not is_checked:
            check_is_fitted(self)
            _check_table(self)
            _CHECKED[self] = values
        return method(self, *args, **kwargs)

    return checked


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
                    check_state(part)
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
            n_features = getattr(step, "n_features_in_", width)
            if width not in (None, n_features):
                raise ValueError(
                    f"Step {name!r} was fitted on {n_features} columns, but the step before it "
                    f"returns {width}."
                )
            # The last step may be no transformer.
            if step is not pipeline.steps[-1][1]:
                width = len(step.get_feature_names_out())
