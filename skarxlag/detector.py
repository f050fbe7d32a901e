"""Detection of faults from healthy recordings alone, at any speed."""

from __future__ import annotations

import warnings
from numbers import Integral
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_scalar

from ._base import RowOutlierDetector
from ._calibration import log_speeds, measure, weak_points
from ._parallel import one_thread
from ._validation import (
    AT_LEAST_1,
    INNOVATIONS,
    NEGATIVE,
    NOT_NEGATIVE,
    POSITIVE,
    Values,
    check_rate,
    remember_parameters,
    uses_fitted,
    validate_innovations,
    weighted_windows,
)
from .kernels.healthy_limits import Limits, calibrate, drift_scale, log_p_values, parts_of_rows
from .kernels.healthy_rows import number_of_cepstra
from .kernels.speed_drift import UNIT_DISTANCE, group_speeds

#: Samples that a spectrum takes at least.
_SHORTEST_SPECTRUM = 8


def _n_references(detector):
    return max(len(detector.speeds_), 1)


def _n_cepstra(detector):
    return number_of_cepstra(int(detector.window_shape_[-1]) // detector.n_windows_)


class FaultDetector(RowOutlierDetector):
    r"""Flag rows unlike the healthy ones, with limits that widen with the distance in speed.

    A row is a window or a longer stretch of a signal, commonly of a model's innovations. What a
    healthy bearing shows changes with the speed of the shaft, by how much is not known beforehand.
    The detector expects at a speed between those of `fit` what lies between, and it takes the
    change for a Brownian motion over the logarithm of speed: the farther a row's speed lies from
    those of `fit`, the farther the row itself may lie from what is expected.

    Of each row a few things are looked at, and each gives a p-value: the probability that a
    healthy row is at least as far off.

    - *Cepstra.* The cosine coefficients d of two log spectra, the colour and the steadiness of each
      frequency band:

      .. math::

          s_1 = \log\, \mathrm{mean}\, (d - \hat d)^T
                \left[S_w / m + (\kappa v + 0.02)\, D\right]^{-1} (d - \hat d)

      with the scatter :math:`S_w` of healthy windows, m windows in a row, the covariance D of
      what a change of speed by the factor 1.3 does, the variance v of the Brownian motion at the
      row's speed (1 at the factor 1.3 outside the speeds of `fit`), and the drift scale
      :math:`\kappa`.
    - *Unsteadiness* g, how far the power of the bands is from that of steady noise:

      .. math::

          s_2 = (g - \hat g) \big/
                \sqrt{s^2 + (\kappa v + 0.02)\, \sigma^2 + \kappa V_b e^2}

      with e the logarithm of speed beyond the speeds of `fit`, where :math:`\hat g` follows a slope
      of variance :math:`V_b`. Only more than is expected counts.
    - *Level*, where the gain of the sensor is fixed, in the same way. Less than is expected counts
      as well, since a sensor may come loose. A row of fewer than 8 samples has no spectrum, so its
      level counts in any case.

    Scores are compared with Student's t over blocks of time that were left out, five to ten for
    each speed. Where a speed has fewer than five rows, and rows have several windows, blocks are
    parts of rows. The row's p-value is the smallest of them, times their number.

    Parameters
    ----------
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy rows that may be flagged.
    fixed_gain : bool, default=False
        Whether all recordings have the same sensor, mounting and amplification. Then the level
        counts, and the rows must be in the unit of the sensor.
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
        out, holds the false-alarm rate. At least 0.25.
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
    ThresholdLadder : Names the fault, where recordings of faults are at hand.

    Notes
    -----
    docs/detection.md says in words what may be expected of the stated rate.

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
    >>> found[:, ::600] += 20_000  # strikes
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
        "speeds_": Values(
            (None,),
            (lambda v, e: np.all(v > 0) and np.all(np.diff(v) > 0), "speeds above 0, ascending"),
        ),
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

    #: Metadata routing hands these over without a call of `set_fit_request` and its like.
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
        log_speed = log_speeds(rpm, len(X))
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
        rows = measure(parts, n_windows, with_level=with_level, n_jobs=self.n_jobs)
        limits = self._calibrate(rows, known, at, weights)
        self.speeds_ = np.exp(known) if rpm is not None else np.empty(0)
        # Most of a saved detector; seven digits are more than the scatter of rows leaves.
        self.axes_ = limits.axes.astype(np.float32)
        # The mean of more windows scatters less.
        self.variances_ = limits.variances * (n_windows / self.n_windows_)
        remember_parameters(self)
        for sentence in weak_points(self, self.false_alarm_rate):
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
            self.drift_scale_, self.left_out_rates_ = drift_scale(
                rows, known, at, limits, self.false_alarm_rate, weights
            )
        return limits

    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Probability that a healthy row is at least as far off.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows as long as those of `fit`.
        rpm : float, array-like of shape (n_rows,) or None, default=None
            Speed of the shaft in each row; needed where `fit` had speeds, else not used.

        Returns
        -------
        ndarray of shape (n_rows,)
            In (0, 1].

        Raises
        ------
        ValueError
            If a speed is not above 0, or `fit` had speeds and there are none here.

        Warns
        -----
        UserWarning
            If rows lie more than the factor 1.3 outside the speeds of `fit`.
        """
        return np.exp(self.score_samples(X, rpm))

    @uses_fitted
    def score_samples(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Logarithm of the p-value of each row.

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
        log_speed = self._distant_speeds(rpm, len(X))
        with_level = self.means_.shape[1] > 1
        rows = measure(X, self.n_windows_, with_level=with_level, n_jobs=self.n_jobs)
        return self._log_p_values_of(rows, log_speed)

    @uses_fitted
    @one_thread
    def _log_p_values_of(self, rows, log_speed, two_sided=False):
        """Log p-values of measured rows; where speeds are not known, the largest of some speeds."""
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
        """Log speeds of rows, or None where `fit` had none."""
        if len(self.speeds_) == 0:
            return None
        if rpm is None:
            listed = ", ".join(f"{speed:g}" for speed in self.speeds_)
            raise ValueError(
                f"rpm is None, expected the speed of each row: FaultDetector was fitted at "
                f"{listed} rpm."
            )
        log_speed = log_speeds(rpm, n_rows)
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
