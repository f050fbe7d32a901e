"""Checks of input, of parameters and of fitted attributes."""

from __future__ import annotations

import copy
import functools
import math
import operator
import weakref
from collections.abc import Callable, Iterator, Sequence
from numbers import Integral, Real
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import Pipeline
from sklearn.utils import check_array, check_scalar, get_tags
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data


def validate_signals(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike | None = None,
    *,
    reset: bool,
    expected: str,
    any_length: bool = False,
) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Check an array of two or three axes, and conditions where there are any.

    Parameters
    ----------
    estimator : estimator
        Gets or has `n_features_in_` and `window_shape_`, the shape of one window.
    X : array-like of two or three axes
        Signals along the last one.
    y : array-like of shape (n_windows,) or None, default=None
        Conditions.
    reset : bool
        True in `fit`.
    expected : str
        What X should have been, for the message.
    any_length : bool, default=False
        Whether windows of several channels may be longer or shorter than in `fit`. scikit-learn's
        contract fixes the length of windows of one channel, which are rows of a table.

    Returns
    -------
    X : ndarray
        float64 or float32.
    y : ndarray of shape (n_windows,) or None
        Conditions.

    Raises
    ------
    ValueError
        If X has another number of axes, channels or samples than in `fit`, y is not made of
        classes or missing where it is required, or the estimator is not consistent.
    """
    check = {"dtype": [np.float64, np.float32], "allow_nd": True, "reset": reset}
    # scikit-learn makes float64 of big-endian float32; both byte orders are to give the same.
    if isinstance(X, np.ndarray) and not X.dtype.isnative:
        X = X.astype(X.dtype.newbyteorder("="))
    if not reset:
        as_fitted(estimator)
        X = X if hasattr(X, "shape") else np.asarray(X)
        _check_window_shape(estimator, X.shape[1:], any_length)
    if y is None and not (reset and get_tags(estimator).target_tags.required):
        X = validate_data(estimator, X, **check)
    else:
        check_labels(y)
        X, y = validate_data(estimator, X, y, **check)
        check_classification_targets(y)
    if X.ndim > 3:
        raise ValueError(f"X has shape {X.shape}, expected {expected}.")
    if reset:
        estimator.window_shape_ = np.array(X.shape[1:])
    return X, y


def _check_window_shape(estimator, shape, any_length):
    """Speak of channels and samples, where scikit-learn would of features."""
    fitted = tuple(estimator.window_shape_.tolist())
    # Of rows of a table, and of whatever else is wrong with X, scikit-learn speaks itself.
    if len(shape) not in (1, 2) or len(shape) == len(fitted) == 1:
        return
    any_length = any_length and len(shape) == len(fitted) == 2
    if shape[0] != fitted[0] or (shape != fitted and not any_length):
        wanted = f"({fitted[0]}, any)" if any_length else fitted
        raise ValueError(
            f"X has windows of shape {shape}, but {type(estimator).__name__} was fitted on windows "
            f"of shape {wanted}: channels or models first, where there are several, then samples."
        )


def check_labels(y: ArrayLike | None) -> None:
    """Refuse labels of which some are texts and some are numbers.

    Parameters
    ----------
    y : array-like or None
        Labels.

    Raises
    ------
    ValueError
        If they are mixed: they cannot be sorted, and NumPy would make texts of the numbers.

    Examples
    --------
    >>> check_labels(["normal", 3])
    Traceback (most recent call last):
        ...
    ValueError: y has labels that are texts and labels that are numbers: 'normal' and 3...
    """
    if not isinstance(y, list | tuple) and str(getattr(y, "dtype", "")) != "object":
        return
    # Lists of other things are for scikit-learn to refuse.
    labels = [label for label in y if isinstance(label, str | Real)]
    texts = [label for label in labels if isinstance(label, str)]
    numbers = [label for label in labels if not isinstance(label, str)]
    if texts and numbers:
        raise ValueError(
            f"y has labels that are texts and labels that are numbers: {texts[0]!r} and "
            f"{numbers[0]!r}. Expected labels of one type."
        )


def validate_innovations(
    estimator: Any,
    X: ArrayLike,
    y: ArrayLike | None = None,
    *,
    reset: bool,
    any_length: bool = False,
) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Check innovations and note how many models they came from.

    Parameters
    ----------
    estimator : estimator
        Gets or has `n_models_`: the number of models, 0 where plain windows stand for the
        innovations of one model that predicts nothing.
    X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
        Innovations.
    y : array-like of shape (n_windows,) or None, default=None
        Conditions, where the estimator wants them.
    reset : bool
        True in `fit`.
    any_length : bool, default=False
        As in `validate_signals`.

    Returns
    -------
    X : ndarray of shape (n_windows, n_models, n_samples)
        Innovations.
    y : ndarray of shape (n_windows,) or None
        Conditions.

    Raises
    ------
    ValueError
        As in `validate_signals`.
    """
    X, y = validate_signals(
        estimator,
        X,
        y,
        reset=reset,
        expected="innovations of shape (n_windows, n_models, n_samples) or windows of shape "
        "(n_windows, n_samples)",
        any_length=any_length,
    )
    if reset:
        estimator.n_models_ = X.shape[1] if X.ndim == 3 else 0
    return (X if X.ndim == 3 else X[:, np.newaxis]), y


