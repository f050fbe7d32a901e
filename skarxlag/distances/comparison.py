"""Comparison of log spectra with those of each condition, across speeds."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.base import StretchTransformer
from ..core.parallel import one_thread
from ..core.speeds import log_speeds
from ..core.state import SQUARABLE, expect, uses_fitted
from ..core.validation import ABOVE_0, check_real, validate_signals
from ..kernels import drift, speed_references
from ..kernels.spectra import cepstrum

#: Logarithms of powers in double precision are smaller.
_LARGEST = 1e4
#: Added to squared distances, so that a constant group, such as the steadiness of
#: windows of one segment, does not make the product 0 for all conditions.
_LEAST = 1e-12


class _Comparison(NamedTuple):
    """Vectors of coefficients that are compared alike: of each group, or of joined groups.

    Parameters
    ----------
    groups : ndarray of int of shape (n_vectors, n_joined)
        Groups of each vector.
    axes : ndarray of shape (n_vectors, n_coefficients, n_coefficients)
        Fitted axes of each vector.
    variances : ndarray of shape (n_vectors, n_coefficients)
        Variances of training windows along the axes.
    references : ndarray of shape (n_speeds, n_classes, n_vectors, n_coefficients)
        Means of the conditions along the axes.
    weight : float
        Exponent of the distance of each vector in the product.
    """

    groups: NDArray[Any]
    axes: NDArray[Any]
    variances: NDArray[Any]
    references: NDArray[Any]
    weight: float

    def axes_of_spectra(self, n_frequencies: int) -> NDArray[Any]:
        """Return the axes times the cosines, which turn log spectra into coefficients."""
        cosines = _cosines(n_frequencies)
        n_vectors, n_joined = self.groups.shape
        n_axes = self.axes.shape[2]
        of_groups = self.axes.reshape(n_vectors, n_joined, cosines.shape[1], n_axes)
        shape = (n_vectors, n_joined * n_frequencies, n_axes)
        return (cosines @ of_groups).reshape(shape)

    def distances(
        self,
        X: NDArray[Any],
        speed_weights: NDArray[Any],
        drift_factor: NDArray[Any],
        places: NDArray[np.int_],
    ) -> NDArray[Any]:
        """Compute squared distances of log spectra from each condition at given speeds.

        Parameters
        ----------
        X : ndarray of shape (n_windows, n_groups, n_frequencies)
            Log spectra.
        speed_weights : ndarray of shape (n_speeds, n_training_speeds, n_classes)
            Weights of the references at each speed.
        drift_factor : ndarray of shape (n_speeds, 1, 1)
            Factor on the drift at each speed.
        places : ndarray of int of shape (n_tries, n_windows)
            Index of a speed, for each window and try.

        Returns
        -------
        ndarray of shape (n_tries, n_windows, n_classes, n_vectors)
            Squared distances.
        """
        # With rows of several layouts, the loop would be compiled for each.
        rows = np.ascontiguousarray(_joined(X, self.groups), dtype=np.float64)
        expected = np.einsum(
            "skc,kcgf->scgf", speed_weights, self.references, order="C"
        )
        precisions = 1 / (self.variances + drift_factor)
        axes = self.axes_of_spectra(X.shape[-1])
        return drift.squared_distances(rows, axes, expected, precisions, places)


@functools.lru_cache(maxsize=8)
def _cosines(n_frequencies):
    """Return the matrix from a log spectrum to its cosine coefficients."""
    return cepstrum(np.eye(n_frequencies))


@dataclass(kw_only=True, eq=False, repr=False)
class SpectralDistance(StretchTransformer):
    r"""Transformer from log spectra to distances from each condition that tolerate other speeds.

    A window comes as one or several groups of log spectra: natural logarithms of power
    at the midpoints of equal cells of frequency. Each group g is reduced to its cosine
    coefficients :math:`d_g` without the first, the gain. Its distance from condition c
    at speed q is the root of

    .. math::

        r_{gc}^2 = \tfrac{1}{\dim d_g}\,(d_g - \bar d_{gc}(q))^T (S_w + f(q)\,D)^{-1}
        (d_g - \bar d_{gc}(q)).

    The reference :math:`\bar d_{gc}(q)` is linear in :math:`\ln q` between the means of
    the training windows of c at two neighbouring training speeds, and constant outside.
    :math:`S_w` is the covariance of the training windows about the means of their
    condition and speed. D is the covariance of the changes that another speed may cause
    in the spectra of all conditions,

    .. math::

        D = \mathrm{diag}(c\,n^{-2} + f_0) + S_s + \overline{e e^T}.

    The first part is drift that is smooth over frequency, and drift of any other kind.
    :math:`S_s` is the change of the conditions' mean spectra if the frequency axis is
    scaled by :math:`e^{\pm 0.1}`, because some lines follow the shaft. With several
    training speeds, the other speeds predict each mean, and e is the error of this
    prediction divided by the root of f. The factor f(q) is the variance of a Brownian
    bridge between the training speeds. It is 1 at a distance of 0.4 in :math:`\ln q`
    outside of them, and at least 0.2.

    The residual of condition c combines the geometric mean over G groups with the
    distance :math:`r_c` of several groups that are joined to one vector. The covariance
    of this vector contains the correlation of the groups:

    .. math::

        \rho_c = \Big(\prod_g r_{gc}\Big)^{(1 - w) / G} \; r_c^{\,w} .

    The product follows from Student's t distribution with few degrees of freedom, if
    speed changes each group by an unknown amount. In a sum of squares, one group that
    speed has changed much would outweigh the others.

    Speeds come as the metadata `rpm` of scikit-learn's metadata routing, which this
    estimator requests. Without `rpm` in `fit`, there is one reference for each
    condition. Without `rpm` in `transform`, f is 1, and the residual is the smallest
    over the training speeds and the middles between them.

    Parameters
    ----------
    joint_weight : float, default=0.0
        The weight w of the joint distance, in [0, 1]. At 0 there is only the product of
        the groups, at 1 only the joint distance.
    joint_groups : sequence of int or None, default=None
        Indices along axis 1 of X of the groups in the joint distance, each once. None:
        all.
    smooth_drift : float, default=0.1
        The constant c in squared nepers of power, at least 0.
    rough_drift : float, default=0.01
        The constant :math:`f_0` in squared nepers of power, above 0.
    frequency_drift : float, default=0.1
        Weight of :math:`S_s`, at least 0.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    speeds_ : ndarray of shape (n_speeds,)
        Training speeds in revolutions per minute, ascending; speeds within 2 % count as
        one. Empty without `rpm`.
    recorded_ : ndarray of int of shape (n_speeds or 1, n_classes)
        1 where `fit` had windows of a condition at a speed, otherwise 0.
    axes_ : ndarray of shape (n_groups, n_coefficients, n_coefficients)
        For each group, the matrix V for which V' D V is the identity and V' S_w V is
        diagonal.
    variances_ : ndarray of shape (n_groups, n_coefficients)
        The diagonal of V' S_w V.
    references_ : ndarray of shape (n_speeds or 1, n_classes, n_groups, n_coefficients)
        Means of the conditions times the axes of their group; 0 without a recording.
    joint_axes_ : ndarray of shape (n_all_coefficients, n_all_coefficients)
        The same for the joined groups. It is empty if `joint_weight` is 0 or there is
        one group.
    joint_variances_ : ndarray of shape (n_all_coefficients,)
        The same for the joined groups.
    joint_references_ : ndarray of shape (n_speeds or 1, n_classes, n_all_coefficients)
        The same for the joined groups.
    n_features_in_ : int
        Number of groups, or of frequencies if X has two axes.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    LogSpectra : Computes groups of log spectra.
    ExtendedStatePIObserverBank : Computes them by observers.
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

    joint_weight: float = 0.0
    joint_groups: Sequence[int] | None = None
    smooth_drift: float = 0.1
    rough_drift: float = 0.01
    frequency_drift: float = 0.1

    _suffix = "distance"

    @one_thread
    def _learn(self, X, target, weights, rpm):
        self._check_relations()
        log_speed = np.zeros(len(X)) if rpm is None else log_speeds(rpm, len(X))
        train_log_speed, at = speed_references.group_speeds(log_speed)
        spectra = X.astype(np.float64, copy=False)
        cepstra = cepstrum(spectra)
        means, recorded = speed_references.mean_by_speed(cepstra, at, target, weights)
        self.recorded_: NDArray[Any] = recorded.astype(np.intp)
        # A covariance holds squares, so a weight counts by its root.
        root = np.sqrt(weights / weights.sum())[:, np.newaxis, np.newaxis]
        cepstra -= means[at, target]
        cepstra *= root
        of_class = speed_references.group_means(spectra, target, weights).reshape(
            -1, X.shape[-1]
        )
        moved = cepstrum(drift.scaled_frequency(of_class).reshape(-1, *X.shape[1:]))
        learned = speed_references.drift_learned(train_log_speed, means, recorded)
        *of_groups, of_joined = [
            self._calibrate(groups, cepstra, moved, learned, means)
            for groups in [*([g] for g in range(X.shape[1])), self._joined_groups()]
        ]
        axes, variances, references = map(np.stack, zip(*of_groups, strict=True))
        self.axes_: NDArray[Any] = axes
        self.variances_: NDArray[Any] = variances
        self.references_: NDArray[Any] = np.moveaxis(references, 0, 2)
        axes, variances, references = of_joined
        self.joint_axes_: NDArray[Any] = axes
        self.joint_variances_: NDArray[Any] = variances
        self.joint_references_: NDArray[Any] = references

    def _calibrate(self, chosen, scatter, moved, learned, means):
        """Return axes, variances and references of the chosen groups, joined to one vector."""
        scatter = _joined(scatter, chosen)
        moved = _joined(moved, chosen)
        learned = _joined(learned, chosen)
        change = np.diag(self._smooth_variance(len(chosen), self.rough_drift))
        change += self.frequency_drift * moved.T @ moved / len(moved)
        if len(learned) > 0:
            change += learned.T @ learned / len(learned)
        axes, variances = drift.joint_axes(scatter.T @ scatter, change)
        n_speeds, n_classes = means.shape[:2]
        centres = means[:, :, chosen].reshape(n_speeds * n_classes, len(axes))
        references = drift.along_axes(centres, axes)
        return axes, variances, references.reshape(n_speeds, n_classes, len(axes))

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
        if speeds is None:
            speeds = np.full(len(X), self._known_log_speeds().mean())
        target = np.searchsorted(self.classes_, y)
        weights, factor = self._at(speeds, rpm)
        weights = weights[np.arange(len(X)), :, target]
        cepstra = cepstrum(X.astype(np.float64))
        of_groups, of_joined = (
            self._shared_drift(part, cepstra, target, weights, factor)
            for part in self._comparisons()
        )
        self.references_ = self.references_ + of_groups
        self.joint_references_ = self.joint_references_ + of_joined[0]
        return self

    def _shared_drift(self, part, cepstra, target, weights, factor):
        """Return the most likely smooth drift along the axes, for each vector."""
        expected = np.einsum("wk,kwgf->wgf", weights, part.references[:, target])
        rows = drift.along_axes(_joined(cepstra, part.groups), part.axes) - expected
        share = np.mean(rows * (factor / (part.variances + factor)), axis=0)
        smooth = self._smooth_variance(part.groups.shape[1], 0.0)
        return np.einsum("gfa,f,gfb,gb->ga", part.axes, smooth, part.axes, share)

    @one_thread
    def _residuals(self, X, rpm):
        if rpm is None:
            speeds = speed_references.speeds_to_try(self._known_log_speeds())
            places = np.arange(len(speeds)).repeat(len(X)).reshape(-1, len(X))
        else:
            speeds, place = np.unique(log_speeds(rpm, len(X)), return_inverse=True)
            places = place[np.newaxis]
        weights, factor = self._at(speeds, rpm)
        product = 1.0
        for part in self._comparisons():
            squared = part.distances(X, weights, factor, places) + _LEAST
            product *= squared.prod(axis=-1) ** (part.weight / 2)
        return product.min(axis=0)

    def _at(self, log_speed, rpm):
        """Return weights of the references at speeds, and the factor on the drift of groups."""
        weights, variance = speed_references.reference_weights(
            log_speed, self._known_log_speeds(), self.recorded_ > 0
        )
        factor = np.ones(len(variance))
        if rpm is not None:
            factor = speed_references.drift_factor(variance)
        return weights, factor[:, np.newaxis, np.newaxis]

    def _comparisons(self):
        """Return how each group is compared by itself, and how the joined groups are."""
        joined = self._joined_groups()
        n_groups = len(self.axes_)
        joint_weight = self.joint_weight if joined else 0.0
        of_groups = _Comparison(
            groups=np.arange(n_groups)[:, np.newaxis],
            axes=self.axes_,
            variances=self.variances_,
            references=self.references_,
            weight=(1 - joint_weight) / n_groups,
        )
        of_joined = _Comparison(
            groups=np.array([joined], dtype=int),
            axes=self.joint_axes_[np.newaxis],
            variances=self.joint_variances_[np.newaxis],
            references=self.joint_references_[:, :, np.newaxis],
            weight=joint_weight,
        )
        return of_groups, of_joined

    def _joined_groups(self):
        """Return the groups in the joint distance, or none if there is no such distance."""
        n_groups = self._n_channels
        if self.joint_weight == 0 or n_groups == 1:
            return []
        return list(range(n_groups) if self.joint_groups is None else self.joint_groups)

    def _known_log_speeds(self):
        return np.log(self.speeds_) if len(self.speeds_) > 0 else np.zeros(1)

    def _smooth_variance(self, n_groups, rough):
        of_group = drift.smooth_variance(
            int(self.window_shape_[-1]) - 1, self.smooth_drift, rough
        )
        return np.tile(of_group, n_groups)

    def _validate(self, X, y=None, *, reset=False):
        X, y = validate_signals(self, X, y, reset=reset)
        largest = float(np.abs(X).max())
        expected = "natural logarithms of power"
        expect(largest <= _LARGEST, "Largest size in X", largest, expected)
        return X.reshape(len(X), -1, X.shape[-1]), y

    def _check_parameters(self):
        check_real(self.joint_weight, "joint_weight", min_val=0, max_val=1)
        check_real(self.rough_drift, "rough_drift", **ABOVE_0)
        check_real(self.smooth_drift, "smooth_drift", min_val=0)
        check_real(self.frequency_drift, "frequency_drift", min_val=0)
        groups = [0] if self.joint_groups is None else list(self.joint_groups)
        are_indices = all(isinstance(g, Integral) and g >= 0 for g in groups)
        are_different = len(groups) > 0 and len(set(groups)) == len(groups)
        expected = "different integers of at least 0"
        is_valid = are_indices and are_different
        expect(is_valid, "joint_groups", self.joint_groups, expected)

    def _check_fitted(self):
        super()._check_fitted()
        n_coefficients = int(self.window_shape_[-1]) - 1
        n_joined = len(self._joined_groups()) * n_coefficients
        recorded_shape = (max(len(self.speeds_), 1), len(self.classes_))
        self._check_array("recorded_", recorded_shape, kind=int)
        is_table = (
            np.isin(self.recorded_, (0, 1)).all() and self.recorded_.any(axis=0).all()
        )
        expected = "0 and 1, with a 1 for each condition"
        expect(is_table, "recorded_", self.recorded_, expected)
        shape = (self._n_channels, n_coefficients)
        self._check_array("variances_", shape, "at least 0")
        self._check_array("axes_", (*shape, n_coefficients), SQUARABLE)
        self._check_array("references_", (*recorded_shape, *shape), SQUARABLE)
        self._check_array("joint_variances_", (n_joined,), "at least 0")
        self._check_array("joint_axes_", (n_joined, n_joined), SQUARABLE)
        self._check_array("joint_references_", (*recorded_shape, n_joined), SQUARABLE)

    def _check_relations(self):
        groups = [0] if self.joint_groups is None else self.joint_groups
        expected = f"integers below {self._n_channels}, the number of groups in X"
        is_in_rows = max(groups) < self._n_channels
        expect(is_in_rows, "joint_groups", self.joint_groups, expected)


def _joined(rows, chosen):
    """Return chosen groups of rows, of which those along the last axis are joined."""
    taken = rows[:, chosen]
    return taken.reshape(*taken.shape[:-2], taken.shape[-2] * taken.shape[-1])
