"""Checks of input and of parameters."""

import inspect
import sys
import warnings
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import OneToOneFeatureMixin
from sklearn.utils import (
    check_array,
    check_consistent_length,
    check_scalar,
    column_or_1d,
    get_tags,
)
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import validate_data

from .batches import RowsInBatches
from .state import expect


def validate_signals(
    estimator: Any,
    X: ArrayLike,
    y: Any = None,
    *,
    reset: bool,
    any_length: bool = False,
) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Check an array of two or three axes, and conditions if there are any.

    Parameters
    ----------
    estimator : estimator
        Its `n_features_in_` and `window_shape_`, the shape of one window, are set or
        compared.
    X : array-like of two or three axes
        Signals along the last one.
    y : array-like of shape (n_windows,) or None, default=None
        Conditions.
    reset : bool
        True in `fit`.
    any_length : bool, default=False
        Whether windows with an axis of channels may be longer or shorter than in `fit`.
        scikit-learn's contract fixes the length of windows without that axis, which are
        rows of a table.

    Returns
    -------
    X : ndarray
        float64 or float32.
    y : ndarray of shape (n_windows,) or None
        Conditions.

    Raises
    ------
    ValueError
        If X has another number of axes, channels or samples than in `fit`, or y has no
        classes or is missing although required.
    """
    if isinstance(X, RowsInBatches):
        if reset and estimator._learns_in_batches:
            return X, _validate_batches(estimator, X, y)
        X = np.asarray(X)
    X = as_samples(X, "X")
    # scikit-learn converts big-endian float32 to float64, but the byte order must not
    # matter.
    if isinstance(X, np.ndarray) and not X.dtype.isnative:
        X = X.astype(X.dtype.newbyteorder("="))
    if not reset:
        fitted = tuple(estimator.window_shape_.tolist())
        if y is None and is_plain(estimator, X, fitted):
            return X, None
        shape = np.asarray(X).shape[1:]
        if any_length and y is None and len(fitted) == 1 and shape[:-1] == (1,):
            return check_array(
                np.asarray(X)[:, 0], dtype=[np.float64, np.float32]
            ), None
        _check_window_shape(estimator, shape, any_length)
    check = {"dtype": [np.float64, np.float32], "allow_nd": True, "reset": reset}
    if y is None and not (reset and get_tags(estimator).target_tags.required):
        X = validate_data(estimator, X, **check)
    else:
        check_labels(y)
        X, y = validate_data(estimator, X, y, **check)
        check_classification_targets(y)
    shapes = (
        "(n_rows, n_samples) or (n_rows, n_channels, n_samples), or models for channels"
    )
    expect(X.ndim <= 3, "X.shape", X.shape, shapes)
    if reset:
        estimator.window_shape_ = np.array(X.shape[1:])
    return X, y


def _validate_batches(estimator, X, y):
    """Check the first row, which sets the attributes of `fit`, and the conditions of all."""
    first = None if y is None else column_or_1d(y, warn=True)
    validate_signals(estimator, X[:1], None if first is None else first[:1], reset=True)
    if first is not None:
        check_consistent_length(X, first)
        check_labels(y)
        check_classification_targets(first)
    return first


def as_samples(values: Any, name: str) -> Any:
    """Return values in which masked ones are NaN, and refuse flags and times.

    NumPy would take the hidden value of a masked sample, 1 for True, and the nanoseconds
    of a time. `check_array` and `validate_data` refuse complex numbers.

    Parameters
    ----------
    values : object
        Samples or speeds, which are not converted otherwise.
    name : str
        Name of the parameter.

    Raises
    ------
    ValueError
        If the values are True and False, or times.

    Examples
    --------
    >>> as_samples(np.ma.array([1, 2], mask=[False, True]), "X")
    array([ 1., nan])
    """
    if isinstance(values, np.ma.MaskedArray):
        return (
            values.astype(np.float64).filled(np.nan)
            if np.ma.is_masked(values)
            else values.data
        )
    dtype = np.asarray(values).dtype
    if dtype.kind in "bmM":
        expect(False, f"{name}.dtype", str(dtype), "real numbers")
    return values


def is_plain(estimator: Any, X: Any, shape: tuple[int, ...]) -> bool:
    """Return whether X is an array of finite floats, with rows of the shape of `fit`.

    `validate_data` returns such an array unchanged. Its checks of tables and of other
    libraries' arrays take longer than the diagnosis of one window, and every step of a
    pipeline repeats them.
    """
    return (
        type(X) is np.ndarray
        and X.dtype in (np.float64, np.float32)
        and X.size > 0
        and X.shape[1:] == shape
        and "feature_names_in_" not in vars(estimator)
        and bool(np.isfinite(X).all())
    )


def _check_window_shape(estimator, shape, any_length):
    """Raise an error in terms of channels and samples; scikit-learn would name features."""
    fitted = tuple(estimator.window_shape_.tolist())
    # scikit-learn checks rows of a table, and everything else.
    if len(shape) not in (1, 2) or len(shape) == len(fitted) == 1:
        return
    any_length = any_length and len(shape) == len(fitted) == 2
    fits = shape == fitted or (any_length and shape[0] == fitted[0])
    name = f"X has windows of shape {shape}, but {type(estimator).__name__}"
    if not fits:
        raise ValueError(
            f"{name} was fitted on windows of shape {fitted}: channels, then samples."
        )


def check_labels(y: ArrayLike | None) -> None:
    """Refuse labels of which some are texts and some are numbers.

    They cannot be sorted, and NumPy would make texts of the numbers.

    Examples
    --------
    >>> check_labels(["normal", 3])
    Traceback (most recent call last):
        ...
    ValueError: y == ['normal', 3], expected labels that are all texts or all numbers.
    """
    if np.ma.is_masked(y):
        expect(False, "Masked labels in y", np.ma.count_masked(y), "none")
    if isinstance(y, np.ndarray) and y.dtype != object:
        return
    kinds = {isinstance(label, str): label for label in np.asarray(y, object).ravel()}
    expected = "labels that are all texts or all numbers"
    expect(len(kinds) < 2, "y", [*kinds.values()], expected)


def validate_innovations(
    estimator: Any,
    X: ArrayLike,
    y: Any = None,
    *,
    reset: bool,
    any_length: bool = False,
) -> tuple[NDArray[Any], NDArray[Any] | None]:
    """Check innovations as `validate_signals` does, and return them with three axes.

    Plain windows are the innovations of one model that predicts nothing. `fit` stores
    the number of models in `n_models_`, 0 for plain windows.
    """
    X, y = validate_signals(estimator, X, y, reset=reset, any_length=any_length)
    if reset:
        estimator.n_models_ = X.shape[1] if X.ndim == 3 else 0
    return (X if X.ndim == 3 else X[:, np.newaxis]), y


def output_of_windows(X: NDArray[Any]) -> NDArray[Any]:
    """Return the output of windows: the first of their channels, or all that they hold.

    Parameters
    ----------
    X : ndarray of shape (n_windows[, n_channels], n_samples)
        Windows.

    Returns
    -------
    ndarray of shape (n_windows, n_samples)
        A view of `X`.
    """
    return X if X.ndim == 2 else X[:, 0]


def of_one_model(X: NDArray[Any]) -> NDArray[Any]:
    """Return innovations of shape (n_windows, n_samples), and refuse those of several models."""
    one = "1 model, as of ARXLaguerre(bank=False)"
    expect(X.shape[1] == 1, "Number of models in X", X.shape[1], one)
    return X[:, 0]


def weighted_windows(
    X: NDArray[Any], y: NDArray[Any] | None, sample_weight: ArrayLike | None
) -> tuple[Any, Any, NDArray[Any]]:
    """Return the windows of weight above 0, and their weights.

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
        If there is not one finite number of at least 0 for each window, or none is
        above 0.

    Examples
    --------
    >>> weighted_windows(np.array([[1.0], [2.0]]), np.array(["a", "b"]), [0, 3])
    (array([[2.]]), array(['b'], dtype='<U1'), array([3.]))
    """
    if sample_weight is None:
        return X, y, np.ones(len(X))
    check = {"dtype": np.float64, "ensure_2d": False, "input_name": "sample_weight"}
    weights = check_array(as_samples(sample_weight, "sample_weight"), **check)
    expected = f"{(len(X),)}, one weight for each window"
    expect(weights.shape == (len(X),), "sample_weight.shape", weights.shape, expected)
    is_weight = weights.min() >= 0 and weights.max() > 0
    expect(
        is_weight,
        "sample_weight",
        weights,
        "weights of at least 0, not all of them zero",
    )
    counted = weights > 0
    if counted.all():
        return X, y, weights
    return X[counted], (None if y is None else y[counted]), weights[counted]


def check_input_names(
    estimator: Any, input_features: ArrayLike | None
) -> NDArray[Any] | None:
    """Return the names of the features that an estimator was fitted on, or None without names.

    A ValueError is raised if `input_features` are not the features of `fit`.
    """
    if input_features is None and "feature_names_in_" not in vars(estimator):
        return None
    return OneToOneFeatureMixin.get_feature_names_out(estimator, input_features)


#: Lowest sampling rate of a vibration signal in Hz. Lower numbers commonly are
#: kilohertz.
_LEAST_SAMPLING_RATE = 100.0
#: Bounds for `check_real`: numbers above 0, in (0, 1], and in (-1, 1).
ABOVE_0 = {"min_val": 0, "include_boundaries": "neither"}
UP_TO_1 = {"min_val": 0, "max_val": 1, "include_boundaries": "right"}
WITHIN_1 = {"min_val": -1, "max_val": 1, "include_boundaries": "neither"}


def check_real(value: Any, name: str, **bounds: Any) -> None:
    """Check a real parameter, which must be finite, by `sklearn.utils.check_scalar`."""
    expect(not isinstance(value, bool | np.bool_), name, value, "a number")
    check_scalar(value, name, Real, **bounds)
    # An integer may exceed all floats.
    if not abs(value) <= sys.float_info.max:
        raise ValueError(f"{name} == {value}, must be finite.")


def check_sampling_rate(value: Any) -> None:
    """Check the sampling rate of signals whose orders or impacts count.

    Raises
    ------
    ValueError
        If it is missing, not above 0, or so low that it must be in kilohertz.

    Examples
    --------
    >>> check_sampling_rate(20)
    Traceback (most recent call last):
        ...
    ValueError: sampling_rate == 20, expected at least 100 Hz. For 20 kHz, give 20000.
    """
    expect(
        value is not None,
        "sampling_rate",
        value,
        "the sampling rate of the rows, in Hz",
    )
    check_real(value, "sampling_rate", **ABOVE_0)
    expected = f"at least {_LEAST_SAMPLING_RATE:g} Hz. For {value:g} kHz, give {1000 * value:g}"
    expect(value >= _LEAST_SAMPLING_RATE, "sampling_rate", value, expected)


def check_count(value: Any, name: str, least: int = 1) -> Any:
    """Return a number of things: an integer that the length of an array can be, and no flag."""
    expect(not isinstance(value, bool), name, value, "an integer")
    return check_scalar(value, name, Integral, min_val=least, max_val=2**31 - 1)


def check_flag(value: Any, name: str) -> None:
    """Check a parameter that is True or False; a text such as "no" would count as True."""
    check_scalar(value, name, (bool, np.bool_))


def warn_user(text: str) -> None:
    """Issue a UserWarning for the line that called this package, or scikit-learn about it."""
    names = [caller.frame.f_globals.get("__name__", "") for caller in inspect.stack(0)]
    ours = [
        n
        for n, name in enumerate(names, 1)
        if name.split(".")[0] in ("skarxlag", "sklearn")
    ]
    warnings.warn(text, stacklevel=ours[-1] + 1)


def check_rate(value: float, name: str) -> None:
    """Check a rate of false alarms or rejections, in (0, 1)."""
    check_real(value, name, max_val=1, **ABOVE_0)
