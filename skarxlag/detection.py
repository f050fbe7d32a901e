"""Outlier detectors: healthy rows and others, known conditions and others, at any speed."""

from __future__ import annotations

import warnings
from numbers import Integral
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, OutlierMixin
from sklearn.utils import check_scalar

from ._base import SignalEstimator
from ._parallel import BATCH, map_batches, one_thread
from ._validation import (
    AT_LEAST_1,
    INNOVATIONS,
    NEGATIVE,
    NOT_NEGATIVE,
    POSITIVE,
    SPEEDS,
    Labels,
    Values,
    check_rate,
    check_state,
    remember_parameters,
    uses_fitted,
    validate_innovations,
    weighted_windows,
)
from .kernels.healthy_limits import (
    SLOPES,
    Limits,
    calibrate,
    drift_scale,
    drift_variance,
    flagged_shares,
    log_p_values,
    parts_of_rows,
)
from .kernels.healthy_rows import Rows, measure_rows, number_of_cepstra
from .kernels.ladder import rows_that_hold
from .kernels.speed_drift import SAME_SPEED, UNIT_DISTANCE, group_speeds
from .speeds import speeds_of_rows, with_plausible_speeds

#: Drift scale of a condition without rows at several speeds: faults drift more than a healthy
#: bearing.
_DRIFT_OF_FAULTS = 3.0
#: Samples that a spectrum takes at least.
_SHORTEST_SPECTRUM = 8
#: Log p-value of a row without a plausible speed: the p-value is the smallest above 0.
_LEAST_LOG_P = float(np.log(np.finfo(np.float32).tiny))


