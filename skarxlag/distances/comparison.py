"""Comparison of log spectra with those of each condition, across speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.base import StretchTransformer
from ..core.batches import RowsInBatches, batches_of
from ..core.parallel import one_thread
from ..core.speeds import log_speeds
from ..core.state import SQUARABLE, expect, uses_fitted
from ..core.validation import ABOVE_0, check_real, validate_signals
from ..kernels import drift, speed_references
from ..kernels.spectra import cepstrum

#: Logarithms of powers in double precision are smaller.
_LARGEST = 1e4
#: Added to squared distances, so that their logarithms are finite.
_LEAST = 1e-12


@dataclass(kw_only=True, eq=False, repr=False)
class SpectralDistance(StretchTransformer):
    r"""Transformer from log spectra to distances from each condition that tolerate other speeds.

    A window comes as one or several groups of log spectra: natural logarithms of power
    at the midpoints of equal cells of frequency. Each group is reduced to its cosine
    coefficients without the first, which is the gain. The vector d joins the
    coefficients of all groups. Its distance from condition c at speed q is

    .. math::

        r_c^2 = \tfrac{1}{\dim d}\,(d - \bar d_c(q))^T (S_w + f(q)\,D)^{-1}
        (d - \bar d_c(q)).

    The reference :math:`\bar d_c(q)` is linear in :math:`\ln q` between the means of
    the training windows of c at two neighbouring training speeds, and constant outside.
    :math:`S_w` is the covariance of the training windows about the means of their
    condition and speed. D is the covariance of the changes that another speed may cause
    in the spectra of all conditions,

    .. math::

        D = \mathrm{diag}(c\,n^{-2} + f_0) + w\,S_s + \overline{e e^T}.

    The first part is drift that is smooth over frequency, and drift of any other kind,
    of coefficient n = 1, 2, ... of each group. :math:`S_s` is the change of the
    conditions' mean spectra if the frequency axis is scaled by :math:`e^{\pm 0.1}`,
    because some lines follow the shaft. With several training speeds, the other speeds
    predict each mean, and e is the error of this prediction divided by the root of f.
    The factor f(q) is the variance of a Brownian bridge between the training speeds. It
    is 1 at a distance of 0.4 in :math:`\ln q` outside of them, and at least 0.2.

    Speeds come as the metadata `rpm` of scikit-learn's metadata routing, which this
    estimator requests. Without `rpm` in `fit`, there is one reference for each
    condition. Without `rpm` in `transform`, f is 1, and the residual is the smallest
    over the training speeds and the middles between them.

    Parameters
    ----------
    smooth_drift : float, default=0.3
        The constant c in squared nepers of power, at least 0.
    rough_drift : float, default=0.01
        The constant :math:`f_0` in squared nepers of power, above 0.
    frequency_drift : float, default=0.06
        The weight w of :math:`S_s`, at least 0.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    speeds_ : ndarray of shape (n_speeds,)
        Training speeds in revolutions per minute, ascending; speeds within 2 % count as
        one. Empty without `rpm`.
    recorded_ : ndarray of int of shape (n_speeds or 1, n_classes)
        1 where `fit` had windows of a condition at a speed, otherwise 0.
    axes_ : ndarray of shape (n_groups * n_frequencies, n_coefficients)
        The matrix A from log spectra, group after group, to coordinates in which D is
        the identity and :math:`S_w` is diagonal. It removes the gain of each group.
    variances_ : ndarray of shape (n_coefficients,)
        The diagonal of :math:`S_w` in these coordinates.
    references_ : ndarray of shape (n_speeds or 1, n_classes, n_coefficients)
        Means of the conditions in these coordinates. At a speed without a recording of
        a condition, they are interpolated.
    n_features_in_ : int
        Number of groups, or of frequencies if X has two axes.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    LogSpectra : Computes groups of log spectra.
    ExtendedStatePIObserver : Computes them by observers, and compares them with it.
    ThresholdLadder : Decides by the smallest residual.

    References
    ----------
    R. J. Martin (2000), "A metric for ARMA processes", IEEE Transactions on Signal
    Processing 48(4), 1164-1170.

    Examples
    --------
    Log spectra of any origin can be compared. Here two conditions differ by a ripple.
    The test windows have a tilt, which no training window had:

    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> frequency = np.linspace(0, 1, 32)
    >>> y = np.repeat(["even", "rippled"], 20)
    >>> ripple = 0.3 * np.sin(40 * frequency) * (y == "rippled")[:, np.newaxis]
    >>> X = ripple + 0.1 * rng.normal(size=(40, 32))
    >>> distance = SpectralDistance().fit(X, y)
    >>> distance.transform(X + 0.5 * frequency).argmin(axis=1)[[0, 19, 20, 39]]
    array([0, 0, 1, 1])
    """

    smooth_drift: float = drift.SMOOTH
    rough_drift: float = drift.ROUGH
    frequency_drift: float = 0.06

    _suffix = "distance"
    _learns_in_batches = True

    @one_thread
    def _learn(self, X, target, weights, rpm):
        log_speed = np.zeros(len(X)) if rpm is None else log_speeds(rpm, len(X))
        train_log_speed, at = speed_references.group_speeds(log_speed)
        table = len(train_log_speed), len(self.classes_)
        group = np.ravel_multi_index((at, target), table)
        weight, spectra, scatter = _moments(X, group, math.prod(table), weights)
        means = _coefficients(spectra).reshape(*table, -1)
        recorded = weight.reshape(table) > 0
        spectra = spectra.reshape(*table, *X.shape[1:])
        of_class = np.einsum("sc,scgf->cgf", weight.reshape(table), spectra)
        of_class /= weight.reshape(table).sum(axis=0)[:, np.newaxis, np.newaxis]
        moved = drift.scaled_frequency(of_class.reshape(-1, X.shape[-1]))
        moved = _coefficients(moved.reshape(-1, *X.shape[1:]))
        change = np.diag(self._smooth_variance(self.rough_drift))
        change += self.frequency_drift * moved.T @ moved / len(moved)
        learned = speed_references.drift_learned(train_log_speed, means, recorded)
        if len(learned) > 0:
            change += learned.T @ learned / len(learned)
        axes, variances = drift.joint_axes(scatter, change)
        n_bands = X.shape[1] * X.shape[2]
        to_coefficients = _coefficients(np.eye(n_bands).reshape(-1, *X.shape[1:]))
        self.recorded_: NDArray[Any] = recorded.astype(np.intp)
        self.axes_: NDArray[Any] = to_coefficients @ axes
        self.variances_: NDArray[Any] = variances
        references = speed_references.filled_references(
            train_log_speed, means, recorded
        )
        self.references_: NDArray[Any] = references @ axes

    @uses_fitted
    def adapt(self, X: ArrayLike, y: ArrayLike, rpm: ArrayLike | None = None) -> Self:
        r"""Move all references by the smooth drift of windows at a new speed.

        Healthy windows are often available at every speed. Their mean change m of the
        cosine coefficients has a smooth part, which all conditions share. Its most
        likely value is :math:`f C (S_w + f D)^{-1} m` with :math:`C =
        \mathrm{diag}(c\,n^{-2})`.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_groups, n_frequencies) or (n_windows, n_frequencies)
            Log spectra at the new speed.
        y : array-like of shape (n_windows,)
            Their conditions, among `classes_`. Usually all windows are healthy.
        rpm : float, array-like of shape (n_windows,) or (n_windows, n_samples), default=None
            The new speed, as in `fit`. Without it, f is 1, and the references are those
            of the mean training speed.

        Returns
        -------
        SpectralDistance
            This transformer, for use at the new speed. Another call starts from these
            references.

        Raises
        ------
        ValueError
            If a condition was not in `fit`, or as in `transform`.
        """
        X, y = self._validate(X, y)
        expected = f"conditions of fit, {self.classes_.tolist()}"
        expect(np.isin(y, self.classes_), "y", np.unique(y).tolist(), expected)
        self._check_rpm_is_taken(rpm)
        speeds = log_speeds(rpm, len(X))
        factor = 1.0
        if speeds is None:
            speeds = np.full(len(X), self._known_log_speeds().mean())
        else:
            factor = self._drift_factor(speeds)
        target = np.searchsorted(self.classes_, y)
        change = drift.along_axes(_flat(X), self.axes_)
        change -= self._references_at(speeds)[np.arange(len(X)), target]
        share = np.mean(change * factor / (self.variances_ + factor), axis=0)
        # Cosines of one group are orthogonal, and their squares sum to 2 / n_frequencies.
        axes = _coefficients(self.axes_.T.reshape(-1, *X.shape[1:])).T
        axes *= X.shape[-1] / 2
        smooth_part = self._smooth_variance(0.0) * (axes @ share)
        self.references_ = self.references_ + smooth_part @ axes
        return self

    @one_thread
    def _residuals(self, X, rpm):
        if rpm is None:
            known = self.references_
            expected = np.concatenate([known, (known[1:] + known[:-1]) / 2])
            variances = np.tile(self.variances_ + 1.0, (len(expected), 1))
            places = np.indices((len(expected), len(X)))[0]
        else:
            speeds, place = np.unique(log_speeds(rpm, len(X)), return_inverse=True)
            expected = self._references_at(speeds)
            variances = self.variances_ + self._drift_factor(speeds)
            places = place[np.newaxis]
        squared = drift.squared_distances(
            _flat(X), self.axes_, expected, 1 / variances, places
        )
        return np.sqrt(squared.min(axis=0) + _LEAST)

    def _references_at(self, log_speed):
        at = speed_references.speed_distance(log_speed, self._known_log_speeds())
        return at.interpolate(self.references_)

    def _drift_factor(self, log_speed):
        variance = speed_references.drift_variance(
            log_speed, self._known_log_speeds(), self.recorded_ > 0
        )
        return speed_references.drift_factor(variance)[:, np.newaxis]

    def _known_log_speeds(self):
        return np.log(self.speeds_) if len(self.speeds_) > 0 else np.zeros(1)

    def _smooth_variance(self, rough):
        of_group = drift.smooth_variance(
            int(self.window_shape_[-1]) - 1, self.smooth_drift, rough
        )
        return np.tile(of_group, self._n_channels)

    def _validate(self, X, y=None, *, reset=False):
        X, y = validate_signals(self, X, y, reset=reset)
        if isinstance(X, RowsInBatches):
            return X, y
        largest = np.abs(X).max()
        expected = "natural logarithms of power"
        expect(largest <= _LARGEST, "Largest size in X", largest, expected)
        return X.reshape(len(X), -1, X.shape[-1]), y

    def _check_parameters(self):
        check_real(self.rough_drift, "rough_drift", **ABOVE_0)
        check_real(self.smooth_drift, "smooth_drift", min_val=0)
        check_real(self.frequency_drift, "frequency_drift", min_val=0)

    def _check_fitted(self):
        super()._check_fitted()
        n_frequencies = int(self.window_shape_[-1])
        n_coefficients = self._n_channels * (n_frequencies - 1)
        recorded_shape = (max(len(self.speeds_), 1), len(self.classes_))
        self._check_array("recorded_", recorded_shape, kind=int)
        is_table = (
            np.isin(self.recorded_, (0, 1)).all() and self.recorded_.any(axis=0).all()
        )
        expected = "0 and 1, with a 1 for each condition"
        expect(is_table, "recorded_", self.recorded_, expected)
        axes_shape = (self._n_channels * n_frequencies, n_coefficients)
        self._check_array("axes_", axes_shape, SQUARABLE)
        self._check_array("variances_", (n_coefficients,), "at least 0")
        self._check_array("references_", (*recorded_shape, n_coefficients), SQUARABLE)


def _moments(X, group, n_groups, weights):
    """Return weight and mean spectra of each group, and the scatter of coefficients about them.

    The spectra are read once, batch by batch. Sums of products are taken about the mean
    of the first batch, so that they lose no digits to a common mean.
    """
    n_coefficients = X.shape[1] * (X.shape[2] - 1)
    scatter = np.zeros((n_coefficients, n_coefficients))
    sums = np.zeros((n_groups, *X.shape[1:]))
    centre = None
    for batch in batches_of(X):
        rows = np.asarray(X[batch], dtype=np.float64)
        if centre is None:
            centre = rows.mean(axis=0)
        rows = rows - centre
        is_of_group = group[batch] == np.arange(n_groups)[:, np.newaxis]
        sums += np.tensordot(is_of_group * weights[batch], rows, axes=1)
        # A covariance holds squares, so a weight counts by its root.
        coefficients = _coefficients(rows) * np.sqrt(weights[batch])[:, np.newaxis]
        scatter += coefficients.T @ coefficients
    weight = np.bincount(group, weights, n_groups)
    means = sums / np.where(weight > 0, weight, 1.0)[:, np.newaxis, np.newaxis]
    of_means = _coefficients(means) * np.sqrt(weight)[:, np.newaxis]
    scatter -= of_means.T @ of_means
    means[weight > 0] += centre
    return weight, means, scatter / weights.sum()


def _flat(spectra):
    """Return log spectra with their groups one after the other, for compiled code."""
    return np.ascontiguousarray(spectra.reshape(len(spectra), -1), dtype=np.float64)


def _coefficients(spectra):
    """Return the cosine coefficients of all groups, one after the other."""
    of_groups = cepstrum(spectra.astype(np.float64, copy=False))
    return of_groups.reshape(len(spectra), -1)
