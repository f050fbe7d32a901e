"""Outlier detector that rejects rows of unknown conditions, at any speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.capabilities import offers
from ..core.state import check_state, expect
from ..core.validation import check_count, check_rate
from ..kernels.speed_references import group_speeds
from .fault_detector import FaultDetector
from .row_outliers import RowOutlierDetector

#: Drift scale of a condition without rows at several speeds: faults drift more than a
#: healthy bearing.
_DRIFT_OF_FAULTS = 2.0


@dataclass(kw_only=True, eq=False, repr=False)
class KnownConditions(RowOutlierDetector):
    r"""Outlier detector that rejects rows unlike every known condition.

    A diagnoser always names one of its conditions, even if the row resembles none of
    them. This estimator tests whether the row resembles any. Use `FaultDetector`
    instead to compare rows with the healthy condition alone.

    Each condition has its own `FaultDetector`, whose limits widen with the distance in
    speed. The p-value of the nearest condition is the largest over conditions:

    .. math::

        p = \max_c p_c

    where :math:`p_c` is the probability that a row of condition c deviates at least as
    much. A row is rejected if p is below the stated rate. Since :math:`p \ge p_c`, a
    row of a known condition c is rejected with a probability of at most the rate that
    the limits of c hold.

    docs/detection.md shows how many rows of unknown conditions are rejected. At other
    speeds than those of training, most are taken for a known condition.

    Parameters
    ----------
    false_rejection_rate : float, default=0.01
        Share in (0, 1) of rows of a known condition that may be rejected.
    window_length : int, default=4800
        A row is cut into windows of this many samples or a little more, at least 1; a
        shorter row is one window.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_conditions,)
        The conditions, sorted. Without y there is one, "known".
    detectors_ : list of FaultDetector
        The limits of each condition. With rows at one speed, their drift scale is 2.
    offset_ : float
        Logarithm of the rate of false rejections: rows of a lower score are rejected.
    n_models_ : int
        1 if rows were innovations, 0 for plain windows.
    window_shape_ : ndarray of int
        Shape of one row.
    n_features_in_ : int
        Number of models, or samples in a plain row.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    skarxlag.make_known_conditions : This estimator behind a model of the signal.
    FaultDetector : The equations, for one condition.

    Notes
    -----
    If `fit` had speeds and the speed of a row is not known, the p-value is the largest
    over the speeds of `fit` and the speeds a factor of 1.3 beyond them. If `fit` had
    none, the limits are those for a speed that differs by that factor.

    Examples
    --------
    Two conditions of different spectral shape, and noise that is like neither:

    >>> import warnings
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> noise = np.random.default_rng(0).normal(size=(240, 4800))
    >>> X = np.concatenate(
    ...     [lfilter([1], [1, -0.8], noise[:100]), lfilter([1], [1, 0.8], noise[100:200])]
    ... )
    >>> y = np.repeat(["good", "worn"], 100)
    >>> known = KnownConditions()
    >>> with warnings.catch_warnings(action="ignore"):  # one speed
    ...     _ = known.fit(X, y, rpm=1000)
    >>> known.predict(noise[[200, 201]], rpm=1000)
    array([-1, -1])
    >>> new = lfilter([1], [1, -0.8], noise[200:])
    >>> known.p_values(new[:1], rpm=1000).round(1)  # of "good" and of "worn"
    array([[0.6, 0. ]])
    """

    false_rejection_rate: float = 0.01
    window_length: int = 4800
    n_jobs: int | None = None

    _has_conditions = True
    _counts_level = False

    def _learn(self, rows, y, log_speed, weights):
        n_rows = len(rows.cepstra)
        labels = np.full(n_rows, "known") if y is None else y
        self.offset_: float = float(np.log(self.false_rejection_rate))
        self.detectors_: list[FaultDetector] = []
        classes = []
        left_out = []
        for name in np.unique(labels).tolist():
            is_class = labels == name
            if np.bincount(group_speeds(log_speed[is_class])[1]).max() < 2:
                left_out.append(name)
            else:
                classes.append(name)
                detector = self._fitted_detector(
                    rows.take(is_class), log_speed[is_class], weights[is_class]
                )
                self.detectors_.append(detector)
        largest = "largest number of rows of one condition and speed"
        expect(len(classes) > 0, f"n_samples = {n_rows}: {largest}", 1, "at least 2")
        self.classes_: NDArray[Any] = np.array(classes, dtype=labels.dtype)
        return self._weak_points(left_out)

    def _fitted_detector(self, rows, log_speed, weights):
        detector = FaultDetector(
            false_alarm_rate=self.false_rejection_rate,
            window_length=self.window_length,
            n_jobs=self.n_jobs,
        )
        for name in ("n_features_in_", "window_shape_", "n_models_"):
            setattr(detector, name, getattr(self, name))
        detector._learn(rows, None, log_speed, weights)
        if len(detector.speeds_) < 2:
            detector.drift_scale_ = _DRIFT_OF_FAULTS
        return detector

    def _weak_points(self, left_out):
        """Yield sentences on a calibration that promises less than its user may think."""
        if left_out:
            listed = ", ".join(map(repr, left_out))
            yield (
                f"Conditions with one row at each speed are left out: {listed}. Their rows "
                "may be rejected as an unknown condition."
            )
        sizes = [
            (len(detector.speeds_), detector.n_rows_) for detector in self.detectors_
        ]
        weakest = sizes.index(min(sizes))
        rows = f"rows of condition {self.classes_[weakest]}"
        yield from self.detectors_[weakest]._weak_points(rows)

    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute for each condition the probability that its rows deviate at least as much.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows of the length that `fit` saw.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row. None: not known, see the notes of the class.
            Not used if `fit` had none.

        Returns
        -------
        ndarray of shape (n_rows, n_conditions)
            In (0, 1], in the order of `classes_`.

        Warns
        -----
        UserWarning
            If a speed is not above 0, or farther than a factor of 5 outside the speeds
            of `fit`: the p-values are then nearly 0.
        """
        return np.exp(self._log_p_values(X, rpm))

    def _detectors(self):
        return self.detectors_

    def _capabilities(self):
        return super()._capabilities() | {
            "none_of_these": True,
            "stated_rate": self.false_rejection_rate,
        }

    def _check_parameters(self):
        check_rate(self.false_rejection_rate, "false_rejection_rate")
        check_count(self.window_length, "window_length")

    def _check_fitted(self):
        super()._check_fitted()
        self._check_classes()

    def _check_relations(self):
        detectors = getattr(self, "detectors_", None)
        n_classes = len(self.classes_)
        is_list = isinstance(detectors, list) and len(detectors) == n_classes
        fits = is_list and all(offers(detector, "p_values") for detector in detectors)
        expect(fits, "detectors_", detectors, f"{n_classes} detectors by classes_")
        for detector in detectors:
            check_state(detector)
        rows = {
            (*detector.window_shape_, detector.n_windows_, len(detector.deviations_))
            for detector in detectors
        }
        shape = tuple(self.window_shape_)
        are_alike = len(rows) == 1 and next(iter(rows))[:-2] == shape
        expected = f"the same rows for all, of window_shape_ {shape}"
        expect(are_alike, "Rows of detectors_", rows, expected)
