"""None of these: whether rows are of any condition that is known."""

from __future__ import annotations

import warnings
from numbers import Integral
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_scalar

from ._base import RowOutlierDetector
from ._calibration import log_speeds, measure, price_of_unknown_speed
from ._validation import (
    INNOVATIONS,
    NEGATIVE,
    Labels,
    Values,
    check_rate,
    check_state,
    remember_parameters,
    uses_fitted,
    validate_innovations,
    weighted_windows,
)
from .detector import FaultDetector
from .kernels.speed_drift import group_speeds


class KnownConditions(RowOutlierDetector):
    r"""Tell rows that are of none of the known conditions.

    A diagnoser names the most similar of its conditions, however unlike the row is. This estimator
    asks the question that comes before: is the row like any of them? Each condition has a
    `FaultDetector` of its own, whose limits widen with the distance in speed. The p-value of the
    nearest condition is the largest over conditions:

    .. math::

        p = \max_c p_c

    where :math:`p_c` is the probability that a row of condition c is at least as far off. Other
    than in detection, less unsteadiness than is expected counts as well as more: a row without
    strikes is no row of a fault. A row is "none of these" where p is below the stated rate. A row
    of a known condition c is then rejected with a probability of at most that rate, as far as the
    limits of c hold it: :math:`p \ge p_c`.

    How many unknown conditions are rejected is another matter. It was measured at the training
    speed and at others, see docs/detection.md: at other speeds most are taken for a known one.

    Parameters
    ----------
    false_rejection_rate : float, default=0.01
        Share in (0, 1) of rows of a known condition that may be rejected.
    window_length : int, default=4800
        A row is cut into windows of this many samples or a little more, at least 1; a shorter row
        is one window.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_conditions,)
        The conditions, sorted. Without y there is one, "known".
    detectors_ : list of FaultDetector
        One for each condition, with what it learnt.
    offset_ : float
        Logarithm of the rate of false rejections: rows of a lower score are rejected.
    n_models_ : int
        1 where rows were innovations, 0 for plain windows.
    window_shape_ : ndarray of int
        Shape of one row.
    n_features_in_ : int
        Number of models, or samples in a plain row.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    skarxlag.make_known_conditions : The same behind a model that explains measured inputs.
    FaultDetector : The equations, for one condition.

    Notes
    -----
    Where `fit` had speeds and the speed of a row is not known, its p-value is the largest over the
    speeds of `fit` and those a factor of 1.3 beyond them. Where `fit` had none, the limits are
    those for a speed that differs by that factor.

    Examples
    --------
    Two conditions of different colour, and noise that is like neither:

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
    >>> known.p_values(new[:1], rpm=1000).round(2)  # of "good" and of "worn"
    array([[0.45, 0.  ]])
    """

    classes_: NDArray[Any]
    detectors_: list[FaultDetector]
    offset_: float

    #: Metadata routing hands these over without a call of `set_fit_request` and its like.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}

    _state = INNOVATIONS | {"offset_": Values((), NEGATIVE), "classes_": Labels()}

    def __init__(
        self,
        *,
        false_rejection_rate: float = 0.01,
        window_length: int = 4800,
        n_jobs: int | None = None,
    ) -> None:
        self.false_rejection_rate = false_rejection_rate
        self.window_length = window_length
        self.n_jobs = n_jobs

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Calibrate the limits of each condition.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Windows or stretches, or the innovations of one model. Rows of one condition and speed
            are in the order of time.
        y : array-like of shape (n_rows,) or None, default=None
            Condition of each row. None: all rows are of one condition.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row, in revolutions per minute. None: all rows are of one
            speed, which is not known.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            Weight of each row, as in `FaultDetector.fit`. A row of weight 0 is left out.

        Returns
        -------
        KnownConditions
            The fitted estimator.

        Raises
        ------
        ValueError
            If a parameter is out of its range, a speed is not above 0, or no condition has two rows
            at one speed.

        Warns
        -----
        UserWarning
            If a condition is left out because it has no two rows at one speed; if some condition
            has fewer rows than the rate needs; if `rpm` is not given; or if all rows of a condition
            are of one speed.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        labels = np.full(len(X), "known") if y is None else y
        log_speed = log_speeds(rpm, len(X))
        X, counted, weights = weighted_windows(X, np.arange(len(X)), sample_weight)
        labels = labels[counted]
        log_speed = None if log_speed is None else log_speed[counted]
        classes = np.unique(labels)
        can = np.array([_most_rows(log_speed, labels == name) > 1 for name in classes])
        if not can.any():
            raise ValueError(
                f"n_samples = {len(X)}: X has one row of each condition at each speed, expected at "
                "least 2 rows of one condition at one speed."
            )
        self.classes_ = classes[can]
        self.offset_ = float(np.log(self.false_rejection_rate))
        self.detectors_ = [
            self._detector_of(X, labels == name, log_speed, weights) for name in self.classes_
        ]
        remember_parameters(self)
        for sentence in self._weak_points(classes[~can]):
            warnings.warn(sentence, stacklevel=2)
        return self

    def _detector_of(self, X, own, log_speed, weights):
        rpm = None if log_speed is None else np.exp(log_speed[own])
        detector = FaultDetector(
            false_alarm_rate=self.false_rejection_rate,
            window_length=self.window_length,
            n_jobs=self.n_jobs,
        )
        with warnings.catch_warnings():
            # They speak of healthy rows; `_weak_points` speaks of all conditions together.
            warnings.simplefilter("ignore", UserWarning)
            return detector.fit(
                X[own] if self.n_models_ else X[own, 0], rpm=rpm, sample_weight=weights[own]
            )

    def _weak_points(self, left_out):
        """What to say of a weak calibration, in sentences with numbers."""
        if len(left_out) > 0:
            listed = ", ".join(map(repr, left_out.tolist()))
            yield (
                f"Conditions with one row at each speed are left out: {listed}. Their own rows "
                "may be taken for none of the known conditions."
            )
        rate, n_rows = self.false_rejection_rate, [d.n_rows_ for d in self.detectors_]
        n = min(n_rows)
        if n + 1 < (1 - 1e-9) / rate:
            name = self.classes_[np.argmin(n_rows)]
            yield (
                f"Condition {name!s} has {n} rows, which hold a rate of false rejections of "
                f"1/{n + 1} = {1 / (n + 1):.2g} by themselves. The stated {rate:g} rests on "
                f"Student's t distribution; {int(np.ceil(1 / rate - 1e-9)) - 1} rows would hold it."
            )
        prices = [price_of_unknown_speed(d)[0] for d in self.detectors_ if len(d.speeds_) == 0]
        if prices:
            yield (
                "rpm is not given, so the limits are those for a speed that differs by the factor "
                f"1.3: the spectrum must be {min(prices):.2g} times as far off as at a known "
                "speed, or farther, before a row is rejected."
            )
        elif any(len(d.speeds_) == 1 for d in self.detectors_):
            yield (
                "Some conditions have rows of one speed: at other speeds most conditions that were "
                "never seen are taken for a known one."
            )

    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Probability, for each condition, that a row of it is at least as far off.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows as long as those of `fit`.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row. None: not known, see the notes of the class. Not used
            where `fit` had none.

        Returns
        -------
        ndarray of shape (n_rows, n_conditions)
            In (0, 1], in the order of `classes_`.

        Raises
        ------
        ValueError
            If a speed is not above 0.
        """
        return np.exp(self._log_p_values(X, rpm))

    def score_samples(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Logarithm of the p-value of the nearest condition.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds, as in `p_values`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Finite, at most 0; lower is less like any condition.
        """
        return self._log_p_values(X, rpm).max(axis=1)

    @uses_fitted
    def _log_p_values(self, X, rpm):
        X, _ = validate_innovations(self, X, reset=False)
        log_speed = log_speeds(rpm, len(X))
        first = self.detectors_[0]
        rows = measure(
            X, first.n_windows_, with_level=first.means_.shape[1] > 1, n_jobs=self.n_jobs
        )
        found = [
            detector._log_p_values_of(rows, log_speed, two_sided=True)
            for detector in self.detectors_
        ]
        return np.stack(found, axis=1)

    def _answers(self):
        speeds = np.unique(np.concatenate([each.speeds_.round(6) for each in self.detectors_]))
        return {
            "none_of_these": True,
            "stated_rate": self.false_rejection_rate,
            "takes_rpm": len(speeds) > 0,
            "speeds": tuple(speeds.tolist()),
            "is_stretch": self.detectors_[0].n_windows_ > 1,
        }

    def _check_parameters(self):
        check_rate(self.false_rejection_rate, "false_rejection_rate")
        check_scalar(self.window_length, "window_length", Integral, min_val=1)

    def _check_relations(self):
        detectors = vars(self).get("detectors_")
        if (
            not isinstance(detectors, list)
            or len(detectors) == 0
            or not all(isinstance(each, FaultDetector) for each in detectors)
        ):
            raise ValueError(f"detectors_ == {detectors!r}, expected a list of FaultDetector.")
        if len(detectors) != len(self.classes_):
            raise ValueError(
                f"classes_ has {len(self.classes_)} entries, expected {len(detectors)}."
            )
        for detector in detectors:
            check_state(detector)
            own = (detector.window_shape_.tolist(), detector.n_windows_, detector.means_.shape[1])
            first = detectors[0]
            expected = (self.window_shape_.tolist(), first.n_windows_, first.means_.shape[1])
            if own != expected:
                raise ValueError(
                    f"detectors_ differ in window_shape_, n_windows_ or means_: {own} and "
                    f"{expected}."
                )


def _most_rows(log_speed, own):
    """Rows at the speed that has most of some rows."""
    if log_speed is None:
        return own.sum()
    return np.bincount(group_speeds(log_speed[own])[1]).max()
