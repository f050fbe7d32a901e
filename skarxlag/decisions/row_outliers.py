"""Outlier detector of rows at any speed, on which detectors of faults and of conditions build."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, OutlierMixin
from sklearn.utils import Bunch

from ..core.base import SignalEstimator
from ..core.batches import chosen_rows
from ..core.parallel import BATCH, map_batches
from ..core.speeds import log_speeds, with_plausible_speeds
from ..core.state import uses_fitted
from ..core.validation import (
    of_one_model,
    validate_innovations,
    warn_user,
    weighted_windows,
)
from ..kernels.healthy_limits import Rows, measure_windows
from ..kernels.ladder import rows_that_hold

#: Samples that a spectrum takes at least. The level of shorter rows always counts.
_SHORTEST_SPECTRUM = 8
#: Log p-value of a row without a plausible speed: the p-value is the smallest above 0.
_LEAST_LOG_P = float(np.log(np.finfo(np.float32).tiny))


class RowOutlierDetector(SignalEstimator, OutlierMixin, BaseEstimator):
    """Outlier detector whose score is the logarithm of a p-value.

    A subclass sets `offset_`, the logarithm of the stated rate, and its other fitted
    attributes in `_learn`, where NaN is an unknown speed, and which returns sentences
    to warn of. Its method `_detectors` returns one `FaultDetector` for each set of
    limits.
    """

    window_length: int
    n_jobs: int | None
    offset_: float
    #: Whether `fit` is given conditions.
    _has_conditions: ClassVar[bool] = False
    _learns_in_batches = True

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        self._check_number("offset_", "below 0")

    def fit(
        self,
        X: ArrayLike,
        y: Any = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Calibrate the limits.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Windows or stretches, or the innovations of one model; at least two of one
            condition and speed. Rows of one condition and speed are in the order of
            time.
        y : array-like of shape (n_rows,) or None, default=None
            Condition of each row, for `KnownConditions`; None: all rows are of one
            condition. For `FaultDetector` all rows must be healthy, whatever their
            labels are.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), or None, default=None
            Speed of the shaft in each row, in revolutions per minute. Of a speed for
            each sample, the mean counts. None: all rows are of one speed, which is not
            known, and the limits are those for a speed that differs by the factor 1.3.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            Weight of each row in means and covariances, at least 0; only ratios count.
            None: all are equal. A row of weight 2 counts like two equal rows. The
            numbers of rows and of blocks of time, which state how well the limits are
            known, do not depend on weights. A row of weight 0 is left out.

        Returns
        -------
        estimator
            The fitted detector.

        Raises
        ------
        ValueError
            If a parameter is out of its range, a speed is not above 0, no condition has
            two rows of one speed, or a weight is negative.

        Warns
        -----
        UserWarning
            If there are fewer rows than the stated rate needs, `FaultDetector` is given
            several labels, `rpm` is not given, all rows of a condition are of one
            speed, a condition is left out because it has no two rows of one speed, or
            no drift scale holds the rate at left-out speeds.
        """
        conditions = y if self._has_conditions else None
        X, conditions = validate_innovations(self, X, conditions, reset=True)
        self._check_parameters()
        log_speed = log_speeds(rpm, len(X), X.shape[-1])
        if log_speed is None:
            log_speed = np.full(len(X), np.nan)
        rows, conditions, weights = weighted_windows(
            np.arange(len(X)), conditions, sample_weight
        )
        if sample_weight is not None:
            X = chosen_rows(X, rows)
        measured = self._measured(X, max(X.shape[-1] // self.window_length, 1))
        weak_points = self._learn(measured, conditions, log_speed[rows], weights)
        if not self._has_conditions:
            weak_points = [*_ignored_labels(y), *weak_points]
        for sentence in weak_points:
            warn_user(sentence)
        return self

    def score_samples(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the logarithm of the p-value of each row.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `p_values`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Finite, at most 0; lower is more abnormal. With several conditions, that of
            the nearest condition.
        """
        return self._log_p_values(X, rpm).max(axis=1)

    def decision_function(
        self, X: ArrayLike, rpm: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Compute the logarithm of the p-value over the stated rate.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `score_samples`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Natural logarithms, negative for outliers.
        """
        return self.diagnose(X, rpm).score

    def predict(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Return 1 for rows like those of `fit`, and -1 for outliers.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `score_samples`.

        Returns
        -------
        ndarray of int of shape (n_rows,)
            1 or -1.
        """
        return self.diagnose(X, rpm).verdict

    def diagnose(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute verdict, score and p-values of each row from one set of measures.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `score_samples`.

        Returns
        -------
        Bunch
            ``verdict``, as of `predict`; ``score``, as of `decision_function`;
            ``alarm``, of bool: whether the score is below 0; and ``p_values`` of shape
            (n_rows, n_conditions), of a `FaultDetector` with one column.
        """
        log_p_values = self._log_p_values(X, rpm)
        score = log_p_values.max(axis=1) - self.offset_
        return Bunch(
            verdict=np.where(score < 0, -1, 1),
            score=score,
            alarm=score < 0,
            p_values=np.exp(log_p_values),
        )

    def fit_predict(self, X: ArrayLike, y: Any = None, **params: Any) -> NDArray[Any]:
        """Fit, and classify the same rows.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        y : array-like of shape (n_rows,) or None, default=None
            As in `fit`.
        **params : dict of str to object
            ``rpm`` and ``sample_weight``, as in `fit`.

        Returns
        -------
        ndarray of int of shape (n_rows,)
            1 or -1.
        """
        return self.fit(X, y, **params).predict(X, rpm=params.get("rpm"))

    @uses_fitted
    def _log_p_values(self, X, rpm):
        """Compute log p-values of shape (n_rows, n_detectors)."""
        X, _ = validate_innovations(self, X, reset=False)
        detectors = self._detectors()
        log_speed, is_plausible = self._log_speeds(rpm, X, _speeds_of(detectors))
        rows = self._measured(X, detectors[0].n_windows_)
        log_p_values = [
            detector._log_p_values_of(rows, log_speed) for detector in detectors
        ]
        return np.where(
            is_plausible[:, np.newaxis], np.stack(log_p_values, axis=1), _LEAST_LOG_P
        )

    def _measured(self, X, n_windows):
        """Compute the features of rows of shape (n_rows, 1, n_samples), window by window."""
        length = X.shape[-1] // n_windows
        with_level = self._counts_level or X.shape[-1] < _SHORTEST_SPECTRUM

        def features(batch):
            rows = of_one_model(X[batch])[:, : n_windows * length]
            windows = rows.reshape(-1, length)
            return [
                feature.reshape(len(rows), n_windows, -1)
                for feature in measure_windows(windows, with_level=with_level)
            ]

        batches = map_batches(features, len(X), self.n_jobs, max(BATCH // n_windows, 1))
        return Rows(*map(np.concatenate, zip(*batches, strict=True)))

    def _log_speeds(self, rpm, X, train_rpm):
        """Return log speeds, or None if `fit` had none, and which of them are plausible."""
        has_speeds = len(train_rpm) > 0
        rpm, is_plausible = with_plausible_speeds(rpm, len(X), train_rpm)
        log_speed = log_speeds(rpm if has_speeds else None, len(X), X.shape[-1])
        return log_speed, is_plausible

    def _capabilities(self):
        detectors = self._detectors()
        speeds = tuple(np.unique(_speeds_of(detectors).round(6)).tolist())
        return {
            "takes_rpm": len(speeds) > 0,
            "speeds": speeds,
            "is_stretch": detectors[0].n_windows_ > 1,
        }


def _ignored_labels(y):
    """Yield a sentence if a detector of faults is given several labels, which it ignores."""
    labels = [] if y is None else np.unique(np.asarray(y).astype(str)).tolist()
    if len(labels) > 1:
        listed = ", ".join(labels[:3]) + ", ..." * (len(labels) > 3)
        yield (
            f"y has {len(labels)} labels ({listed}), but all rows count as healthy. Pass "
            "healthy rows alone."
        )


def _speeds_of(detectors):
    return np.unique(np.concatenate([detector.speeds_ for detector in detectors]))


def too_few_rows(rows: str, n: int, rate: float) -> list[str]:
    """Return a sentence if n rows do not hold a rate without assumptions, in a list.

    >>> print(*too_few_rows("4 healthy windows", 4, 0.01))
    4 healthy windows are too few to hold the rate 0.01 without an assumption on the distribution of
    their scores. They hold 1/5 = 0.2. Use at least 99 rows.
    >>> too_few_rows("99 healthy windows", 99, 0.01)
    []
    """
    needed = rows_that_hold(rate)
    if n >= needed:
        return []
    return [
        f"{rows} are too few to hold the rate {rate:g} without an assumption on the distribution "
        f"of their scores. They hold 1/{n + 1} = {1 / (n + 1):.2g}. Use at least {needed} rows."
    ]
