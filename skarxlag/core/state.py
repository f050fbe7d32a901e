"""Consistency of fitted attributes, which compiled loops rely on.

Compiled loops do not check bounds: arrays of wrong shapes would make them read and
write foreign memory. Each estimator checks the shapes and ranges of its fitted
attributes in its method `_check_fitted`. This is done when a model is loaded, and before
a prediction if it was not done yet or a user has replaced an attribute.
"""

import copy
import functools
import math
import operator
from collections.abc import Callable, Iterator
from numbers import Integral, Real
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

#: Types of arrays that compiled loops take.
_FLOATS = (np.dtype(np.float64), np.dtype(np.float32))
_INTEGERS = (np.dtype(np.int64), np.dtype(np.int32))
#: Words of a range, before a bound.
_COMPARISONS = {"above": operator.gt, "at least": operator.ge, "below": operator.lt}
#: Range of values whose squares do not overflow when they are summed.
SQUARABLE = "above -1e150 and below 1e150"


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


def expect_in_range(name: str, value: Any, allowed: str) -> None:
    """Raise a ValueError that names a value, unless all of it is in a range.

    The range is a text of bounds, such as "above 0", or "at least 0 and below 1".

    Examples
    --------
    >>> expect_in_range("poles_", np.array([0.3, 0.9]), "above -1 and below 1")
    >>> expect_in_range("n_rows_", 1, "at least 2")
    Traceback (most recent call last):
        ...
    ValueError: n_rows_ == 1, expected at least 2.
    """
    for condition in allowed.split(" and "):
        comparison, bound = condition.rsplit(" ", 1)
        expect(_COMPARISONS[comparison](value, float(bound)), name, value, allowed)


def check_number(
    name: str, value: Any, allowed: str | None = None, kind: type = float
) -> None:
    """Raise a ValueError that names a value, unless it is a finite number in a range.

    Parameters
    ----------
    name : str
        What the message calls the value.
    value : object
        The value.
    allowed : str or None, default=None
        Range, as in `expect_in_range`.
    kind : {float, int}, default=float
        Type of number. A float may be stored as an integer.
    """
    of_kind, expected = {
        float: (Real, "a finite number"),
        int: (Integral, "an integer"),
    }[kind]
    is_number = isinstance(value, of_kind) and not isinstance(value, bool)
    expect(is_number and math.isfinite(value), name, value, expected)
    if allowed is not None:
        expect_in_range(name, value, allowed)


def _sets_state_at_its_end(fit):
    """Let a method work on a copy of its estimator, whose attributes are then set at once."""

    @functools.wraps(fit)
    def fit_copy(self, *args, **kwargs):
        trial = copy.copy(self)
        fit(trial, *args, **kwargs)
        vars(self).update(vars(trial))
        return self

    return fit_copy


class CheckedEstimator:
    """Estimator that checks its fitted attributes before compiled code uses them.

    A subclass extends `_check_fitted` by its own attributes. Its methods `fit` and
    `partial_fit` set all attributes in one step at their end, so that an interrupted
    refit leaves the estimator as it was.
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name in {"fit", "partial_fit"} & vars(cls).keys():
            setattr(cls, name, _sets_state_at_its_end(vars(cls)[name]))

    n_features_in_: int
    classes_: NDArray[Any]
    speeds_: NDArray[Any]

    def _check_parameters(self):
        """Raise an error that names the parameter that is out of its range."""

    def _check_fitted(self):
        """Raise a ValueError that names the fitted attribute that `fit` cannot have set."""
        self._check_number("n_features_in_", "at least 1", int)

    def _check_relations(self):
        """Raise a ValueError if attributes contradict each other in ways that loops survive."""

    def _capabilities(self):
        """Return fields of `Capabilities` by name."""
        return {}

    def _check_number(self, name, allowed=None, kind=float):
        """Check that an attribute is a number, see `check_number`."""
        check_number(name, getattr(self, name, None), allowed, kind)

    def _check_array(self, name, shape, allowed=None, kind=float):
        """Check that an attribute is a finite array; in `shape`, None is any length."""
        value = getattr(self, name, None)
        types, numbers = {
            float: (_FLOATS, "finite float64 or float32 numbers"),
            int: (_INTEGERS, "int64 or int32 numbers"),
        }[kind]
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
        if allowed is not None:
            expect_in_range(name, value, allowed)

    def _check_classes(self):
        """Check that `classes_` is an array of conditions, sorted and different."""
        classes = getattr(self, "classes_", None)
        is_array = (
            isinstance(classes, np.ndarray) and classes.ndim == 1 and len(classes) > 0
        )
        is_labels = is_array and (
            classes.dtype.kind in "biufU"
            or all(isinstance(label, str) for label in classes)
        )
        expect(is_labels, "classes_", classes, "an array of labels")
        is_sorted = classes[:-1] < classes[1:]
        expect(is_sorted, "classes_", classes, "different labels, sorted")

    def _check_speeds(self):
        """Check that `speeds_` are speeds in revolutions per minute, ascending."""
        self._check_array("speeds_", (None,))
        is_sorted = np.all(self.speeds_ > 0) and np.all(np.diff(self.speeds_) > 0)
        expect(is_sorted, "speeds_", self.speeds_, "speeds above 0, ascending")

    def _check_part(self, name):
        """Check that an attribute is a fitted estimator of the conditions in `classes_`."""
        part = getattr(self, name, None)
        has_conditions = np.array_equal(getattr(part, "classes_", None), self.classes_)
        conditions = self.classes_.tolist()
        expected = f"a fitted estimator of the conditions {conditions}"
        expect(has_conditions, name, part, expected)


def check_state(estimator: CheckedEstimator) -> None:
    """Raise an error that names the fitted attribute or parameter that `fit` cannot have set.

    Raises
    ------
    NotFittedError
        If `fit` was not called.
    ValueError
        If a value is out of its range, or contradicts another one.
    """
    _check_for_loops(estimator)
    estimator._check_relations()


def _check_for_loops(estimator):
    check_is_fitted(estimator)
    estimator._check_parameters()
    estimator._check_fitted()


#: Attributes of each estimator when they were last checked. The check takes 0.03 to
#: 0.15 ms, the comparison with these less than a hundredth of it.
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
            _check_for_loops(self)
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
        parts = getattr(value, "__dict__", {}).values()
    for part in parts:
        yield from estimators_within(part)


def is_fitted(estimator: BaseEstimator, attribute: str | None = None) -> bool:
    """Return whether `fit` has been called, or whether it has set an attribute."""
    try:
        check_is_fitted(estimator, attribute)
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
        If a value is out of its range. The message names the step, the attribute, its
        value and what was expected.
    """
    check_is_fitted(model)
    step_names = {}
    for part in estimators_within(model):
        if isinstance(part, Pipeline):
            step_names |= {id(step): f"Step {name!r}" for name, step in part.steps}
        if not isinstance(part, CheckedEstimator):
            continue
        try:
            part._check_parameters()
            # CalibratedClassifierCV keeps the pipeline that it was made from, which is
            # not fitted.
            if is_fitted(part):
                check_state(part)
        # Values of wrong types raise errors of all kinds.
        except Exception as error:
            name = step_names.get(id(part), type(part).__name__)
            raise ValueError(f"{name}: {error}") from error
