"""Residual of stretches: the orders of the shaft at which impacts repeat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import Bunch

from ..core.base import StretchTransformer
from ..core.parallel import map_rows
from ..core.speeds import REVOLUTIONS_LEFT, log_speeds, samples_per_revolution
from ..core.state import SQUARABLE, uses_fitted
from ..core.validation import check_sampling_rate
from ..kernels.order_spectra import (
    at_orders,
    envelopes_over_angle,
    match,
    order_spectrum,
)
from ..kernels.speed_references import drift_factor, group_means, speed_distance

#: Orders that are compared: from below the order of a cage to several harmonics of an
#: inner ring.
_ORDERS = 0.3 + 0.1 * np.arange(158)
#: Bands of frequency with an envelope each: a resonance that impacts excite fills one
#: or two.
_N_BANDS = 4
#: Most samples in a window of the short-time spectrum: short enough to separate
#: impacts.
_FRAME = 64
#: Turns of the shaft in a segment of Welch's method: lines are then 0.2 orders apart.
_N_TURNS = 5.0
#: Standard deviation of the logarithm of the factor on a nominal speed: slip and a
#: rounded speed.
_SPEED_TOLERANCE = 0.1
#: Largest factor on the speed if the speed is not given; the smallest is its
#: reciprocal.
_SPEED_RANGE = 2.5
#: Variance in squared nepers that a change of speed may add: a level may change by a
#: factor of e.
_DRIFT = 1.0
#: Turns that a training stretch counts as if its speed is not known.
_SUPPOSED_REVOLUTIONS = 20


@dataclass(kw_only=True, eq=False, repr=False)
class OrderResidual(StretchTransformer):
    r"""Transformer from stretches to distances of their order spectra from each condition.

    Impacts in a bearing repeat at fixed *orders*, which are multiples of the shaft's
    speed. They appear in the spectrum of the signal's envelope and stay at their orders
    if the speed changes. The resonances that they excite stay at their frequencies in
    Hz. So the envelope is computed over time and compared over orders [1]_:

    1. The short-time power of the signal is divided by its mean over the stretch at each frequency,
       which whitens the signal. The mean over each of 4 bands is an envelope.
    2. Welch's method, in segments of 5 revolutions of the shaft, gives the spectrum of each
       envelope at the orders .3, .4, ... 16. Its logarithm less its median over orders is z.
    3. The residual of condition c is the smallest distance over factors s on the nominal speed,

    .. math::

        r_c^2 = \min_s \frac{1}{\dim z} \sum_i
        \frac{(z_{s,i} - \bar z_{c,i})^2}{\sigma_i^2 + f v} +
        \frac{1}{50} \Bigl(\frac{\ln s}{\tau}\Bigr)^2

    with :math:`\bar z_c` the mean over the training stretches of c, :math:`\sigma_i^2`
    the variance of the training stretches about these means, and v = 1 the variance, in
    squared nepers of power, which a change of speed may add. Its factor f follows from
    the distance of the speed from the training speeds as in `SpectralDistance`. It is 1
    at a distance of 0.4 in the logarithm of the speed, and if the speed is not given.
    The factor s covers errors of the nominal speed and slip of the rolling elements.
    Its logarithm has a normal distribution with the standard deviation :math:`\tau =
    0.1`, and is at most twice as large; the first term counts as 50 independent values.

    A row of X is a stretch: a part of a recording that holds several revolutions of the
    shaft. Speeds come as the metadata `rpm` of scikit-learn's metadata routing, which
    this estimator requests. The rpm of a row is one number, or one for each sample; the
    envelope is then resampled at equal angles of the shaft.

    Without `rpm` in `fit`, all training stretches must have the same speed, and a
    stretch counts as 20 revolutions. Without `rpm` in `transform`, the speed may differ from
    that of the training stretches by a factor of up to 2.5, because the scale of the
    pattern is searched. In this case :math:`\tau` is half of the logarithm of this
    factor.

    Parameters
    ----------
    sampling_rate : float or None, default=None
        In Hz, above 0. Required if `rpm` is given.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    orders_ : ndarray of shape (n_orders,)
        The orders that are compared. Those above the highest frequency of an envelope
        do not count.
    references_ : ndarray of shape (n_classes, n_bands, n_orders)
        Mean order spectra :math:`\bar z_c`, in nepers of power.
    variances_ : ndarray of shape (n_bands, n_orders)
        The variances :math:`\sigma_i^2`.
    samples_per_revolution_ : float
        Samples in a revolution of the shaft, the geometric mean over the training stretches.
    speeds_ : ndarray of shape (n_speeds,)
        Training speeds in revolutions per minute, ascending; speeds within 2 % count as
        one. Empty without `rpm`.
    window_shape_ : ndarray of int
        Shape of one training stretch.
    n_models_ : int
        1 if rows were innovations, 0 for plain stretches.
    n_features_in_ : int
        Number of models, or samples in a plain stretch.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    StretchResidual : Multiplies this residual with that of the spectra.

    References
    ----------
    .. [1] R. B. Randall and J. Antoni (2011), "Rolling element bearing diagnostics - a
           tutorial", Mechanical Systems and Signal Processing 25, 485-520.

    Examples
    --------
    Bearings with 3.6 and 5.4 impacts per revolution, at 600 rpm and at 900 rpm:

    >>> import numpy as np
    >>> def impacts(order, rpm, rng):
    ...     signal = 0.1 * rng.normal(size=20_000)
    ...     signal[np.arange(0, 20_000, 60 * 10_000 / (rpm * order)).astype(int)] += 5
    ...     return signal
    >>> rng = np.random.default_rng(0)
    >>> X = [impacts(order, 600, rng) for order in (3.6, 3.6, 5.4, 5.4)]
    >>> residual = OrderResidual(sampling_rate=10_000).fit(X, ["a", "a", "b", "b"], rpm=600)
    >>> X_900 = [impacts(order, 900, rng) for order in (3.6, 5.4)]
    >>> residual.transform(X_900, rpm=[900, 900]).argmin(axis=1)
    array([0, 1])
    """

    sampling_rate: float | None = None
    n_jobs: int | None = None
    _suffix = "orders"

    def _learn(self, X, target, weights, rpm):
        self.orders_: NDArray[Any] = _ORDERS.copy()
        supposed = X.shape[-1] / _SUPPOSED_REVOLUTIONS
        revolution_lengths = self._revolution_lengths(X, rpm, supposed)
        mean_of_row = np.log(revolution_lengths).reshape(len(X), -1).mean(axis=1)
        self.samples_per_revolution_: float = float(
            np.exp(np.average(mean_of_row, weights=weights))
        )

        def of_row(row, samples):
            envelopes, step = _envelopes(samples, revolution_lengths[row])
            spectrum = order_spectrum(envelopes, step, _N_TURNS)
            return at_orders(*spectrum, self.orders_, np.ones(1))[0][0]

        spectra = np.stack(map_rows(of_row, X, self.n_jobs))
        self.references_: NDArray[Any] = group_means(spectra, target, weights)
        scatter = (spectra - self.references_[target]) ** 2
        self.variances_: NDArray[Any] = np.average(scatter, axis=0, weights=weights)

    @uses_fitted
    def match(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute the residuals, and the factors on the speed that they belong to.

        Parameters
        ----------
        X : array-like of shape (n_stretches, 1, n_samples) or (n_stretches, n_samples)
            Innovations, or plain stretches.
        rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples), default=None
            Nominal speed in revolutions per minute.

        Returns
        -------
        Bunch
            ``residuals`` and ``factors``, the factor on the speed for each condition,
            both of shape (n_stretches, n_classes); ``spectra`` of shape (n_stretches,
            n_classes, n_bands, n_orders), the order spectra z at these factors, in
            nepers.
        """
        X, _ = self._validate(X)
        self._check_rpm_is_taken(rpm)
        return self._match(X, rpm)

    def _residuals(self, X, rpm):
        return self._match(X, rpm).residuals

    def _match(self, X, rpm):
        lengths = self._revolution_lengths(X, rpm, self.samples_per_revolution_)
        factors = np.ones(len(X))
        deviation = np.log(_SPEED_RANGE) / 2
        if rpm is not None:
            log_speed = log_speeds(rpm, len(X), X.shape[-1])
            distance = speed_distance(log_speed, np.log(self.speeds_))
            factors = drift_factor(distance.variance)
            deviation = _SPEED_TOLERANCE

        def of_row(row, samples):
            envelopes = _envelopes(samples, lengths[row])
            variances = self.variances_ + _DRIFT * factors[row]
            of_classes = (self.references_, variances)
            return match(*envelopes, _N_TURNS, self.orders_, deviation, *of_classes)

        matches = map_rows(of_row, X, self.n_jobs)
        residuals, factors, spectra = map(np.stack, zip(*matches, strict=True))
        return Bunch(
            residuals=residuals.astype(X.dtype), factors=factors, spectra=spectra
        )

    def _revolution_lengths(self, X, rpm, supposed):
        """Return the samples in a revolution of each row, supposed ones without a speed."""
        if rpm is None:
            return np.full(len(X), supposed)
        return samples_per_revolution(
            rpm, self.sampling_rate, len(X), X.shape[-1], REVOLUTIONS_LEFT
        )

    def _check_parameters(self):
        if self.sampling_rate is not None:
            check_sampling_rate(self.sampling_rate)

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        shape = (_N_BANDS, *_ORDERS.shape)
        self._check_array("orders_", _ORDERS.shape, "above 0")
        self._check_array("variances_", shape, "at least 0")
        self._check_array("references_", (len(self.classes_), *shape), SQUARABLE)
        self._check_number("samples_per_revolution_", "above 0")

    def _capabilities(self):
        return super()._capabilities() | {
            "is_stretch": True,
            "compares_orders": True,
            "sampling_rate": self.sampling_rate,
        }


def _envelopes(samples, revolution_length):
    return envelopes_over_angle(
        samples, revolution_length, _FRAME, _N_BANDS, _ORDERS[-1]
    )
