"""Outlier detectors for rows of healthy bearings and of known conditions, at any speed."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, OutlierMixin
from sklearn.utils import Bunch, check_scalar

from ..core.base import SignalEstimator
from ..core.parallel import BATCH, map_batches, one_thread
from ..core.speeds import log_speeds, with_plausible_speeds
from ..core.state import (
    INNOVATIONS,
    SPEEDS,
    Labels,
    Values,
    check_state,
    expect,
    uses_fitted,
)
from ..core.validation import (
    check_rate,
    of_one_model,
    validate_innovations,
    warn_of_lost_speeds,
    warn_user,
    weighted_windows,
)
from ..kernels import healthy_limits
from ..kernels.healthy_rows import Rows, measure_rows, number_of_cepstra
from ..kernels.ladder import rows_that_hold
from ..kernels.speed_references import UNIT_DISTANCE, group_speeds, speed_distance

#: Fields of `Limits` that are attributes of a detector, with an underscore at the end.
_LIMITS = [name for name in healthy_limits.Limits._fields if name != "known"]
#: Samples that a spectrum takes at least.
_SHORTEST_SPECTRUM = 8
#: Log p-value of a row without a plausible speed: the p-value is the smallest above 0.
_LEAST_LOG_P = float(np.log(np.finfo(np.float32).tiny))
#: Drift scale of a condition without rows at several speeds: faults drift more than a
#: healthy bearing.
_DRIFT_OF_FAULTS = 3.0


class RowOutlierDetector(SignalEstimator, OutlierMixin, BaseEstimator):
    """Outlier detector whose score is the logarithm of a p-value.

    A subclass sets `offset_`, the logarithm of the stated rate, and its other fitted
    attributes in `_learn`, where NaN is an unknown speed, and which returns sentences
    to warn of. Its method `_detectors` returns one `FaultDetector` for each set of
    limits.
    """

    offset_: float
    #: Whether rows have conditions. Less unsteadiness than expected then counts, too.
    _knows_conditions: ClassVar[bool] = False

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}

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
        labels, y = (None, y) if self._knows_conditions else (y, None)
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        log_speed = log_speeds(rpm, len(X), X.shape[-1])
        log_speed = np.full(len(X), np.nan) if log_speed is None else log_speed
        rows, y, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        X = X if len(rows) == len(X) else X[rows]
        sentences = self._learn(X, y, log_speed[rows], weights)
        sentences = [*_said_of_labels(labels), *sentences]
        for sentence in sentences:
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
        logs = self._log_p_values(X, rpm)
        score = logs.max(axis=1) - self.offset_
        verdict = np.where(score < 0, -1, 1)
        return Bunch(
            verdict=verdict, score=score, alarm=score < 0, p_values=np.exp(logs)
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
        n_windows, with_level = (
            detectors[0].n_windows_,
            detectors[0].means_.shape[1] > 1,
        )
        rows = measure(X, n_windows, with_level=with_level, n_jobs=self.n_jobs)
        two_sided = self._knows_conditions
        found = [
            each._log_p_values_of(rows, log_speed, two_sided) for each in detectors
        ]
        return np.where(
            is_plausible[:, np.newaxis], np.stack(found, axis=1), _LEAST_LOG_P
        )

    def _log_speeds(self, rpm, X, known):
        """Return log speeds, or None if `fit` had none, and which of them are plausible."""
        if rpm is None and len(known) > 0:
            warn_of_lost_speeds(self)
        rpm, is_plausible = with_plausible_speeds(rpm, len(X), known)
        return log_speeds(
            rpm if len(known) > 0 else None, len(X), X.shape[-1]
        ), is_plausible

    def _capabilities(self):
        detectors = self._detectors()
        speeds = tuple(np.unique(_speeds_of(detectors).round(6)).tolist())
        is_stretch = detectors[0].n_windows_ > 1
        return {
            "takes_rpm": len(speeds) > 0,
            "speeds": speeds,
            "is_stretch": is_stretch,
        }


def _said_of_labels(y):
    """Return what is to be said of labels that a detector of faults ignores."""
    labels = [] if y is None else np.unique(np.asarray(y).astype(str)).tolist()
    if len(labels) < 2:
        return []
    return [
        f"y has {len(labels)} labels ({', '.join(labels[:3])}{', ...' * (len(labels) > 3)}), but "
        "all rows count as healthy. Pass healthy rows alone."
    ]


def _speeds_of(detectors):
    return np.unique(np.concatenate([each.speeds_ for each in detectors]))


@dataclass(kw_only=True, eq=False, repr=False)
class FaultDetector(RowOutlierDetector):
    r"""Outlier detector that flags rows unlike healthy ones, at any speed.

    Use `KnownConditions` instead to compare rows with several conditions, and
    `ThresholdLadder.detect` instead for levels of residuals.

    A row is a window or a longer stretch of a signal, commonly of a model's
    innovations. The signal of a healthy bearing changes with the speed of the shaft.
    The detector interpolates between the speeds of `fit`, and models the change as a
    Brownian motion over the logarithm of speed: the limits widen with the distance from
    the speeds of `fit`.

    Each row has two or three features, and each feature gives a p-value: the
    probability that a healthy row deviates at least as much.

    - *Cepstra.* The cosine coefficients d of two log spectra: the spectral shape
      (colour) and the steadiness of each frequency band:

      .. math::

          s_1 = \log\, \mathrm{mean}\, (d - \hat d)^T
                \left[S_w / m + (\kappa v + 0.09)\, D\right]^{-1} (d - \hat d)

      with the scatter :math:`S_w` of healthy windows, m windows in a row, the
      covariance D of the change when the speed changes by the factor 1.3, the drift
      scale :math:`\kappa`, and :math:`v = \sqrt b`. Here b is the variance of the
      Brownian motion at the row's speed: 0 at a speed of `fit`, 1 at the factor 1.3
      outside these speeds. The root widens the limits close to the speeds of `fit`,
      since two recordings differ in load and mounting, too.
    - *Unsteadiness* g, the deviation of the power in the bands from that of steady
      noise:

      .. math::

          s_2 = (g - \hat g) \big/
                \sqrt{s^2 + (\kappa v + 0.09)\, \sigma^2 + \kappa V_b e^2}

      with e the logarithm of speed beyond the speeds of `fit`, where :math:`\hat g`
      follows a slope of variance :math:`V_b`. Only more than is expected counts.
    - *Level*, if the gain of the sensor is fixed, in the same way. The test is
      two-sided, since a sensor may come loose. A row of fewer than 8 samples has no
      spectrum, so its level always counts.

    Scores are compared with Student's t distribution. Its scale is measured on blocks
    of time that are left out, five to ten for each speed. If a speed has fewer than
    five rows, and rows have several windows, the blocks are parts of rows. The p-value
    of a row is the smallest p-value of its features, times their number.

    Parameters
    ----------
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy rows that may be flagged.
    fixed_gain : bool, default=False
        Whether all recordings have the same sensor, mounting and amplification. If so,
        the level is tested, and the rows must be in the unit of the sensor.
    window_length : int, default=4800
        A row is cut into windows of this many samples or a little more, at least 1; a
        shorter row is one window.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    offset_ : float
        Logarithm of the false-alarm rate: rows of a lower score are flagged.
    speeds_ : ndarray of shape (n_speeds,)
        Speeds of the healthy rows in revolutions per minute, ascending; those within 2
        % of each other are one. Empty if `fit` had none.
    drift_scale_ : float
        :math:`\kappa`: 1 with one speed. With several, twice the smallest scale at
        which every left-out speed holds false-alarm rates of 1 % and 5 %. At least
        0.25. It does not depend on `false_alarm_rate`, so a row that is flagged at 1 %
        is flagged at 5 %, too.
    left_out_rates_ : ndarray of shape (n_speeds,)
        Share of the healthy rows of each speed (or of parts of rows, if these are the
        blocks) that are flagged if the references come from the other speeds. Empty
        with one speed.
    n_rows_, n_windows_ : int
        Healthy rows in `fit`, and windows in each.
    n_blocks_ : int
        Blocks of time from which the limits are computed.
    axes_ : ndarray of float32 of shape (n_cepstra, n_cepstra)
        Coordinates of cepstra in which D is the identity and the scatter is diagonal.
    variances_ : ndarray of shape (n_cepstra,)
        The scatter of rows in these coordinates.
    references_ : ndarray of shape (n_speeds or 1, n_cepstra)
        Mean cepstra in these coordinates, for each speed.
    means_ : ndarray of shape (n_speeds or 1, 1 or 2)
        Mean log unsteadiness, and mean log level if it counts.
    slopes_ : ndarray of shape (1 or 2, 2)
        Their slopes against log speed, and the variances :math:`V_b` of the slopes.
    deviations_ : ndarray of shape (1 or 2,)
        Their deviations s between blocks of time.
    score_mean_, score_deviation_ : float
        Mean and deviation of :math:`s_1` on blocks that were left out.
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
    skarxlag.make_detector : The detector behind a model that explains measured inputs.
    ThresholdLadder : Classifier for recordings of faults.

    Notes
    -----
    docs/detection.md explains what the stated rate promises.

    Examples
    --------
    Healthy noise whose colour and level change with speed. Tested at a speed that was
    not given:

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

    false_alarm_rate: float = 0.01
    fixed_gain: bool = False
    window_length: int = 4800
    n_jobs: int | None = None

    _state = INNOVATIONS | {
        "n_rows_": Values((), "at least 2", "i"),
        "n_windows_": Values((), "at least 1", "i"),
        "n_blocks_": Values((), "at least 2", "i"),
        "speeds_": SPEEDS,
        "deviations_": Values((None,), "above 0"),
        "variances_": Values(
            lambda e: (number_of_cepstra(int(e.window_shape_[-1]) // e.n_windows_),),
            "at least 0",
        ),
        "axes_": Values(lambda e: 2 * (len(e.variances_),)),
        "references_": Values(lambda e: (max(len(e.speeds_), 1), len(e.variances_))),
        "means_": Values(lambda e: (len(e.references_), len(e.deviations_))),
        "left_out_rates_": Values(
            lambda e: (len(e.speeds_) * (len(e.speeds_) > 1),), "at least 0"
        ),
        "slopes_": Values(
            lambda e: (len(e.deviations_), 2),
            (lambda v, e: v[:, 1] >= 0, "variances of at least 0 in the second column"),
        ),
        "drift_scale_": Values((), "above 0"),
        "score_deviation_": Values((), "above 0"),
        "score_mean_": Values(),
        "offset_": Values((), "below 0"),
    }

    @one_thread
    def _learn(self, X, y, log_speed, weights):
        known, at = group_speeds(log_speed)
        name = f"n_samples = {len(X)}: largest number of rows of one speed"
        expect(np.bincount(at).max() >= 2, name, 1, "at least 2")
        self.n_rows_: int = len(X)
        self.n_windows_: int = max(X.shape[-1] // self.window_length, 1)
        # Few long rows are calibrated on their parts.
        n_parts = healthy_limits.parts_of_rows(at, self.n_windows_)
        n_windows = self.n_windows_ // n_parts
        with_level = bool(self.fixed_gain) or X.shape[-1] < _SHORTEST_SPECTRUM
        rows = measure(
            X, self.n_windows_, n_parts, with_level=with_level, n_jobs=self.n_jobs
        )
        at, weights = np.repeat(at, n_parts), np.repeat(weights, n_parts)
        healthy = healthy_limits.HealthyRows(rows, np.nan_to_num(known), at, weights)
        limits = healthy_limits.calibrate(healthy)
        vars(self).update({name + "_": limits._asdict()[name] for name in _LIMITS})
        # Most of a saved detector; seven digits are more than the scatter of rows
        # leaves.
        self.axes_: NDArray[np.float32] = limits.axes.astype(np.float32)
        # The mean of more windows has a smaller variance.
        self.variances_: NDArray[Any] = limits.variances * (n_windows / self.n_windows_)
        self.speeds_: NDArray[Any] = np.exp(known[~np.isnan(known)])
        self.offset_: float = float(np.log(self.false_alarm_rate))
        scale, shares = 1.0, np.empty(0)
        if len(known) > 1:
            scale, left_out = healthy_limits.drift_scale(healthy, limits)
            shares = healthy_limits.flagged_shares(left_out, at, self.offset_, weights)
        self.drift_scale_: float = scale
        self.left_out_rates_: NDArray[Any] = shares
        return self._weak_points()

    def _weak_points(self, rows="healthy rows"):
        """Yield sentences on a calibration that promises less than its user may think."""
        rate, n_speeds = self.false_alarm_rate, len(self.speeds_)
        yield from few_rows(f"{self.n_rows_} {rows}", self.n_rows_, rate)
        if n_speeds == 0:
            yield (
                "rpm is not given, so the limits are those for a speed that differs by the factor "
                "1.3, which most faults do not exceed. If the speed is known, if only as one "
                "number for all rows, pass it to fit and to predict."
            )
        if n_speeds == 1:
            yield (
                f"All {rows} have one speed, {self.speeds_[0]:g} rpm. How far they drift with "
                "speed is taken from other bearings. Rows at more speeds give narrower limits at "
                "other speeds."
            )
        if np.any(self.left_out_rates_ > rate):
            rates = zip(self.left_out_rates_, self.speeds_, strict=True)
            listed = ", ".join(
                f"{share:.2g} at {speed:g} rpm" for share, speed in rates
            )
            yield (
                f"No drift scale up to {self.drift_scale_:g} holds the stated false-alarm rate "
                f"{rate:g} at every speed that is left out: {listed}."
            )

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
            If `fit` had speeds and `rpm` is None.

        Warns
        -----
        UserWarning
            If a speed is not above 0, or farther than a factor of 5 outside the speeds
            of `fit`: the p-value is then nearly 0. If rows lie more than the factor 1.3
            outside the speeds of `fit`.
        """
        return np.exp(self.score_samples(X, rpm))

    def _detectors(self):
        return [self]

    @uses_fitted
    @one_thread
    def _log_p_values_of(self, rows, log_speed, two_sided=False):
        """Compute log p-values of measured rows; for unknown speeds, the largest of some speeds."""
        known = np.log(self.speeds_) if len(self.speeds_) > 0 else np.zeros(1)
        fields = {name: vars(self)[name + "_"] for name in _LIMITS}
        limits = healthy_limits.Limits(known=known, **fields)
        tried = [log_speed]
        if len(self.speeds_) == 0:
            tried = [UNIT_DISTANCE]
        elif log_speed is None:
            tried = [*known, known[0] - UNIT_DISTANCE, known[-1] + UNIT_DISTANCE]
        of_rows = [np.broadcast_to(speed, len(rows.values)) for speed in tried]
        settings = {"scale": self.drift_scale_, "two_sided": two_sided}
        found = [
            healthy_limits.log_p_values(limits, rows, each, **settings)
            for each in of_rows
        ]
        return np.max(found, axis=0)

    def _log_speeds(self, rpm, X, known):
        wanted = (
            f"the speed of each row, as in fit, which had {known.round(3).tolist()} rpm"
        )
        expect(len(known) == 0 or rpm is not None, "rpm", rpm, wanted)
        log_speed, is_plausible = super()._log_speeds(rpm, X, known)
        if log_speed is not None:
            beyond = np.abs(speed_distance(log_speed, np.log(known)).beyond)
            outside = np.exp(log_speed[beyond > UNIT_DISTANCE + 1e-9])
            if len(outside) > 0:
                warn_user(
                    f"{len(outside)} of {len(X)} rows at {outside.min():g} to {outside.max():g} "
                    f"rpm lie more than the factor 1.3 outside the speeds of fit, {known[0]:g} to "
                    f"{known[-1]:g} rpm: limits are wide there, and faults are missed."
                )
        return log_speed, is_plausible

    def _capabilities(self):
        own = {
            "alarm": True,
            "healthy_p_value": True,
            "stated_rate": self.false_alarm_rate,
        }
        own["n_healthy"] = self.n_rows_
        common = super()._capabilities()
        return common | own | {"needs_rpm": common["takes_rpm"]}

    def _check_parameters(self):
        check_rate(self.false_alarm_rate, "false_alarm_rate")
        check_scalar(self.fixed_gain, "fixed_gain", (bool, np.bool_))
        check_scalar(self.window_length, "window_length", Integral, min_val=1)


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
    much. The test of the unsteadiness is two-sided: a row with fewer impacts than
    expected is rejected, too. A row is rejected if p is below the stated rate. Since
    :math:`p \ge p_c`, a row of a known condition c is rejected with a probability of at
    most the rate that the limits of c hold.

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
        The limits of each condition. With rows at one speed, their drift scale is 3.
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
    Two conditions of different colour, and noise that is like neither:

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
    >>> known.p_values(new[:1], rpm=1000).round(2)  # of "good" and of "worn"
    array([[1., 0.]])
    """

    false_rejection_rate: float = 0.01
    window_length: int = 4800
    n_jobs: int | None = None

    _knows_conditions = True
    _state = INNOVATIONS | {"offset_": Values((), "below 0"), "classes_": Labels()}

    def _learn(self, X, y, log_speed, weights):
        labels = np.full(len(X), "known") if y is None else y
        self.offset_: float = float(np.log(self.false_rejection_rate))
        self.classes_: NDArray[Any] = np.unique(labels)
        self.detectors_: list[FaultDetector] = []
        left_out = []
        for name in self.classes_.tolist():
            own = labels == name
            if np.bincount(group_speeds(log_speed[own])[1]).max() < 2:
                left_out.append(name)
                continue
            settings = {"window_length": self.window_length, "n_jobs": self.n_jobs}
            detector = FaultDetector(
                false_alarm_rate=self.false_rejection_rate, **settings
            )
            vars(detector).update({name: vars(self)[name] for name in INNOVATIONS})
            detector._learn(X[own], None, log_speed[own], weights[own])
            if len(detector.speeds_) < 2:
                detector.drift_scale_ = _DRIFT_OF_FAULTS
            self.detectors_.append(detector)
        name = (
            f"n_samples = {len(X)}: largest number of rows of one condition and speed"
        )
        expect(len(self.detectors_) > 0, name, 1, "at least 2")
        self.classes_ = self.classes_[~np.isin(self.classes_, left_out)]
        return self._weak_points(left_out)

    def _weak_points(self, left_out):
        """Yield sentences on a calibration that promises less than its user may think."""
        if left_out:
            listed = ", ".join(map(repr, left_out))
            yield (
                f"Conditions with one row at each speed are left out: {listed}. Their own rows "
                "may be taken for none of the known conditions."
            )
        weakest = min(
            self.detectors_, key=lambda each: (len(each.speeds_), each.n_rows_)
        )
        name = self.classes_[self.detectors_.index(weakest)]
        yield from weakest._weak_points(f"rows of condition {name}")

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
        own = {"none_of_these": True, "stated_rate": self.false_rejection_rate}
        return super()._capabilities() | own

    def _check_parameters(self):
        check_rate(self.false_rejection_rate, "false_rejection_rate")
        check_scalar(self.window_length, "window_length", Integral, min_val=1)

    def _check_relations(self):
        detectors, n = vars(self).get("detectors_"), len(self.classes_)
        rows = []
        if isinstance(detectors, list) and all(
            isinstance(d, FaultDetector) for d in detectors
        ):
            for detector in detectors:
                check_state(detector)
                shape = detector.window_shape_.tolist()
                rows.append((shape, detector.n_windows_, detector.means_.shape[1]))
        own_shape = self.window_shape_.tolist()
        fits = len(rows) > 0 and rows == rows[:1] * n and rows[0][0] == own_shape
        wanted = f"{n} of FaultDetector by classes_, for rows of window_shape_ {own_shape}: {rows}"
        expect(fits, "detectors_", detectors, wanted)


def measure(
    X: NDArray[Any],
    n_windows: int,
    n_parts: int = 1,
    *,
    with_level: bool,
    n_jobs: int | None,
) -> Rows:
    """Compute the features of rows of shape (n_rows, 1, n_samples), or of parts of rows."""
    of_part = n_windows // n_parts
    length = of_part * (X.shape[-1] // n_windows)

    def of_batch(batch):
        signals = of_one_model(X[batch])[:, : n_parts * length].reshape(-1, length)
        some = [signals[start : start + few] for start in range(0, len(signals), few)]
        return [measure_rows(each, of_part, with_level=with_level) for each in some]

    few = max(BATCH // of_part, 1)
    parts = map_batches(of_batch, len(X), n_jobs, max(BATCH // n_windows, 1))
    found = [each for part in parts for each in part]
    return Rows(*(np.concatenate(part) for part in zip(*found, strict=True)))


def few_rows(rows: str, n: int, rate: float) -> list[str]:
    """Return a sentence if n rows do not hold a rate without assumptions, in a list.

    >>> print(*few_rows("4 healthy windows", 4, 0.01))
    4 healthy windows are too few to hold the rate 0.01 without an assumption on the distribution of
    their scores. They hold 1/5 = 0.2. Use at least 99 rows.
    >>> few_rows("99 healthy windows", 99, 0.01)
    []
    """
    needed = rows_that_hold(rate)
    sentence = (
        f"{rows} are too few to hold the rate {rate:g} without an assumption on the distribution "
        f"of their scores. They hold 1/{n + 1} = {1 / (n + 1):.2g}. Use at least {needed} rows."
    )
    return [sentence] if n < needed else []
