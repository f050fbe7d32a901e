"""Checks of what estimators are given."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_array, check_scalar, get_tags
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data

from ._state import check_state


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
        check_is_fitted(estimator)
        check_state(estimator)
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


def check_alarm(false_alarm_rate: float, margin_db: float) -> None:
    """Check what sets a detection threshold.

    Parameters
    ----------
    false_alarm_rate : float
        In (0, 1).
    margin_db : float
        From -1000 to 1000.

    Raises
    ------
    TypeError, ValueError
        As in `check_real`.
    """
    check_real(
        false_alarm_rate, "false_alarm_rate", min_val=0, max_val=1, include_boundaries="neither"
    )
    check_real(margin_db, "margin_db", min_val=-1000, max_val=1000)
