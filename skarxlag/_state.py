"""Whether what an estimator learnt is consistent, before compiled code sees it.

Compiled loops do not check bounds, so arrays of wrong shapes would make them read and write foreign
memory. Every estimator therefore has a method `_check_state`, written with the helpers below. It
raises a ValueError that names the attribute. `load_diagnoser` calls it once for every step, and
`check_state` calls it when an estimator is used for the first time.
"""

import operator
import weakref
from collections.abc import Callable, Iterator
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

#: Parameters that may change after `fit`: no result depends on them.
_FREE_PARAMETERS = {"n_jobs", "verbose"}
#: Larger coefficients have squares that overflow when a few of them are summed.
_LARGEST = 1e150
_KINDS = {"f": "numbers", "i": "integers", "b": "booleans"}
_sound: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


def check_state(estimator: Any) -> None:
    """Call ``estimator._check_state()``, unless nothing has changed since it last passed.

    Looking at whether an attribute was replaced costs some microseconds. Values that are changed in
    place are seen in arrays of up to 16 entries, such as the orders of a network; in larger arrays
    they cannot change a shape.

    Parameters
    ----------
    estimator : estimator
        Fitted.
    """
    values = list(vars(estimator).values())
    known, small = _sound.get(estimator, ((), ()))
    if (
        len(known) == len(values)
        and all(map(operator.is_, known, values))
        and all(array.tobytes() == content for array, content in small)
    ):
        return
    check_parameters(estimator)
    estimator._check_state()
    small = [(v, v.tobytes()) for v in values if isinstance(v, np.ndarray) and v.size <= 16]
    _sound[estimator] = values, small


def estimators_within(value: Any) -> Iterator[Any]:
    """A model, and everything of scikit-learn and of this package that is a part of it.

    Parameters
    ----------
    value : object
        A model; or a list of parts, or anything else, which has none.

    Yields
    ------
    object
        An estimator, or what scikit-learn keeps one in.
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


def check_model_state(model: Any) -> None:
    """Check every fitted estimator within a model.

    Parameters
    ----------
    model : estimator
        A fitted pipeline, or one that scikit-learn has wrapped, as `CalibratedClassifierCV` does.

    Raises
    ------
    ValueError
        As in `check_pipeline_state`.
    """
    in_pipelines = set()
    for part in estimators_within(model):
        if isinstance(part, Pipeline):
            in_pipelines.update(id(step) for _, step in part.steps)
            # What is calibrated keeps the pipeline that it was made from, which is not fitted.
            if is_fitted(part):
                check_pipeline_state(part)
        elif hasattr(part, "_check_state") and id(part) not in in_pipelines and is_fitted(part):
            check_state(part)


def is_fitted(estimator: BaseEstimator) -> bool:
    """Whether `fit` has been called."""
    try:
        check_is_fitted(estimator)
    except NotFittedError:
        return False
    return True


def check_pipeline_state(pipeline: Pipeline) -> None:
    """Check every step of a fitted pipeline, and the widths of the steps against each other.

    Parameters
    ----------
    pipeline : Pipeline
        Fitted.

    Raises
    ------
    ValueError
        If an attribute is not what `fit` could have made. The message names the step, the
        attribute, its value and what was expected.
    """
    width = None
    for name, step in pipeline.steps:
        try:
            if hasattr(step, "_check_state"):
                check_state(step)
            n_features = getattr(step, "n_features_in_", width)
            if width is not None and n_features != width:
                raise ValueError(
                    f"n_features_in_ == {n_features}, but the step before gives {width} columns."
                )
            # A pipeline at the end, which decides, has the method, but names nothing.
            is_last = step is pipeline.steps[-1][1]
            if not is_last and hasattr(step, "get_feature_names_out"):
                width = len(step.get_feature_names_out())
        except ValueError as error:
            raise ValueError(f"Step {name!r}: {error}") from error


def remember_parameters(estimator: Any) -> None:
    """Note the parameters at the end of `fit`, for `check_parameters`."""
    parameters = estimator.get_params(deep=False)
    estimator._parameters = np.array(
        [
            f"{name}={_plain(parameters[name])!r}"
            for name in sorted(parameters.keys() - _FREE_PARAMETERS)
        ]
    )


def check_parameters(estimator: Any) -> None:
    """Refuse an estimator whose parameters are not those that it was fitted with.

    Parameters
    ----------
    estimator : estimator
        Fitted; `remember_parameters` was called at the end of its `fit`.

    Raises
    ------
    ValueError
        If a parameter was changed since. What was learnt would not fit to it.
    """
    entries = getattr(estimator, "_parameters", None)
    if not isinstance(entries, np.ndarray) or entries.ndim != 1 or entries.dtype.kind != "U":
        raise ValueError("_parameters is not a list of texts, as `fit` notes them.")
    fitted = dict(entry.split("=", 1) for entry in entries.tolist() if "=" in entry)
    present = estimator.get_params(deep=False)
    for name in sorted(present.keys() - _FREE_PARAMETERS):
        value = repr(_plain(present[name]))
        if fitted.get(name) != value:
            raise ValueError(
                f"{name} == {value}, but {type(estimator).__name__} was fitted with "
                f"{name}={fitted.get(name)}. Call fit again after a parameter was changed."
            )


def _plain(value):
    """The same value for every version of NumPy, and after a way through a file."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if hasattr(value, "get_params"):
        parameters = value.get_params(deep=False)
        kept = sorted(parameters.keys() - _FREE_PARAMETERS)
        return type(value).__name__, [(name, _plain(parameters[name])) for name in kept]
    return value