def weighted_windows(
    X: NDArray[Any], y: NDArray[Any] | None, sample_weight: ArrayLike | None
) -> tuple[Any, Any, NDArray[Any]]:
    """Windows that count, and how much each of them does.

    Parameters
    ----------
    X : ndarray of shape (n_windows, ...)
        Windows, or levels of windows.
    y : ndarray of shape (n_windows,) or None
        Conditions.
    sample_weight : array-like of shape (n_windows,) or None
        Weight of each window, at least 0. None: all weigh 1.

    Returns
    -------
    X, y : ndarray, and ndarray or None
        Those of weight above 0.
    weights : ndarray of float64
        Their weights.

    Raises
    ------
    ValueError
        If there is not one finite number of at least 0 for each window, or none is above 0.

    Examples
    --------
    >>> weighted_windows(np.array([[1.0], [2.0]]), np.array(["a", "b"]), [0, 3])
    (array([[2.]]), array(['b'], dtype='<U1'), array([3.]))
    """
    if sample_weight is None:
        return X, y, np.ones(len(X))
    weights = check_array(
        sample_weight, dtype=np.float64, ensure_2d=False, input_name="sample_weight"
    )
    if weights.shape != (len(X),):
        raise ValueError(
            f"sample_weight has shape {weights.shape}, expected one weight for each of "
            f"{len(X)} windows."
        )
    if weights.min() < 0:
        raise ValueError(f"sample_weight has {weights.min():g}, expected weights of at least 0.")
    if weights.max() == 0:
        raise ValueError("All weights in sample_weight are zero, expected one above 0.")
    counted = weights > 0
    if counted.all():
        return X, y, weights
    return X[counted], (None if y is None else y[counted]), weights[counted]


def check_input_names(estimator: Any, input_features: ArrayLike | None) -> NDArray[Any] | None:
    """Names of the features that an estimator was fitted on.

    Parameters
    ----------
    estimator : estimator
        Fitted; has `n_features_in_`, and `feature_names_in_` when it was fitted on a table.
    input_features : array-like of str or None
        What the caller says that they are called.

    Returns
    -------
    ndarray of str or None
        `input_features`, or `feature_names_in_`; None where neither is there.

    Raises
    ------
    ValueError
        If the names do not agree with what the estimator was fitted on.
    """
    known = getattr(estimator, "feature_names_in_", None)
    if input_features is None:
        return known
    input_features = np.asarray(input_features, dtype=object)
    if known is not None and not np.array_equal(known, input_features):
        raise ValueError("input_features is not equal to feature_names_in_")
    if len(input_features) != estimator.n_features_in_:
        raise ValueError(
            "input_features should have length equal to number of features "
            f"({estimator.n_features_in_}), got {len(input_features)}"
        )
    return input_features


def check_real(value: Any, name: str, **bounds: Any) -> None:
    """Check a real parameter, which must be finite.

    Parameters
    ----------
    value : object
        What the user gave.
    name : str
        The parameter's name, for the message.
    **bounds
        Passed to `sklearn.utils.check_scalar`.

    Raises
    ------
    TypeError
        If it is not a real number.
    ValueError
        If it is out of bounds, infinite or NaN.
    """
    check_scalar(value, name, Real, **bounds)
    if not math.isfinite(value):
        raise ValueError(f"{name} == {value}, must be finite.")


