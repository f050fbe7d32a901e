"""Detection of faults from healthy windows alone."""

import numpy as np
from sklearn.base import BaseEstimator, OutlierMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ._state import (
    check_fitted_input,
    check_fitted_number,
    check_state,
    remember_parameters,
)
from ._validation import check_alarm
from .kernels.ladder import false_alarm_threshold
from .kernels.scaling import root_mean_square


class FaultDetector(OutlierMixin, BaseEstimator):
    r"""Flag windows whose residual level exceeds what healthy ones reach (equations 23 and 24).

    Calibrate it on healthy windows alone, in the sensor's unit and at the highest speed: levels
    grow with speed, so the stated rate holds below it.

    Parameters
    ----------
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy windows that may be flagged.
    margin_db : float, default=0.0
        Margin on the threshold in dB, from -1000 to 1000.

    Attributes
    ----------
    detection_threshold_ : float
        :math:`\Gamma`, in the unit of the levels.
    offset_ : float
        Minus `detection_threshold_`: the score below which a window is flagged.
    n_features_in_ : int
        Number of residuals; their root-mean-square is the level.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    ThresholdLadder : Names the fault as well.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.pipeline import make_pipeline
    >>> from skarxlag import ARXLaguerre, PIObserver
    >>> rng = np.random.default_rng(0)
    >>> healthy, faulty = rng.normal(size=(400, 600)), 3 * rng.normal(size=(5, 600))
    >>> detector = make_pipeline(ARXLaguerre(unit_rms=False), PIObserver(), FaultDetector())
    >>> detector.fit(healthy).predict(faulty)
    array([-1, -1, -1, -1, -1])
    """

    def __init__(self, *, false_alarm_rate=0.01, margin_db=0.0):
        self.false_alarm_rate = false_alarm_rate
        self.margin_db = margin_db

    def fit(self, X, y=None):
        """Calibrate the threshold on healthy windows.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels of healthy windows.
        y : ignored
            Here by convention.

        Returns
        -------
        FaultDetector
            The fitted detector.

        Raises
        ------
        ValueError
            If a parameter is out of its range.
        """
        X = validate_data(self, X, dtype=[np.float64, np.float32])
        check_alarm(self.false_alarm_rate, self.margin_db)
        self.detection_threshold_ = false_alarm_threshold(
            root_mean_square(X), self.false_alarm_rate, self.margin_db
        )
        self.offset_ = -self.detection_threshold_
        remember_parameters(self)
        return self

    def score_samples(self, X):
        """Minus the level of each window.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of shape (n_windows,)
            Lower is more abnormal.
        """
        check_is_fitted(self)
        check_state(self)
        X = validate_data(self, X, dtype=[np.float64, np.float32], reset=False)
        return -root_mean_square(X)

    def decision_function(self, X):
        """Threshold less level: negative for an alarm.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of shape (n_windows,)
            In the unit of the levels.
        """
        return self.score_samples(X) - self.offset_

    def predict(self, X):
        """1 for a healthy window, -1 for a faulty one.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_residuals)
            Residual levels.

        Returns
        -------
        ndarray of int of shape (n_windows,)
            Verdicts.
        """
        return np.where(self.decision_function(X) < 0, -1, 1)

    def _check_state(self):
        check_fitted_input(self)
        check_fitted_number(
            self, "detection_threshold_", valid=lambda g: g >= 0, expected="at least 0"
        )
        check_fitted_number(
            self,
            "offset_",
            valid=lambda offset: offset == -self.detection_threshold_,
            expected=f"minus detection_threshold_={self.detection_threshold_}",
        )