class RowOutlierDetector(SignalEstimator, OutlierMixin, BaseEstimator):
    """Outlier detector whose score is the logarithm of a p-value.

    A subclass has `fit`, `score_samples` and the attribute `offset_`, the logarithm of the stated
    rate. All methods accept `rpm`, the speed of each row.
    """

    offset_: float

    #: Metadata routing passes `rpm` without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"rpm": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}

    def decision_function(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
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
        return self.score_samples(X, rpm) - self.offset_

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
        return np.where(self.decision_function(X, rpm) < 0, -1, 1)

    def fit_predict(
        self, X: ArrayLike, y: Any = None, rpm: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Fit, and classify the same rows.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        y : array-like of shape (n_rows,) or None, default=None
            As in `fit`.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Their speeds.

        Returns
        -------
        ndarray of int of shape (n_rows,)
            1 or -1.
        """
        return self.fit(X, y, rpm=rpm).predict(X, rpm=rpm)


def _n_references(detector):
    return max(len(detector.speeds_), 1)


def _n_cepstra(detector):
    return number_of_cepstra(int(detector.window_shape_[-1]) // detector.n_windows_)


class FaultDetector(RowOutlierDetector):
    r"""Outlier detector that flags rows unlike healthy ones, at any speed.

    A row is a window or a longer stretch of a signal, commonly of a model's innovations. The
    signal of a healthy bearing changes with the speed of the shaft. The detector interpolates
    between the speeds of `fit`, and models the change as a Brownian motion over the logarithm of
    speed: the limits widen with the distance from the speeds of `fit`. Use `KnownConditions` to
    compare rows with several conditions, and `ThresholdLadder.detect` for levels of residuals.

    Each row has two or three features, and each feature gives a p-value: the probability that a
    healthy row deviates at least as much.

    - *Cepstra.* The cosine coefficients d of two log spectra, the colour and the steadiness of each
      frequency band:

      .. math::

          s_1 = \log\, \mathrm{mean}\, (d - \hat d)^T
                \left[S_w / m + (\kappa v + 0.09)\, D\right]^{-1} (d - \hat d)

      with the scatter :math:`S_w` of healthy windows, m windows in a row, the covariance D of
      what a change of speed by the factor 1.3 does, the drift scale :math:`\kappa`, and
      :math:`v = \sqrt b`. Here b is the variance of the Brownian motion at the row's speed:
      0 at a speed of `fit`, 1 at the factor 1.3 outside these speeds. The root widens the limits
      close to the speeds of `fit`, since two recordings differ in load and mounting, too.
    - *Unsteadiness* g, how far the power of the bands deviates from that of steady noise:

      .. math::

          s_2 = (g - \hat g) \big/
                \sqrt{s^2 + (\kappa v + 0.09)\, \sigma^2 + \kappa V_b e^2}

      with e the logarithm of speed beyond the speeds of `fit`, where :math:`\hat g` follows a slope
      of variance :math:`V_b`. Only more than is expected counts.
    - *Level*, if the gain of the sensor is fixed, in the same way. The test is two-sided, since a
      sensor may come loose. A row of fewer than 8 samples has no spectrum, so its level always
      counts.

    Scores are compared with Student's t over blocks of time that were left out, five to ten for
    each speed. Where a speed has fewer than five rows, and rows have several windows, blocks are
    parts of rows. The row's p-value is the smallest of them, times their number.

    Parameters
    ----------
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy rows that may be flagged.
    fixed_gain : bool, default=False
        Whether all recordings have the same sensor, mounting and amplification. If so, the level
        is tested, and the rows must be in the unit of the sensor.
    window_length : int, default=4800
        A row is cut into windows of this many samples or a little more, at least 1; a shorter row
        is one window.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    offset_ : float
        Logarithm of the false-alarm rate: rows of a lower score are flagged.
    speeds_ : ndarray of shape (n_speeds,)
        Speeds of the healthy rows in revolutions per minute, ascending; those within 2 % of each
        other are one. Empty where none were given.
    drift_scale_ : float
        :math:`\kappa`: 1 with one speed; with several, twice the least at which every speed, left
        out, holds false-alarm rates of 1 % and 5 %. At least 0.25. It does not depend on
        `false_alarm_rate`, so a row that is flagged at 1 % is flagged at 5 %, too.
    left_out_rates_ : ndarray of shape (n_speeds,)
        Share of the healthy rows (or of their parts, where these are the blocks) of each speed that
        are flagged when the references come from the other speeds. Empty with one speed.
    n_rows_, n_windows_ : int
        Healthy rows in `fit`, and windows in each.
    n_blocks_ : int
        Blocks of time that the limits rest on.
    axes_ : ndarray of float32 of shape (n_cepstra, n_cepstra)
        Coordinates of cepstra in which D is the identity and the scatter is diagonal.
    variances_ : ndarray of shape (n_cepstra,)
        The scatter of rows in these coordinates.
    references_ : ndarray of shape (n_speeds or 1, n_cepstra)
        Mean cepstra in these coordinates, for each speed.
    means_ : ndarray of shape (n_speeds or 1, 1 or 2)
        Mean log unsteadiness, and mean log level where it counts.
    slopes_ : ndarray of shape (1 or 2, 2)
        Their slopes against log speed, and the variances :math:`V_b` of the slopes.
    deviations_ : ndarray of shape (1 or 2,)
        Their deviations s between blocks of time.
    score_mean_, score_deviation_ : float
        Mean and deviation of :math:`s_1` on blocks that were left out.
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
    skarxlag.make_detector : The detector behind a model that explains measured inputs.
    ThresholdLadder : Classifier for recordings of faults.

    Notes
    -----
    docs/detection.md explains what the stated rate promises.

    Examples
    --------
    Healthy noise whose colour and level change with speed. Tested at a speed that was not given:

    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> rng = np.random.default_rng(0)
    >>> def healthy(n, rpm):
    ...     pole = 0.5 + rpm / 5000
    ...     return rpm * lfilter([1], [1, -pole], rng.normal(size=(n, 4800)))
    >>> X = np.concatenate([healthy(100, 800), healthy(100, 1200)])
    >>> detector = FaultDetector().fit(X, rpm=np.repeat([800, 1200], 100))
    >>> found = healthy(200, 1000)
    >>> bool((detector.predict(found, rpm=1000) == -1).mean() <= 0.01)
    True
    >>> found[:, ::600] += 20_000  # impacts
    >>> bool((detector.predict(found, rpm=1000) == -1).mean() > 0.99)
    True
    """

    offset_: float
    speeds_: NDArray[Any]
    drift_scale_: float
    left_out_rates_: NDArray[Any]
    n_rows_: int
    n_windows_: int
    axes_: NDArray[np.float32]
    variances_: NDArray[Any]

    _state = INNOVATIONS | {
        "n_rows_": Values((), (lambda n, e: n >= 2, "at least 2"), "i"),
        "n_windows_": Values((), AT_LEAST_1, "i"),
        "n_blocks_": Values((), (lambda n, e: n >= 2, "at least 2"), "i"),
        "speeds_": SPEEDS,
        "deviations_": Values((None,), POSITIVE),
        "references_": Values(lambda e: (_n_references(e), _n_cepstra(e))),
        "axes_": Values(lambda e: 2 * (_n_cepstra(e),)),
        "means_": Values(lambda e: (_n_references(e), len(e.deviations_))),
        "variances_": Values(lambda e: (_n_cepstra(e),), NOT_NEGATIVE),
        "left_out_rates_": Values(
            lambda e: (len(e.speeds_) if len(e.speeds_) > 1 else 0,), NOT_NEGATIVE
        ),
        "slopes_": Values(
            lambda e: (len(e.deviations_), 2),
            (lambda v, e: v[:, 1] >= 0, "variances of at least 0 in the second column"),
        ),
        "drift_scale_": Values((), POSITIVE),
        "score_deviation_": Values((), POSITIVE),
        "score_mean_": Values(),
        "offset_": Values((), NEGATIVE),
    }

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}

    def __init__(
        self,
        *,
        false_alarm_rate: float = 0.01,
        fixed_gain: bool = False,
        window_length: int = 4800,
        n_jobs: int | None = None,
    ) -> None:
        self.false_alarm_rate = false_alarm_rate
        self.fixed_gain = fixed_gain
        self.window_length = window_length
        self.n_jobs = n_jobs

    def fit(
        self,
        X: ArrayLike,
        y: Any = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Calibrate the limits on healthy rows.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Healthy windows or stretches, or the innovations of one model; at least two of one
            speed. Rows of one speed are in the order of time.
        y : ignored
            Here by convention.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row, in revolutions per minute. None: all rows are of one
            speed, which is not known, and the limits are those for a speed that differs by the
            factor 1.3.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            Weight of each row in means and covariances, at least 0; only ratios count. None: all
            are equal. A row of weight 2 counts in them as if it were there twice, but it is no
            second observation: how well the limits are known is told by the number of rows and of
            blocks of time, which weights leave alone. A row of weight 0 is left out.

        Returns
        -------
        FaultDetector
            The fitted detector.

        Raises
        ------
        ValueError
            If a parameter is out of its range, a speed is not above 0, no speed has two rows, or
            a weight is negative.

        Warns
        -----
        UserWarning
            If there are fewer rows than the false-alarm rate needs, `rpm` is not given, speeds were
            given and are all one, or no drift scale holds the rate at left-out speeds.
        """
        X, _ = validate_innovations(self, X, reset=True)
        self._check_parameters()
        log_speed = _log_speeds(rpm, len(X))
        X, log_speed, weights = weighted_windows(X, log_speed, sample_weight)
        if len(X) < 2:
            raise ValueError(f"n_samples = {len(X)}: X has one row, expected at least 2 rows.")
        known, at = group_speeds(np.zeros(len(X)) if rpm is None else log_speed)
        if np.bincount(at).max() < 2:
            raise ValueError(
                f"X has one row at each of {len(known)} speeds, expected at least 2 rows of one "
                "speed."
            )
        self.n_rows_ = len(X)
        self.n_windows_ = max(X.shape[-1] // self.window_length, 1)
        with_level = bool(self.fixed_gain) or X.shape[-1] < _SHORTEST_SPECTRUM
        # Few long rows are calibrated on their parts.
        n_parts = parts_of_rows(at, self.n_windows_)
        n_windows = self.n_windows_ // n_parts
        at, weights = np.repeat(at, n_parts), np.repeat(weights, n_parts)
        length = n_windows * (X.shape[-1] // self.n_windows_) if n_parts > 1 else X.shape[-1]
        parts = X[..., : n_parts * length].reshape(-1, X.shape[1], length)
        rows = _measure(parts, n_windows, with_level=with_level, n_jobs=self.n_jobs)
        limits = self._calibrate(rows, known, at, weights)
        self.speeds_ = np.exp(known) if rpm is not None else np.empty(0)
        # Most of a saved detector; seven digits are more than the scatter of rows leaves.
        self.axes_ = limits.axes.astype(np.float32)
        # The mean of more windows scatters less.
        self.variances_ = limits.variances * (n_windows / self.n_windows_)
        remember_parameters(self)
        for sentence in _weak_points(self, self.false_alarm_rate):
            warnings.warn(sentence, stacklevel=2)
        return self

    @one_thread
    def _calibrate(self, rows, known, at, weights):
        """Limits and drift scale, which are stored, too."""
        limits = calibrate(rows, known, at, weights)
        for name, value in limits._asdict().items():
            if name != "known":
                setattr(self, name + "_", value)
        self.offset_ = float(np.log(self.false_alarm_rate))
        self.drift_scale_, self.left_out_rates_ = 1.0, np.empty(0)
        if len(known) > 1:
            self.drift_scale_, left_out = drift_scale(rows, known, at, limits, weights)
            self.left_out_rates_ = flagged_shares(left_out, at, self.offset_, weights)
        return limits

    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the probability that a healthy row deviates at least as much.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows of the length that `fit` saw.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row; required if `fit` had speeds, else not used.

        Returns
        -------
        ndarray of shape (n_rows,)
            In (0, 1].

        Raises
        ------
        ValueError
            If `fit` had speeds and there are none here.

        Warns
        -----
        UserWarning
            If a speed is not above 0, or farther than a factor of 5 outside the speeds of `fit`:
            the p-value is then nearly 0. If rows lie more than the factor 1.3 outside the speeds of
            `fit`.
        """
        return np.exp(self.score_samples(X, rpm))

    @uses_fitted
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
            Finite, at most 0; lower is more abnormal.
        """
        X, _ = validate_innovations(self, X, reset=False)
        rpm, is_plausible = self._usable_speeds(rpm, len(X))
        log_speed = self._distant_speeds(rpm, len(X))
        with_level = self.means_.shape[1] > 1
        rows = _measure(X, self.n_windows_, with_level=with_level, n_jobs=self.n_jobs)
        return np.where(is_plausible, self._log_p_values_of(rows, log_speed), _LEAST_LOG_P)

    def _usable_speeds(self, rpm, n_rows):
        """Speeds of rows, and which of them are plausible. They are not used if fit had none."""
        return with_plausible_speeds(rpm if len(self.speeds_) > 0 else None, n_rows, self.speeds_)

    @uses_fitted
    @one_thread
    def _log_p_values_of(self, rows, log_speed, two_sided=False):
        """Compute log p-values of measured rows; for unknown speeds, the largest of some speeds."""
        limits, n_rows = self._limits(), len(rows.values)
        if len(self.speeds_) == 0:
            tried = [UNIT_DISTANCE]
        elif log_speed is None:
            ends = limits.known[0] - UNIT_DISTANCE, limits.known[-1] + UNIT_DISTANCE
            tried = [*limits.known, *ends]
        else:
            tried = [log_speed]
        found = [
            log_p_values(
                limits,
                rows,
                np.broadcast_to(speed, n_rows),
                self.drift_scale_,
                two_sided=two_sided,
            )
            for speed in tried
        ]
        return np.max(found, axis=0)

    def _distant_speeds(self, rpm, n_rows):
        """Return log speeds, or None if `fit` had none, and warn of distant ones."""
        if len(self.speeds_) == 0:
            return None
        if rpm is None:
            listed = ", ".join(f"{speed:g}" for speed in self.speeds_)
            raise ValueError(
                f"rpm is None, expected the speed of each row: FaultDetector was fitted at "
                f"{listed} rpm."
            )
        log_speed = _log_speeds(rpm, n_rows)
        ends = np.log(self.speeds_[[0, -1]])
        far = np.maximum(ends[0] - log_speed, log_speed - ends[1]) > UNIT_DISTANCE + 1e-9
        if far.any():
            outside = np.exp(log_speed[far])
            warnings.warn(
                f"{far.sum()} of {n_rows} rows at {outside.min():g} to {outside.max():g} rpm lie "
                f"more than the factor 1.3 outside the speeds of fit, {self.speeds_[0]:g} to "
                f"{self.speeds_[-1]:g} rpm: limits are wide there, and faults are missed.",
                stacklevel=4,
            )
        return log_speed

    def _limits(self):
        fitted = {name: getattr(self, name + "_") for name in Limits._fields if name != "known"}
        return Limits(known=np.log(self.speeds_) if len(self.speeds_) else np.zeros(1), **fitted)

    def _answers(self):
        speeds = tuple(self.speeds_.round(6).tolist())
        return {
            "alarm": True,
            "healthy_p_value": True,
            "stated_rate": self.false_alarm_rate,
            "takes_rpm": len(speeds) > 0,
            "needs_rpm": len(speeds) > 0,
            "speeds": speeds,
            "is_stretch": self.n_windows_ > 1,
        }

    def _check_parameters(self):
        check_rate(self.false_alarm_rate, "false_alarm_rate")
        check_scalar(self.fixed_gain, "fixed_gain", (bool, np.bool_))
        check_scalar(self.window_length, "window_length", Integral, min_val=1)


class KnownConditions(RowOutlierDetector):
    r"""Outlier detector that rejects rows unlike every known condition.

    A diagnoser always names one of its conditions, even if the row resembles none of them. This
    estimator tests whether the row resembles any. Use `FaultDetector` to compare rows with the
    healthy condition alone. Each condition has its own `FaultDetector`, whose limits widen with
    the distance in speed. The p-value of the nearest condition is the largest over conditions:

    .. math::

        p = \max_c p_c

    where :math:`p_c` is the probability that a row of condition c deviates at least as much. The
    test of the unsteadiness is two-sided: a row with fewer impacts than expected is rejected, too.
    A row is "none of these" if p is below the stated rate. A row of a known condition c is then
    rejected with a probability of at most that rate, as far as the limits of c hold it, since
    :math:`p \ge p_c`.

    docs/detection.md shows how many rows of unknown conditions are rejected. At other speeds than
    those of training, most are taken for a known condition.

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
    array([[1., 0.]])
    """

    classes_: NDArray[Any]
    detectors_: list[FaultDetector]
    offset_: float

    #: Metadata routing passes these without `set_fit_request` and its siblings.
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
        log_speed = _log_speeds(rpm, len(X))
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
            # `_weak_points` warns once for all conditions.
            warnings.simplefilter("ignore", UserWarning)
            detector.fit(
                X[own] if self.n_models_ else X[own, 0], rpm=rpm, sample_weight=weights[own]
            )
        if len(detector.speeds_) < 2:
            detector.drift_scale_ = _DRIFT_OF_FAULTS
        return detector

    def _weak_points(self, left_out):
        """What to say of a weak calibration, in sentences with numbers."""
        if len(left_out) > 0:
            listed = ", ".join(map(repr, left_out.tolist()))
            yield (
                f"Conditions with one row at each speed are left out: {listed}. Their own rows "
                "may be taken for none of the known conditions."
            )
        n_rows = [detector.n_rows_ for detector in self.detectors_]
        whose = f"{min(n_rows)} rows of condition {self.classes_[np.argmin(n_rows)]!s}"
        yield from _few_rows(whose, min(n_rows), self.false_rejection_rate, "false-rejection")
        prices = [_price_of_unknown_speed(d)[0] for d in self.detectors_ if len(d.speeds_) == 0]
        if prices:
            yield (
                "rpm is not given, so the limits are those for a speed that differs by the factor "
                f"1.3: the spectrum must deviate at least {min(prices):.2g} times as far as at a "
                "known speed before a row is rejected."
            )
        elif any(len(d.speeds_) == 1 for d in self.detectors_):
            yield (
                "Some conditions have rows at one speed only. At other speeds, most unknown "
                "conditions are taken for a known one."
            )

    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute for each condition the probability that its rows deviate at least as much.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows of the length that `fit` saw.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row. None: not known, see the notes of the class. Not used
            where `fit` had none.

        Returns
        -------
        ndarray of shape (n_rows, n_conditions)
            In (0, 1], in the order of `classes_`.

        Warns
        -----
        UserWarning
            If a speed is not above 0, or farther than a factor of 5 outside the speeds of `fit`:
            the p-values are then nearly 0.
        """
        return np.exp(self._log_p_values(X, rpm))

    def score_samples(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the logarithm of the p-value of the nearest condition.

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
        speeds = np.unique(np.concatenate([each.speeds_ for each in self.detectors_]))
        rpm, is_plausible = with_plausible_speeds(rpm, len(X), speeds)
        log_speed = _log_speeds(rpm, len(X))
        first = self.detectors_[0]
        rows = _measure(
            X, first.n_windows_, with_level=first.means_.shape[1] > 1, n_jobs=self.n_jobs
        )
        found = [
            detector._log_p_values_of(rows, log_speed, two_sided=True)
            for detector in self.detectors_
        ]
        return np.where(is_plausible[:, np.newaxis], np.stack(found, axis=1), _LEAST_LOG_P)

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


def _log_speeds(rpm, n_rows):
    """Return the logarithms of the speeds of rows, or None for none."""
    if rpm is None:
        return None
    speeds = speeds_of_rows(rpm, n_rows)
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


def _measure(X, n_windows, *, with_level, n_jobs):
    """Compute the features of rows of shape (n_rows, 1, n_samples) in batches."""
    if X.shape[1] != 1:
        raise ValueError(f"X has the innovations of {X.shape[1]} models, expected those of one.")

    def of_batch(batch):
        return measure_rows(X[batch, 0], n_windows, with_level=with_level)

    parts = map_batches(of_batch, len(X), n_jobs, max(BATCH // n_windows, 1))
    return Rows(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _few_rows(whose, n, rate, what):
    """Return a sentence if n rows do not hold a rate without assumptions, in a list."""
    needed = rows_that_hold(rate)
    if n >= needed:
        return []
    return [
        f"{whose} are too few to hold a {what} rate of {rate:g} without assumptions: {n} rows hold "
        f"1/{n + 1} = {1 / (n + 1):.2g}. The stated rate rests on Student's t distribution; "
        f"{needed} rows would hold it."
    ]


def _weak_points(detector, rate):
    """Return sentences that say where a calibration promises less than its user may think."""
    n = detector.n_rows_
    said = _few_rows(f"{n} healthy rows", n, rate, "false-alarm")
    if len(detector.speeds_) == 0:
        spectrum, unsteadiness = _price_of_unknown_speed(detector)
        said.append(
            "rpm is not given, so the limits are those for a speed that differs by the factor 1.3: "
            f"the spectrum must deviate {spectrum:.2g} times as far as at a known speed before a "
            f"row is flagged, the unsteadiness {unsteadiness:.2g} times, and most faults are "
            "missed. If the speed is known, if only as one number for all rows, pass it to fit "
            "and to predict."
        )
    if len(detector.speeds_) == 1:
        said.append(
            f"All healthy rows have one speed, {detector.speeds_[0]:g} rpm. How far a healthy "
            "bearing drifts with speed is taken from other bearings. Healthy rows at more speeds "
            "give narrower limits at other speeds."
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


def _price_of_unknown_speed(detector):
    """Return by which factors the limits widen at a speed that differs by the factor 1.3.

    First the factor for the spectrum, as a geometric mean over the cepstra; then the factor for
    the unsteadiness.
    """
    drift = SLOPES[0]["drift"] ** 2
    near, far = (drift_variance(b, detector.drift_scale_) + SAME_SPEED for b in (0.0, 1.0))
    scatter = detector.variances_
    spectrum = np.exp(np.mean(np.log((scatter + far) / (scatter + near))) / 2)
    own = detector.deviations_[0] ** 2 * (1 + 1 / detector.n_blocks_)
    slope = detector.slopes_[0, 1] * UNIT_DISTANCE**2
    return float(spectrum), float(np.sqrt((own + far * drift + slope) / (own + near * drift)))