def check_networks(
    order: int | Sequence[int], pole: float | str | Sequence[float | str], n_channels: int
) -> tuple[NDArray[Any], list[float | None] | None]:
    """Order and pole of each channel's Laguerre network.

    Parameters
    ----------
    order : int or sequence of int
        One for all channels or one for each.
    pole : float, "optimise" or a sequence of these
        One for all channels or one for each.
    n_channels : int
        Channels of a window.

    Returns
    -------
    orders : ndarray of int of shape (n_channels,)
        Orders.
    poles : list of float or None
        Poles, None where one is to be searched for.

    Raises
    ------
    ValueError
        If there is not one entry for each channel or an entry is out of range.
    """
    orders = _one_for_each("order", order, n_channels)
    poles = _one_for_each("pole", pole, n_channels)
    for entry in orders:
        check_scalar(entry, "order", Integral, min_val=1)
    for entry in poles:
        if not isinstance(entry, str):
            check_real(entry, "pole", min_val=-1, max_val=1, include_boundaries="neither")
        elif entry != "optimise":
            raise ValueError(f"pole == {entry!r}, must be in (-1, 1) or 'optimise'.")
    return np.array(orders), [None if isinstance(entry, str) else entry for entry in poles]


def _one_for_each(name, value, n_channels):
    entries = [value] * n_channels if np.ndim(value) == 0 else list(value)
    if len(entries) != n_channels:
        raise ValueError(
            f"{name}={value!r} has {len(entries)} entries, but windows have {n_channels} channels."
        )
    return entries


def check_rate(value: float, name: str) -> None:
    """Check a rate of false alarms or rejections, in (0, 1)."""
    check_real(value, name, min_val=0, max_val=1, include_boundaries="neither")


#: Parameters that do not change results. Prediction uses their present values.
_FREE_PARAMETERS = {"n_jobs", "verbose"}
_KINDS = {"f": "numbers", "i": "integers", "b": "booleans"}
_sound: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()

#: Ranges of fitted values: a condition on the value (and the estimator), and its words.
POSITIVE = (lambda v, e: v > 0, "above 0")
NOT_NEGATIVE = (lambda v, e: v >= 0, "at least 0")
NEGATIVE = (lambda v, e: v < 0, "below 0")
AT_LEAST_1 = (lambda v, e: v >= 1, "at least 1")
#: Squares of larger values overflow when they are summed.
MODERATE = (lambda v, e: np.abs(v) < 1e150, "below 1e150")


class Values(NamedTuple):
    """Fitted number, or array of numbers: its shape, range and kind.

    `shape` is () for a number, a tuple, or a function of the estimator that returns a tuple, with
    None for any length. The function may use the attributes that stand earlier in the table.
    """

    shape: Any = ()
    range: tuple[Callable[..., Any], str] | None = None
    kind: str = "f"


class Labels(NamedTuple):
    """Fitted array of conditions, sorted and different; as many as `number` returns."""

    number: Callable[..., int] | None = None


#: Training speeds in revolutions per minute.
SPEEDS = Values(
    (None,),
    (lambda v, e: np.all(v > 0) and np.all(np.diff(v) > 0), "speeds above 0, ascending"),
)
#: Fitted attributes of estimators whose rows are plain.
TABLE: dict[str, Values | Labels] = {"n_features_in_": Values((), AT_LEAST_1, "i")}
#: Fitted attributes of estimators whose rows are windows.
WINDOWS = TABLE | {
    "window_shape_": Values(
        (None,),
        (
            lambda s, e: len(s) in (1, 2) and np.all(s >= 1) and s[0] == e.n_features_in_,
            "one or two lengths, of which the first is n_features_in_",
        ),
        "i",
    )
}
#: Fitted attributes of estimators whose rows are innovations, or plain windows.
INNOVATIONS = WINDOWS | {
    "n_models_": Values(
        (),
        (
            lambda n, e: n == (e.n_features_in_ if len(e.window_shape_) == 2 else 0),
            "the number of models in window_shape_, or 0 for plain windows",
        ),
        "i",
    )
}


class CheckedEstimator:
    """Estimator that declares the shapes and ranges of its fitted attributes.

    Compiled loops do not check bounds: arrays of wrong shapes would make them read and write
    foreign memory. `check_state` compares the fitted attributes with the table `_state`, in its
    order.
    """

    _state: ClassVar[dict[str, Values | Labels]] = {}

    def _check_parameters(self):
        """Raise an error that names the parameter that is out of its range."""

    def _check_relations(self):
        """Raise a ValueError if fitted attributes contradict each other."""


