"""Outlier detector that flags rows unlike healthy ones, at any speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.state import expect, uses_fitted
from ..core.validation import check_count, check_flag, check_rate, warn_user
from ..kernels import healthy_limits
from ..kernels.speed_references import UNIT_DISTANCE, group_speeds, speed_distance
from .row_outliers import RowOutlierDetector, too_few_rows


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

    - *Spectral shape.* The cosine coefficients d of the log spectrum, as `LogSpectra`
      measures it:

      .. math::

          s_1 = \log\, \frac1N \sum_{n=1}^{N} \frac{(d_n - \hat d_n)^2}
                {s_n^2 / m + (\kappa v + 0.03)\, (0.3\, n^{-2} + 0.01)}

      with the variances :math:`s_n^2` of healthy windows, m windows in a row, the
      smooth and rough drift of `SpectralDistance`, the drift scale :math:`\kappa`, and
      :math:`v = \sqrt b`. Here b is the variance of the Brownian motion at the row's
      speed: 0 at a speed of `fit`, 1 at the factor 1.3 outside these speeds. The root
      widens the limits close to the speeds of `fit`, since two recordings differ in
      load and mounting, too.
    - *Mean steadiness* g of `LogSpectra` over all bands. Impacts lower it, and tones
      raise it:

      .. math::

          s_2 = (g - \hat g) \big/
                \sqrt{s_g^2 + (\kappa v + 0.03)\, \sigma^2}

      with :math:`\sigma = 0.1`. The test is two-sided.
    - *Level*, if the gain of the sensor is fixed, in the same way with
      :math:`\sigma = 0.3`. It falls if a sensor comes loose. A row of fewer than 8
      samples has no spectrum, so its level always counts.

    Scores are compared with Student's t distribution. Its scale is measured on blocks
    of time that are left out, five to ten for each speed. If a speed has fewer than five rows,
    and rows have several windows, the blocks are parts of rows. The p-value of a row is
    the smallest p-value of its features, times their number.

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
        :math:`\kappa`: 1 with one speed. With several, 1.4 times the smallest scale
        from 0.125 to 64 at which every left-out speed holds a false-alarm rate of 5 %.
        It does not depend on `false_alarm_rate`, so a row that is flagged at 1 % is
        flagged at 5 %, too.
    left_out_rates_ : ndarray of shape (n_speeds,)
        Share of the healthy rows of each speed (or of parts of rows, if these are the
        blocks) that are flagged if the references come from the other speeds. Empty
        with one speed.
    n_rows_, n_windows_ : int
        Healthy rows in `fit`, and windows in each.
    n_blocks_ : int
        Blocks of time from which the limits are computed.
    references_ : ndarray of shape (n_speeds or 1, n_cepstra)
        Mean cosine coefficients for each speed.
    variances_ : ndarray of shape (n_cepstra,)
        Their variances between windows.
    means_ : ndarray of shape (n_speeds or 1, 1 or 2)
        Mean steadiness, and mean log level if it counts.
    deviations_ : ndarray of shape (1 or 2,)
        Their deviations between blocks of time.
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

    def _learn(self, rows, y, log_speed, weights):
        train_log_speed, at = group_speeds(log_speed)
        n_rows, n_windows = rows.cepstra.shape[:2]
        name = f"n_samples = {n_rows}: largest number of rows of one speed"
        expect(np.bincount(at).max() >= 2, name, 1, "at least 2")
        # Few long rows are calibrated on their parts.
        n_parts = healthy_limits.parts_of_rows(at, n_windows)
        healthy = healthy_limits.HealthyRows(
            rows.cut(n_parts),
            np.nan_to_num(train_log_speed),
            np.repeat(at, n_parts),
            np.repeat(weights, n_parts),
        )
        limits = healthy_limits.calibrate(healthy)
        offset = float(np.log(self.false_alarm_rate))
        drift_scale, left_out_rates = 1.0, np.empty(0)
        if len(train_log_speed) > 1:
            drift_scale, left_out = healthy_limits.drift_scale(healthy, limits)
            left_out_rates = healthy_limits.flagged_shares(
                left_out, healthy.at, offset, healthy.weights
            )
        self.n_rows_: int = n_rows
        self.n_windows_: int = n_windows
        self.n_blocks_: int = limits.n_blocks
        self.references_: NDArray[Any] = limits.expected.references
        self.variances_: NDArray[Any] = limits.expected.variances
        self.means_: NDArray[Any] = limits.expected.means
        self.deviations_: NDArray[Any] = limits.deviations
        self.score_mean_: float = limits.score_mean
        self.score_deviation_: float = limits.score_deviation
        is_stated = ~np.isnan(train_log_speed)
        self.speeds_: NDArray[Any] = np.exp(train_log_speed[is_stated])
        self.offset_: float = offset
        self.drift_scale_: float = drift_scale
        self.left_out_rates_: NDArray[Any] = left_out_rates
        return self._weak_points()

    @property
    def _counts_level(self):
        return self.fixed_gain

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
    def _log_p_values_of(self, rows, log_speed):
        """Compute log p-values of measured rows; for unknown speeds, the largest of some speeds."""
        has_speeds = len(self.speeds_) > 0
        known_speeds = np.log(self.speeds_) if has_speeds else np.zeros(1)
        limits = healthy_limits.Limits(
            expected=healthy_limits.Expected(
                known_speeds, self.references_, self.variances_, self.means_
            ),
            deviations=self.deviations_,
            score_mean=self.score_mean_,
            score_deviation=self.score_deviation_,
            n_blocks=self.n_blocks_,
        )
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
                np.broadcast_to(hypothesis, len(rows.cepstra)),
                self.drift_scale_,
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
        n_speeds = len(self.speeds_)
        n_references = max(n_speeds, 1)
        length = int(self.window_shape_[-1]) // self.n_windows_
        n_cepstra = healthy_limits.number_of_cepstra(length)
        self._check_array("references_", (n_references, n_cepstra))
        self._check_array("variances_", (n_cepstra,), "at least 0")
        self._check_array("deviations_", (None,), "above 0")
        self._check_array("means_", (n_references, len(self.deviations_)))
        n_left_out = n_speeds if n_speeds > 1 else 0
        self._check_array("left_out_rates_", (n_left_out,), "at least 0")
        self._check_number("drift_scale_", "above 0")
        self._check_number("score_deviation_", "above 0")
        self._check_number("score_mean_")

    def _check_parameters(self):
        check_rate(self.false_alarm_rate, "false_alarm_rate")
        check_flag(self.fixed_gain, "fixed_gain")
        check_count(self.window_length, "window_length")
