"""Checks of stated shaft speeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .state import expect
from .validation import as_samples, warn_user

#: Least number of revolutions of the shaft in a stretch whose orders are compared.
LEAST_REVOLUTIONS = 3
#: Turns of these that must be left after cutting: a stretch loses the samples in which
#: a model settles, and those that do not fill a window.
REVOLUTIONS_LEFT = 2.85
#: A stated speed counts as an error if it lies farther than this factor outside the
#: training speeds, or varies by more within a row. Hertz instead of revolutions per
#: minute are a factor of
#: 60. Order tracking computes frames and blocks for the mean speed of a row: in
#: simulated run-ups of 1 s and 2 s, locations of faults were found up to the factor 12,
#: and not always at 16.
SPEED_FACTOR = 5.0
#: Speeds in rev/min between which one is plausible if there are no training speeds.
_ANY_SPEED = (0.1, 1e6)


def speeds_of_rows(rpm: ArrayLike, n_rows: int) -> NDArray[np.float64]:
    """Return stated speeds as an array, in which one number stands for all rows.

    Parameters
    ----------
    rpm : float or array-like
        Revolutions per minute.
    n_rows : int
        Number of rows.

    Returns
    -------
    ndarray of shape (n_rows,), or of the shape of `rpm`
        Speeds, which are not checked.

    Raises
    ------
    ValueError
        If `rpm` does not hold numbers.

    Examples
    --------
    >>> speeds_of_rows(900, 2)
    array([900., 900.])
    """
    try:
        given = np.asarray(as_samples(rpm, "rpm"))
        if given.dtype.kind == "c":
            raise TypeError("NumPy would take the real part.")
        speeds = given.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rpm must hold numbers, got {rpm!r}.") from error
    return np.full(n_rows, speeds) if speeds.ndim == 0 else speeds


def speed_errors(
    rpm: ArrayLike, n_rows: int, train_rpm: Sequence[float] = ()
) -> NDArray[Any]:
    """Return for each row why its stated speed cannot be true, or varies too much.

    Parameters
    ----------
    rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples)
        Stated speeds in revolutions per minute.
    n_rows : int
        Number of rows.
    train_rpm : sequence of float, default=()
        Training speeds. If there are none, speeds from 0.1 to 1e6 rev/min are accepted.

    Returns
    -------
    ndarray of str of shape (n_rows,)
        Reasons; empty if the speed is plausible.

    Raises
    ------
    ValueError
        If `rpm` does not hold numbers or has another shape.

    Examples
    --------
    >>> speed_errors([900.0, 15.0, float("nan")], 3, train_rpm=[600.0, 1200.0]).tolist()
    ['', 'speed 15 rpm is outside 120 to 6000 rpm', 'speed nan rpm is not a number above 0']
    """
    speeds = speeds_of_rows(rpm, n_rows)
    fits = speeds.ndim in (1, 2) and len(speeds) == n_rows
    expect(fits, "rpm.shape", speeds.shape, f"one speed for each of {n_rows} rows")
    lowest, highest = _ANY_SPEED
    if len(train_rpm) > 0:
        lowest = min(train_rpm) / SPEED_FACTOR
        highest = max(train_rpm) * SPEED_FACTOR
    speeds = speeds.reshape(n_rows, -1)
    is_plausible = (speeds >= lowest) & (speeds <= highest)
    lows = speeds.min(axis=1)
    highs = speeds.max(axis=1)
    varies = highs > SPEED_FACTOR * lows
    errors = np.full(n_rows, "", dtype=object)
    for row in np.flatnonzero(varies | ~is_plausible.all(axis=1)):
        speed = speeds[row, is_plausible[row].argmin()]
        errors[row] = f"speed {speed:g} rpm is outside {lowest:g} to {highest:g} rpm"
        if not 0 < speed < np.inf:
            errors[row] = f"speed {speed:g} rpm is not a number above 0"
        elif is_plausible[row].all():
            errors[row] = (
                f"speed varies from {lows[row]:g} to {highs[row]:g} rpm within the row"
            )
    return errors


def with_plausible_speeds(
    rpm: ArrayLike | None, n_rows: int, train_rpm: Sequence[float] = ()
) -> tuple[Any, NDArray[np.bool_]]:
    """Replace implausible speeds by a training speed, and warn once of these rows.

    Parameters
    ----------
    rpm, n_rows, train_rpm
        As in `speed_errors`; `rpm` may be None.

    Returns
    -------
    rpm : ndarray of shape (n_rows,) or (n_rows, n_samples), or None
        Speeds, with the first training speed for rows without a plausible one.
    is_plausible : ndarray of bool of shape (n_rows,)
        Rows whose speed was not replaced. Estimators treat other rows as rows without a
        signal.

    Raises
    ------
    ValueError
        If one number stands for all rows, and is not above 0.

    Warns
    -----
    UserWarning
        If the speed of a row is not plausible.

    Examples
    --------
    >>> with_plausible_speeds(None, 2)
    (None, array([ True,  True]))
    """
    if rpm is None:
        return None, np.ones(n_rows, dtype=bool)
    # One number stands for all rows, none of which would have a speed.
    if np.ndim(rpm) == 0:
        speed = float(speeds_of_rows(rpm, 1)[0])
        expect(
            0 < speed < np.inf, "rpm", speed, "revolutions per minute above 0, or None"
        )
    errors = speed_errors(rpm, n_rows, train_rpm)
    is_plausible = errors == ""
    if is_plausible.all():
        return rpm, is_plausible
    warn_user(
        f"{np.sum(~is_plausible)} of {n_rows} rows are treated as rows without a signal: "
        f"{errors[~is_plausible][0]}. rpm must be in revolutions per minute."
    )
    speeds = speeds_of_rows(rpm, n_rows).copy()
    speeds[~is_plausible] = train_rpm[0] if len(train_rpm) > 0 else 1.0
    return speeds, is_plausible


def samples_per_revolution(
    rpm: ArrayLike,
    sampling_rate: float | None,
    n_stretches: int,
    n_samples: int,
    least_revolutions: float = LEAST_REVOLUTIONS,
) -> NDArray[Any]:
    """Compute the samples in a revolution of the shaft from nominal speeds.

    Parameters
    ----------
    rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples)
        Revolutions per minute.
    sampling_rate : float or None
        In Hz.
    n_stretches, n_samples : int
        Shape of the stretches.
    least_revolutions : float, default=3
        Turns that a stretch must have.

    Returns
    -------
    ndarray of shape (n_stretches,) or (n_stretches, n_samples)
        Samples in a revolution.

    Raises
    ------
    ValueError
        If there is no sampling rate; if a speed is not above 0 or the shape is another;
        or if a stretch has fewer revolutions, or a revolution has less than two samples.
    """
    expect(
        sampling_rate is not None,
        "sampling_rate",
        None,
        "a number in Hz, as rpm is given",
    )
    speeds = check_speeds(rpm, n_stretches, n_samples)
    fastest = float(speeds.max())
    least_rate = 2 * fastest / 60
    expected = (
        f"at least {least_rate:g} Hz: a revolution at {fastest:g} rpm must take two "
        "samples"
    )
    expect(sampling_rate >= least_rate, "sampling_rate", sampling_rate, expected)
    mean = speeds if speeds.ndim == 1 else speeds.mean(axis=1)
    n_revolutions = float(n_samples * mean.min() / (60 * sampling_rate))
    needed = np.ceil(least_revolutions * 60 * sampling_rate / mean.min())
    name = (
        f"Turns in {n_samples} samples at {mean.min():g} rpm and {sampling_rate:g} Hz"
    )
    expected = f"at least {least_revolutions}, or {needed:g} samples"
    expect(n_revolutions >= least_revolutions, name, round(n_revolutions, 3), expected)
    return 60 * sampling_rate / speeds


def check_speeds(
    rpm: ArrayLike, n_stretches: int, n_samples: int | None
) -> NDArray[Any]:
    """Check nominal speeds, and return those of the last samples.

    Parameters
    ----------
    rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples)
        Revolutions per minute.
    n_stretches : int
        Number of stretches.
    n_samples : int or None
        Samples of a stretch. None: as many as `rpm` has.

    Returns
    -------
    ndarray of shape (n_stretches,) or (n_stretches, n_samples)
        Speeds. Innovations lack the first samples of a stretch, for which a model is
        still settling; where speeds have more samples than the stretches, the last ones
        are taken.

    Raises
    ------
    ValueError
        If a speed is not above 0, or the shape is another.
    """
    speeds = speeds_of_rows(rpm, n_stretches)
    n_samples = n_samples or speeds.shape[-1]
    is_long = speeds.ndim == 2 and n_samples <= speeds.shape[1] <= 2 * n_samples
    fits = len(speeds) == n_stretches and (speeds.ndim == 1 or is_long)
    expected = f"one speed for each of {n_stretches} rows or for each of their {n_samples} samples"
    expect(fits, "rpm.shape", speeds.shape, expected)
    is_speed = np.isfinite(speeds) & (speeds > 0)
    at = np.unravel_index(is_speed.argmin(), speeds.shape)
    expect(
        is_speed,
        f"rpm of row {at[0]}",
        float(speeds[at]),
        "revolutions per minute above 0",
    )
    return speeds if speeds.ndim == 1 else speeds[:, -n_samples:]


def log_speeds(
    rpm: ArrayLike | None, n_rows: int, n_samples: int | None = None
) -> NDArray[Any] | None:
    """Return the natural logarithm of the mean speed of each row.

    Parameters
    ----------
    rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), or None
        Revolutions per minute.
    n_rows : int
        Number of rows.
    n_samples : int or None, default=None
        As in `check_speeds`.

    Returns
    -------
    ndarray of shape (n_rows,) or None
        Logarithms. None if `rpm` is None.

    Raises
    ------
    ValueError
        If a speed is not above 0, or the shape is another.

    Examples
    --------
    >>> log_speeds([[0.5, 1.5], [1.0, 1.0]], 2)
    array([0., 0.])
    """
    if rpm is None:
        return None
    speeds = check_speeds(rpm, n_rows, n_samples)
    return np.log(speeds if speeds.ndim == 1 else speeds.mean(axis=1))