def check_fitted_array(
    estimator: Any,
    name: str,
    shape: tuple[Any, ...] | None,
    *,
    given: str | None = None,
    kind: str = "f",
    valid: Callable[..., Any] | None = None,
    expected: str | None = None,
) -> NDArray[Any]:
    """Check an array that `fit` made.

    Parameters
    ----------
    estimator : estimator
        Fitted.
    name : str
        The attribute.
    shape : tuple of int or None
        The expected shape; None for a length that is not known.
    given : str or None, default=None
        The attributes that the shape follows from, for the message.
    kind : {"f", "i"}, default="f"
        Floating-point numbers, which must be finite, or integers.
    valid : callable or None, default=None
        Takes the array; says for each entry, or for all together, whether it is in range.
    expected : str or None, default=None
        The range in words, for the message.

    Returns
    -------
    ndarray
        The array.

    Raises
    ------
    ValueError
        If it is not such an array. The message names the attribute.

    Examples
    --------
    >>> from sklearn.linear_model import LinearRegression
    >>> model = LinearRegression().fit([[0.0], [1.0]], [0.0, 1.0])
    >>> model.coef_ = np.zeros(0)
    >>> check_fitted_array(model, "coef_", (1,))
    Traceback (most recent call last):
        ...
    ValueError: coef_ has shape (0,), expected (1,).
    """
    value = getattr(estimator, name, None)
    if not isinstance(value, np.ndarray):
        raise ValueError(f"{name} == {value!r}, expected an array of {_KINDS[kind]}.")
    kinds = "iu" if kind == "i" else kind
    if value.dtype.kind not in kinds or value.dtype.itemsize > 8 or not value.dtype.isnative:
        raise ValueError(f"{name} has dtype {value.dtype}, expected an array of {_KINDS[kind]}.")
    if value.ndim != len(shape) or any(
        wanted is not None and wanted != found
        for wanted, found in zip(shape, value.shape, strict=True)
    ):
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        wanted = f"({wanted}{',' if len(shape) == 1 else ''})"
        reason = "" if given is None else f", as {given} have it"
        raise ValueError(f"{name} has shape {value.shape}, expected {wanted}{reason}.")
    if not np.all(np.isfinite(value)):
        worst = value.flat[np.argmin(np.isfinite(value))]
        raise ValueError(f"{name} holds {worst}, expected finite numbers.")
    if valid is not None and not np.all(valid(value)):
        raise ValueError(f"{name} == {_short(value)}, expected {expected}.")
    return value


