"""What detectors need around their limits: speeds of rows, weak calibrations, consistency."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._parallel import BATCH, map_batches
from .kernels.healthy_limits import SLOPES
from .kernels.healthy_rows import Rows, measure_rows
from .kernels.speed_drift import SAME_SPEED, UNIT_DISTANCE


def log_speeds(rpm: ArrayLike | None, n_rows: int) -> NDArray[Any] | None:
    """Logarithms of the speeds of rows.

    Parameters
    ----------
    rpm : float, array-like of shape (n_rows,) or None
        Speeds above 0.
    n_rows : int
        Number of rows.

    Returns
    -------
    ndarray of shape (n_rows,) or None
        None for none.

    Raises
    ------
    ValueError
        If these are no such speeds.

    Examples
    --------
    >>> log_speeds(1.0, 2)
    array([0., 0.])
    """
    if rpm is None:
        return None
    try:
        speeds = np.asarray(rpm, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rpm must hold numbers, got {rpm!r}.") from error
    if speeds.ndim == 0:
        speeds = np.full(n_rows, speeds)
    if speeds.shape != (n_rows,):
        raise ValueError(
            f"rpm has shape {speeds.shape}, expected one speed for each of {n_rows} rows."
        )
    bad = np.flatnonzero(~(np.isfinite(speeds) & (speeds > 0)))
    if len(bad) > 0:
        raise ValueError(
            f"rpm holds {speeds[bad[0]]:g} for row {bad[0]}, expected revolutions per minute "
            "above 0."
        )
    return np.log(speeds)


def measure(X: NDArray[Any], n_windows: int, *, with_level: bool, n_jobs: int | None) -> Rows:
    """Features of rows, computed in batches.

    Parameters
    ----------
    X : ndarray of shape (n_rows, 1, n_samples)
        Rows.
    n_windows : int
        Windows that each row is cut into.
    with_level : bool
        Whether the level is among the features.
    n_jobs : int or None
        Threads.

    Returns
    -------
    Rows
        As `measure_rows` gives them.

    Raises
    ------
    ValueError
        If X holds innovations of several models.
    """
    if X.shape[1] != 1:
        raise ValueError(f"X has the innovations of {X.shape[1]} models, expected those of one.")

    def of_batch(batch):
        return measure_rows(X[batch, 0], n_windows, with_level=with_level)

    parts = map_batches(of_batch, len(X), n_jobs, max(BATCH // n_windows, 1))
    return Rows(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def weak_points(detector: Any, rate: float) -> list[str]:
    """What to say of a calibration that promises less than its user may think.

    Parameters
    ----------
    detector : FaultDetector
        Fitted.
    rate : float
        Stated rate of false alarms.

    Returns
    -------
    list of str
        Sentences with numbers; none if there is nothing to say.
    """
    said, n = [], detector.n_rows_
    if n + 1 < (1 - 1e-9) / rate:
        said.append(
            f"{n} healthy rows hold a false-alarm rate of 1/{n + 1} = {1 / (n + 1):.2g} by "
            f"themselves. The stated {rate:g} rests on Student's t distribution; "
            f"{int(np.ceil(1 / rate - 1e-9)) - 1} rows would hold it."
        )
    if len(detector.speeds_) == 0:
        spectrum, unsteadiness = price_of_unknown_speed(detector)
        said.append(
            "rpm is not given, so the limits are those for a speed that differs by the factor 1.3: "
            f"the spectrum must be {spectrum:.2g} times as far off as at a known speed before a "
            f"row is flagged, the unsteadiness {unsteadiness:.2g} times, and most faults are "
            "missed. If the speed is known, if only as one number for all rows, give it to fit "
            "and to predict."
        )
    if len(detector.speeds_) == 1:
        said.append(
            f"The healthy rows are of one speed, {detector.speeds_[0]:g} rpm: how far a healthy "
            "bearing drifts with speed is taken from experience with others. Healthy rows of "
            "more speeds give narrower limits at other speeds."
        )
    if np.any(detector.left_out_rates_ > rate):
        listed = ", ".join(
            f"{share:.2g} at {speed:g} rpm"
            for share, speed in zip(detector.left_out_rates_, detector.speeds_, strict=True)
        )
        said.append(
            f"No drift scale up to {detector.drift_scale_:g} holds the stated false-alarm rate "
            f"{rate:g} at every speed that is left out: {listed}."
        )
    return said


def price_of_unknown_speed(detector: Any) -> tuple[float, float]:
    r"""By what factors limits are wider at a speed that differs by the factor 1.3.

    Parameters
    ----------
    detector : FaultDetector
        Fitted without speeds.

    Returns
    -------
    spectrum, unsteadiness : float
        The root of the geometric mean of
        :math:`(\lambda_i + 1 + 0.02) / (\lambda_i + 0.02)` over the scatter
        :math:`\lambda_i` of the cepstra in units of the drift; and the ratio of the deviations of
        the log unsteadiness.
    """
    scatter = detector.variances_
    spectrum = np.exp(np.mean(np.log((scatter + 1 + SAME_SPEED) / (scatter + SAME_SPEED))) / 2)
    drift = SLOPES[0]["drift"] ** 2
    own = detector.deviations_[0] ** 2 * (1 + 1 / detector.n_blocks_)
    far = own + (1 + SAME_SPEED) * drift + detector.slopes_[0, 1] * UNIT_DISTANCE**2
    return float(spectrum), float(np.sqrt(far / (own + SAME_SPEED * drift)))