def check_state(estimator: CheckedEstimator) -> None:
    """Check every fitted attribute of an estimator.

    Parameters
    ----------
    estimator : CheckedEstimator
        Fitted.

    Raises
    ------
    ValueError
        If an attribute cannot come from `fit`. The message names it, its value and what was
        expected.
    """
    try:
        estimator._check_parameters()
        _check_attributes(estimator)
        estimator._check_relations()
    except TypeError as error:
        raise ValueError(str(error)) from error


def _check_attributes(estimator):
    for name, wanted in estimator._state.items():
        value = vars(estimator).get(name)
        if isinstance(wanted, Labels):
            _check_labels(estimator, name, value, wanted)
        else:
            check_value(estimator, name, value, wanted)
    names = vars(estimator).get("feature_names_in_")
    if names is not None and (
        not isinstance(names, np.ndarray)
        or names.shape != (estimator.n_features_in_,)
        or not all(isinstance(name, str) for name in names)
    ):
        raise ValueError(
            f"feature_names_in_ == {_short(names)}, expected {estimator.n_features_in_} names, one "
            "for each of n_features_in_."
        )


def check_value(estimator: Any, name: str, value: Any, wanted: Values) -> None:
    """Raise a ValueError that names the attribute if a value is not as the table says."""
    shape, kind = wanted.shape, wanted.kind
    shape = shape(estimator) if callable(shape) else shape
    if shape == ():
        of_kind = isinstance(value, {"i": Integral, "f": Real, "b": bool}[kind])
        if not of_kind or (kind != "b" and isinstance(value, bool)) or not np.isfinite(value):
            what = {"i": "an integer", "f": "a finite number", "b": "True or False"}[kind]
            raise ValueError(f"{name} == {_short(value)}, expected {what}.")
    else:
        _check_array(name, value, shape, kind)
    if wanted.range is not None and not np.all(wanted.range[0](value, estimator)):
        raise ValueError(f"{name} == {_short(value)}, expected {wanted.range[1]}.")


def _check_array(name, value, shape, kind):
    if not isinstance(value, np.ndarray):
        raise ValueError(f"{name} == {_short(value)}, expected an array of {_KINDS[kind]}.")
    kinds = "iu" if kind == "i" else kind
    if value.dtype.kind not in kinds or value.dtype.itemsize > 8 or not value.dtype.isnative:
        raise ValueError(f"{name} has dtype {value.dtype}, expected an array of {_KINDS[kind]}.")
    if value.ndim != len(shape) or any(
        n is not None and n != found for n, found in zip(shape, value.shape, strict=True)
    ):
        listed = ", ".join("any" if n is None else str(n) for n in shape)
        listed = f"({listed}{',' if len(shape) == 1 else ''})"
        raise ValueError(f"{name} has shape {value.shape}, expected {listed}.")
    if not np.all(np.isfinite(value)):
        worst = value.flat[np.argmin(np.isfinite(value))]
        raise ValueError(f"{name} holds {worst}, expected finite numbers.")


def _check_labels(estimator, name, value, wanted):
    is_array = isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "biufUO"
    if not is_array or (value.dtype.kind == "O" and not all(isinstance(v, str) for v in value)):
        raise ValueError(f"{name} == {_short(value)}, expected an array of labels.")
    n = None if wanted.number is None else wanted.number(estimator)
    if len(value) == 0 or n not in (None, len(value)):
        raise ValueError(f"{name} has {len(value)} entries, expected {n or 'at least one'}.")
    if not np.all(value[:-1] < value[1:]):
        raise ValueError(f"{name} == {_short(value)}, expected different labels, sorted.")


def _short(value):
    text = " ".join(repr(value).split())
    return text if len(text) <= 100 else f"{text[:97]}..."


def remember_parameters(estimator: Any) -> None:
    """Store the parameters at the end of `fit`; `as_fitted` returns to them."""
    parameters = estimator.get_params(deep=False)
    estimator._fitted_parameters = {
        name: copy.deepcopy(value)
        for name, value in sorted(parameters.items())
        # Prediction uses the fitted copies of other estimators, never the parameter.
        if name not in _FREE_PARAMETERS and not isinstance(value, BaseEstimator)
    }