def is_moderate(values: Any) -> NDArray[np.bool_]:
    """Whether squares of the values can be summed without overflow."""
    return np.abs(values) < _LARGEST


def check_fitted_number(
    estimator: Any,
    name: str,
    *,
    kind: str = "f",
    valid: Callable[..., Any] | None = None,
    expected: str | None = None,
) -> float | int:
    """Check a number that `fit` found.

    Parameters
    ----------
    estimator : estimator
        Fitted.
    name : str
        The attribute.
    kind : {"f", "i"}, default="f"
        A finite number, or an integer.
    valid : callable or None, default=None
        Takes the number; says whether it is in range.
    expected : str or None, default=None
        The range in words, for the message.

    Returns
    -------
    float or int
        The number.

    Raises
    ------
    ValueError
        If it is not such a number. The message names the attribute.
    """
    value = getattr(estimator, name, None)
    of_kind = isinstance(value, Integral if kind == "i" else Real) and not isinstance(value, bool)
    if not of_kind or not np.isfinite(value):
        what = "an integer" if kind == "i" else "a finite number"
        raise ValueError(f"{name} == {value!r}, expected {what}.")
    if valid is not None and not valid(value):
        raise ValueError(f"{name} == {value!r}, expected {expected}.")
    return value


def check_fitted_classes(
    estimator: Any, name: str = "classes_", n_classes: int | None = None
) -> NDArray[Any]:
    """Check an array of different conditions.

    Parameters
    ----------
    estimator : estimator
        Fitted.
    name : str, default="classes_"
        The attribute.
    n_classes : int or None, default=None
        How many there must be; None for any number but 0.

    Returns
    -------
    ndarray of shape (n_classes,)
        The conditions.

    Raises
    ------
    ValueError
        If they are not sorted, some are equal, or their number is another one.
    """
    value = getattr(estimator, name, None)
    is_array = isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "biufUO"
    if not is_array or (value.dtype.kind == "O" and not all(isinstance(v, str) for v in value)):
        raise ValueError(f"{name} == {_short(value)}, expected an array of labels.")
    if len(value) == 0 or n_classes not in (None, len(value)):
        raise ValueError(
            f"{name} has {len(value)} entries, expected {n_classes or 'at least one'}."
        )
    if not np.all(value[:-1] < value[1:]):
        raise ValueError(f"{name} == {_short(value)}, expected different labels, sorted.")
    return value


def check_fitted_input(estimator: Any, *, windows: bool = False) -> None:
    """Check what `fit` noted of its input: `n_features_in_` and the attributes beside it.

    Parameters
    ----------
    estimator : estimator
        Fitted.
    windows : bool, default=False
        Whether the input is made of windows, so that there is `window_shape_`, too.

    Raises
    ------
    ValueError
        If the attributes contradict each other.
    """
    n_features = check_fitted_number(
        estimator, "n_features_in_", kind="i", valid=lambda n: n >= 1, expected="at least 1"
    )
    if windows:
        check_fitted_array(
            estimator,
            "window_shape_",
            (None,),
            kind="i",
            valid=lambda s: len(s) in (1, 2) and np.all(s >= 1) and s[0] == n_features,
            expected=f"one or two lengths, of which the first is n_features_in_={n_features}",
        )
    names = getattr(estimator, "feature_names_in_", None)
    if names is not None and (
        not isinstance(names, np.ndarray)
        or names.shape != (n_features,)
        or not all(isinstance(name, str) for name in names)
    ):
        raise ValueError(
            f"feature_names_in_ == {_short(names)}, expected {n_features} names, one for each of "
            "n_features_in_."
        )


def _short(value):
    text = " ".join(repr(value).split())
    return text if len(text) <= 100 else f"{text[:97]}..."
