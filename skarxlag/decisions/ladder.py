"""Calibrated decisions on residual levels: the threshold ladder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import validate_data

from ..core.base import DocumentedEstimator
from ..core.fault_locations import HEALTHY, expect_condition, location_of_label
from ..core.state import CheckedEstimator, expect, uses_fitted
from ..core.validation import (
    check_labels,
    check_rate,
    is_plain,
    weighted_windows,
)
from ..kernels import ladder
from ..kernels.scaling import root_mean_square


@dataclass(kw_only=True, eq=False, repr=False)
class ThresholdLadder(
    CheckedEstimator, DocumentedEstimator, ClassifierMixin, BaseEstimator
):
    r"""Classifier of residual levels by calibrated thresholds (equations 23-32).

    Use `FaultDetector` instead if only healthy windows were recorded, or if the
    detection threshold must hold at other speeds.

    *One residual*, of the healthy model. This is the paper's ladder. The conditions are
    ordered by their median training level. The cut between two neighbours is the
    geometric mean of their medians. If the healthy condition is the lowest, the cut
    above it is the detection threshold :math:`\Gamma`. Levels on a cut belong to the
    rung below.

    *A bank of residuals*, one for each condition in the order of `classes_`: so many
    columns are always taken for a bank. The condition with the smallest residual is the
    verdict. A factor that a change of speed puts on all residuals cancels.

    *Any other number of residuals.* The paper's ladder is applied to their root mean
    square. A signed residual counts by its absolute value :math:`|r|`.

    Parameters
    ----------
    healthy : label or None, default=None
        The healthy condition. None: the one of lowest median level.
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy windows that may exceed :math:`\Gamma`.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted; residual c of a bank belongs to ``classes_[c]``.
    detection_threshold_ : float
        :math:`\Gamma`, on the residual of the healthy model.
    isolation_thresholds_ : ndarray
        One residual: the n_classes - 1 cuts :math:`\Delta` between rungs, ascending. A
        bank: one :math:`\Delta` for each condition. It is a ratio of the condition's
        residual to the geometric mean of all residuals, which windows of the condition
        exceed at the false-alarm rate.
    rungs_ : ndarray of shape (n_classes,)
        Conditions from the lowest median level to the highest.
    healthy_index_ : int
        Index of the healthy condition in `classes_`.
    confidence_scale_ : float
        Factor :math:`\beta` on the scores in `predict_proba`. It is fitted on the
        training windows with smoothed targets, which keeps probabilities modest.
    n_features_in_ : int
        Number of residuals.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    FaultDetector : Outlier detector that is fitted on healthy windows alone.

    Examples
    --------
    >>> import numpy as np
    >>> levels = np.array([[0.4], [0.5], [1.0], [1.2], [3.0], [3.2]])
    >>> y = np.array(["normal", "normal", "ball", "ball", "inner", "inner"])
    >>> ladder = ThresholdLadder().fit(levels, y)
    >>> ladder.rungs_
    array(['normal', 'ball', 'inner'], dtype='<U6')
    >>> ladder.isolation_thresholds_.round(2)
    array([0.5 , 1.85])
    >>> ladder.predict([[0.1], [1.5], [9.0]])
    array(['normal', 'ball', 'inner'], dtype='<U6')
    """

    healthy: Any = None
    false_alarm_rate: float = 0.01

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"sample_weight": True}
    __metadata_request__score: ClassVar = {"sample_weight": True}

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Calibrate the thresholds.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.
        y : array-like of shape (n_windows,)
            Condition of each window.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            Number of windows that each row stands for, at least 0. None: one.

        Returns
        -------
        ThresholdLadder
            The fitted classifier.

        Raises
        ------
        ValueError
            If a parameter is out of its range, `healthy` is not in `y`, or a weight is
            negative.
        """
        check_labels(y)
        X, y = validate_data(self, X, y, dtype=[np.float64, np.float32])
        check_classification_targets(y)
        X, y, weights = weighted_windows(np.abs(X), y, sample_weight)
        self._check_parameters()
        classes, target = np.unique(y, return_inverse=True)
        self.classes_: NDArray[Any] = classes
        combined = root_mean_square(X)
        rows_of_classes = [target == c for c in range(len(classes))]
        medians = [
            ladder.weighted_median(combined[rows], weights[rows])
            for rows in rows_of_classes
        ]
        order = np.argsort(medians, kind="stable")
        self.rungs_: NDArray[Any] = classes[order]
        names = classes.tolist()
        healthy = names[order[0]] if self.healthy is None else self.healthy
        expect_condition(healthy, names)
        self.healthy_index_: int = names.index(healthy)
        rate = self.false_alarm_rate
        is_healthy = rows_of_classes[self.healthy_index_]
        self.detection_threshold_: float = ladder.false_alarm_threshold(
            self._healthy_level(X)[is_healthy], weights[is_healthy], rate
        )
        if self._is_bank():
            relative = np.exp(-ladder.relative_scores(X))
            thresholds = [
                ladder.false_alarm_threshold(relative[rows, c], weights[rows], rate)
                for c, rows in enumerate(rows_of_classes)
            ]
        else:
            roots = np.sqrt(np.array(medians)[order])
            thresholds = roots[:-1] * roots[1:]
            if order[0] == self.healthy_index_ and len(order) > 1:
                # Gamma keeps the stated rate only while it is the first cut.
                thresholds[0] = self.detection_threshold_
                thresholds = np.maximum.accumulate(thresholds)
        self.isolation_thresholds_: NDArray[Any] = np.array(thresholds)
        self.confidence_scale_: float = ladder.confidence_scale(
            self._scores(X), target, weights
        )
        return self

    def _is_bank(self):
        return len(self.classes_) == self.n_features_in_ > 1

    def _healthy_level(self, X):
        return X[:, self.healthy_index_] if self._is_bank() else root_mean_square(X)

    def _scores(self, X):
        if self._is_bank():
            return ladder.relative_scores(X)
        by_rung = ladder.rung_scores(root_mean_square(X), self.isolation_thresholds_)
        return by_rung[:, np.argsort(np.searchsorted(self.classes_, self.rungs_))]

    def _validate(self, X):
        if not is_plain(self, X, (self.n_features_in_,)):
            X = validate_data(self, X, dtype=[np.float64, np.float32], reset=False)
        return np.abs(X)

    @uses_fitted
    def decision_function(self, X: ArrayLike) -> NDArray[Any]:
        """Compute the scores of the conditions, of which the highest is the verdict.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of shape (n_windows, n_classes), or (n_windows,) for two conditions
            Scores in nepers. Of a bank: the distance of the residual below the
            geometric mean of all. Of one residual: the distance of the level from the
            bounds of the rung, positive inside. For two conditions: the score of the
            second less that of the first.
        """
        scores = self._scores(self._validate(X))
        return scores[:, 1] - scores[:, 0] if scores.shape[1] == 2 else scores

    @uses_fitted
    def predict(self, X: ArrayLike) -> NDArray[Any]:
        """Return the condition of each window.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of shape (n_windows,)
            Conditions.
        """
        return self.classes_[self._scores(self._validate(X)).argmax(axis=1)]

    def predict_proba(self, X: ArrayLike) -> NDArray[Any]:
        """Compute the probability of each condition.

        In a bank it is proportional to the residual to the power of minus
        `confidence_scale_`.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            Softmax of the scores times `confidence_scale_`; rows sum to 1.
        """
        return np.exp(self.predict_log_proba(X))

    @uses_fitted
    def predict_log_proba(self, X: ArrayLike) -> NDArray[Any]:
        """Compute the logarithm of the probability of each condition.

        For a verdict on several windows of a recording, sum the logarithms. As a
        probability, the sum is too confident, because the errors of the windows are
        correlated. The mean is closer.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            Natural logarithms, finite.
        """
        scaled = self.confidence_scale_ * self._scores(self._validate(X))
        return scaled - np.logaddexp.reduce(scaled, axis=1, keepdims=True)

    @uses_fitted
    def detect(self, X: ArrayLike) -> NDArray[Any]:
        r"""Return whether the healthy residual of each window exceeds :math:`\Gamma` (eq. 24).

        The stated rate holds if levels are not higher than in calibration, such as
        levels in the unit of the sensor that were calibrated at the highest speed. If
        windows are scaled to unit root mean square, as in a bank and in
        `make_diagnoser`, most healthy windows of another speed raise an alarm. Use
        `FaultDetector` instead for these.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of bool of shape (n_windows,)
            True for an alarm.
        """
        return self._healthy_level(self._validate(X)) > self.detection_threshold_

    def _capabilities(self):
        healthy = self.classes_.tolist()[self.healthy_index_]
        # The condition of the lowest level need not be healthy.
        if self.healthy is None and location_of_label(healthy) != HEALTHY:
            return {"alarm": False}
        return {
            "healthy": healthy,
            "alarm": True,
            "limits": f"the detection threshold {self.detection_threshold_:.4g}",
            "stated_rate": self.false_alarm_rate,
        }

    def _check_parameters(self):
        check_rate(self.false_alarm_rate, "false_alarm_rate")

    def _check_fitted(self):
        super()._check_fitted()
        self._check_classes()
        self._check_number("healthy_index_", kind=int)
        n_classes = len(self.classes_)
        is_index = 0 <= self.healthy_index_ < n_classes
        expect(is_index, "healthy_index_", self.healthy_index_, "an index of classes_")
        self._check_number("detection_threshold_", "at least 0")
        self._check_number("confidence_scale_", "above 0")
        n_thresholds = n_classes if self._is_bank() else n_classes - 1
        self._check_array("isolation_thresholds_", (n_thresholds,))
        thresholds = self.isolation_thresholds_
        is_valid = np.all(thresholds >= 0) and (
            self._is_bank() or np.all(np.diff(thresholds) >= 0)
        )
        expected = "at least 0, and ascending for one residual"
        expect(is_valid, "isolation_thresholds_", thresholds, expected)

    def _check_relations(self):
        rungs = self.rungs_
        is_array = isinstance(rungs, np.ndarray) and rungs.shape == self.classes_.shape
        fits = is_array and sorted(map(str, rungs)) == sorted(map(str, self.classes_))
        expect(fits, "rungs_", rungs, "the conditions in classes_")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # The classifier is made for residual levels. It need not separate arbitrary
        # features.
        tags.classifier_tags.poor_score = True
        return tags