def as_fitted(estimator: Any) -> Any:
    """Return the estimator with the parameters that it was fitted with, and a checked state.

    Checks run again after an attribute was replaced; to compare identities takes some
    microseconds. Values that are changed in place are noticed in arrays of up to 16 entries, such
    as the orders of a network; in larger arrays they cannot change a shape.

    Parameters
    ----------
    estimator : CheckedEstimator
        Fitted; `remember_parameters` was called at the end of its `fit`.

    Returns
    -------
    CheckedEstimator
        The same object, or a shallow copy if a parameter was changed after `fit`.

    Raises
    ------
    NotFittedError
        If `fit` was not called.
    ValueError
        As in `check_state`.
    """
    values = list(vars(estimator).values())
    known, small, copied = _sound.get(estimator, ((), (), None))
    if (
        len(known) == len(values)
        and all(map(operator.is_, known, values))
        and all(array.tobytes() == content for array, content in small)
    ):
        return estimator if copied is None else copied
    check_is_fitted(estimator)
    fitted = vars(estimator).get("_fitted_parameters")
    present = estimator.get_params(deep=False)
    if not isinstance(fitted, dict) or not fitted.keys() <= present.keys():
        raise ValueError(f"_fitted_parameters == {_short(fitted)}, expected parameters of fit.")
    copied = None
    if any(not _same(present[name], value) for name, value in fitted.items()):
        copied = object.__new__(type(estimator))
        vars(copied).update(vars(estimator) | fitted)
    check_state(estimator if copied is None else copied)
    small = [(v, v.tobytes()) for v in values if isinstance(v, np.ndarray) and v.size <= 16]
    _sound[estimator] = values, small, copied
    return estimator if copied is None else copied


def _same(one, other):
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return type(one) is type(other) and np.array_equal(one, other)
    return one is other or bool(one == other)


def uses_fitted(method: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a method so that it runs on what `as_fitted` returns."""

    @functools.wraps(method)
    def run(self, *args, **kwargs):
        return method(as_fitted(self), *args, **kwargs)

    return run


def estimators_within(value: Any) -> Iterator[Any]:
    """Yield a model, and every estimator of scikit-learn and of this package inside it.

    Parameters
    ----------
    value : object
        A model, or a list of parts. Other values have no estimators.

    Yields
    ------
    object
        An estimator, or the object of scikit-learn that holds one.
    """
    parts = ()
    if isinstance(value, list | tuple):
        parts = value
    elif type(value).__module__.split(".")[0] in ("sklearn", "skarxlag"):
        yield value
        # Compiled objects of scikit-learn, such as a loss, have no attributes to look into.
        parts = getattr(value, "__dict__", {}).values()
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
    """Check the parameters and the fitted attributes of every estimator within a model.

    Parameters
    ----------
    model : estimator
        A fitted pipeline, or an estimator of scikit-learn that holds pipelines, such as
        `CalibratedClassifierCV`.

    Raises
    ------
    ValueError
        If a value is out of its range, or steps of a pipeline do not fit together. The message
        names the step, the attribute, its value and what was expected.
    """
    pipelines, places = [], {}
    for part in estimators_within(model):
        if isinstance(part, Pipeline):
            places.update({id(step): f"Step {name!r}" for name, step in part.steps})
            # CalibratedClassifierCV keeps the pipeline that it was made from, which is not fitted.
            pipelines += [part] if is_fitted(part) else []
        elif isinstance(part, CheckedEstimator):
            try:
                part._check_parameters()
                if is_fitted(part):
                    as_fitted(part)
            except (TypeError, ValueError) as error:
                place = places.get(id(part), type(part).__name__)
                raise ValueError(f"{place}: {error}") from error
    for pipeline in pipelines:
        _check_widths(pipeline)


def _check_widths(pipeline):
    """Compare the number of columns that each step returns with the next step's input."""
    width = None
    for name, step in pipeline.steps:
        n_features = vars(step).get("n_features_in_", width)
        if width is not None and n_features != width:
            raise ValueError(
                f"Step {name!r}: n_features_in_ == {n_features}, but the step before returns "
                f"{width} columns."
            )
        # The last step may be no transformer.
        if step is not pipeline.steps[-1][1]:
            width = len(step.get_feature_names_out())
