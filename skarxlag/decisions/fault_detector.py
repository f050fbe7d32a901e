"""Outlier detector that flags rows unlike healthy ones, at any speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.parallel import one_thread
from ..core.state import expect, uses_fitted
from ..core.validation import check_count, check_flag, check_rate, warn_user
from ..kernels import healthy_limits
from ..kernels.healthy_rows import number_of_cepstra
from ..kernels.speed_references import UNIT_DISTANCE, group_speeds, speed_distance
from .row_outliers import RowOutlierDetector, features_of_rows, too_few_rows

#: Fields of `Limits` that are attributes of a detector, with an underscore at the end.
_LIMITS = [name for name in healthy_limits.Limits._fields if name != "known_speeds"]
#: Samples that a spectrum takes at least.
_SHORTEST_SPECTRUM = 8


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
      and the steadiness of each frequency band:

      .. math::

          s_1 = \log\, \mathrm{mean}\, (d - \hat d)^T
                \left[S_w / m + (\kappa v + 0.09)\, D\right]^{-1} (d - \hat d)

      with the scatter :math:`S_w` of healthy windows, m windows in a row, the
      covariance D of the change when the speed changes by the factor 1.3, the drift
      scale :math:`\kappa`, and :math:`v = \sqrt b`. Here b is the variance of the
      Brownian motion at the row's speed: 0 at a speed of `fit`, 1 at the factor 1.3
      outside these speeds. The root widens the limits close to the speeds of `fit`,
      since two recordings differ in load and mounting, too.
    - *Impulsiveness* g, the deviation of the power in the bands from that of steady
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
        Mean log impulsiveness, and mean log level if it counts.
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
    Healthy noise whose spectral shape and level change with speed. Tested at a speed that was
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

    @one_thread
    def _learn(self, X, y, log_speed, weights):
        train_log_speed, at = group_speeds(log_speed)
        name = f"n_samples = {len(X)}: largest number of rows of one speed"
        expect(np.bincount(at).max() >= 2, name, 1, "at least 2")
        self.n_rows_: int = len(X)
        self.n_windows_: int = max(X.shape[-1] // self.window_length, 1)
        # Few long rows are calibrated on their parts.
        n_parts = healthy_limits.parts_of_rows(at, self.n_windows_)
        n_windows = self.n_windows_ // n_parts
        with_level = bool(self.fixed_gain) or X.shape[-1] < _SHORTEST_SPECTRUM
        rows = features_of_rows(
            X, self.n_windows_, n_parts, with_level=with_level, n_jobs=self.n_jobs
        )
        at = np.repeat(at, n_parts)
        weights = np.repeat(weights, n_parts)
        healthy = healthy_limits.HealthyRows(
            rows, np.nan_to_num(train_log_speed), at, weights
        )
        limits = healthy_limits.calibrate(healthy)
        for name in _LIMITS:
            setattr(self, f"{name}_", getattr(limits, name))
        # Most of a saved detector; seven digits are more than the scatter of rows
        # leaves.
        self.axes_: NDArray[np.float32] = limits.axes.astype(np.float32)
        # The mean of more windows has a smaller variance.
        self.variances_: NDArray[Any] = limits.variances * (n_windows / self.n_windows_)
        is_stated = ~np.isnan(train_log_speed)
        self.speeds_: NDArray[Any] = np.exp(train_log_speed[is_stated])
        self.offset_: float = float(np.log(self.false_alarm_rate))
        self.drift_scale_: float = 1.0
        self.left_out_rates_: NDArray[Any] = np.empty(0)
        if len(train_log_speed) > 1:
            self.drift_scale_, left_out = healthy_limits.drift_scale(healthy, limits)
            self.left_out_rates_ = healthy_limits.flagged_shares(
                left_out, at, self.offset_, weights
            )
        return self._weak_points()

    def _weak_points(self, rows="healthy rows"):
        """Yield sentences on a calibration that promises less than its user may think."""
        rate = self.false_alarm_rate
        n_speeds = len(self.speeds_)
        yield from too_few_rows(f"{self.n_rows_} {rows}", self.n_rows_, rate)
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
        has_speeds = len(self.speeds_) > 0
        known_speeds = np.log(self.speeds_) if has_speeds else np.zeros(1)
        fields = {name: getattr(self, f"{name}_") for name in _LIMITS}
        limits = healthy_limits.Limits(known_speeds=known_speeds, **fields)
        if not has_speeds:
            hypotheses = [UNIT_DISTANCE]
        elif log_speed is None:
            hypotheses = [
                known_speeds[0] - UNIT_DISTANCE,
                *known_speeds,
                known_speeds[-1] + UNIT_DISTANCE,
            ]
        else:
            hypotheses = [log_speed]
        log_p_values = [
            healthy_limits.log_p_values(
                limits,
                rows,
                np.broadcast_to(hypothesis, len(rows.values)),
                scale=self.drift_scale_,
                two_sided=two_sided,
            )
            for hypothesis in hypotheses
        ]
        return np.max(log_p_values, axis=0)

    def _log_speeds(self, rpm, X, train_rpm):
        if len(train_rpm) > 0 and rpm is None:
            listed = train_rpm.round(3).tolist()
            expected = f"the speed of each row, as in fit, which had {listed} rpm"
            expect(False, "rpm", rpm, expected)
        log_speed, is_plausible = super()._log_speeds(rpm, X, train_rpm)
        if log_speed is not None:
            beyond = np.abs(speed_distance(log_speed, np.log(train_rpm)).beyond)
            outside = np.exp(log_speed[beyond > UNIT_DISTANCE + 1e-9])
            if len(outside) > 0:
                warn_user(
                    f"{len(outside)} of {len(X)} rows at {outside.min():g} to "
                    f"{outside.max():g} rpm lie more than the factor 1.3 outside the speeds of "
                    f"fit, {train_rpm[0]:g} to {train_rpm[-1]:g} rpm: limits are wide there, and "
                    "faults are missed."
                )
        return log_speed, is_plausible

    def _capabilities(self):
        common = super()._capabilities()
        return common | {
            "alarm": True,
            "healthy_p_value": True,
            "limits": self._basis(),
            "stated_rate": self.false_alarm_rate,
            "n_healthy": self.n_rows_,
            "needs_rpm": common["takes_rpm"],
        }

    def _basis(self):
        """Describe what the limits were learned from."""
        basis = f"{self.n_rows_} healthy rows"
        shares = zip(self.speeds_, self.left_out_rates_, strict=False)
        rates = ", ".join(f"{share:.1%} at {speed:g} rpm" for speed, share in shares)
        if not rates:
            return basis
        return f"{basis}; false alarms at speeds that were left out: {rates}"

    def _check_fitted(self):
        super()._check_fitted()
        self._check_number("n_rows_", "at least 2", int)
        self._check_number("n_windows_", "at least 1", int)
        self._check_number("n_blocks_", "at least 2", int)
        self._check_speeds()
        self._check_array("deviations_", (None,), "above 0")
        n_speeds = len(self.speeds_)
        n_measures = len(self.deviations_)
        n_cepstra = number_of_cepstra(int(self.window_shape_[-1]) // self.n_windows_)
        self._check_array("variances_", (n_cepstra,), "at least 0")
        self._check_array("axes_", (n_cepstra, n_cepstra))
        self._check_array("references_", (max(n_speeds, 1), n_cepstra))
        self._check_array("means_", (max(n_speeds, 1), n_measures))
        n_left_out = n_speeds if n_speeds > 1 else 0
        self._check_array("left_out_rates_", (n_left_out,), "at least 0")
        self._check_array("slopes_", (n_measures, 2))
        are_variances = self.slopes_[:, 1] >= 0
        expected = "variances of at least 0 in the second column"
        expect(are_variances, "slopes_", self.slopes_, expected)
        self._check_number("drift_scale_", "above 0")
        self._check_number("score_deviation_", "above 0")
        self._check_number("score_mean_")

    def _check_parameters(self):
        check_rate(self.false_alarm_rate, "false_alarm_rate")
        check_flag(self.fixed_gain, "fixed_gain")
        check_count(self.window_length, "window_length")
