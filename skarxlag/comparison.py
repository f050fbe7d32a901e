"""Comparison of log spectra with those of each condition, across speeds."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin

from ._base import DocumentedEstimator
from ._parallel import one_thread
from ._validation import (
    MODERATE,
    WINDOWS,
    CheckedEstimator,
    Labels,
    Values,
    as_fitted,
    check_input_names,
    check_real,
    check_value,
    remember_parameters,
    uses_fitted,
    validate_signals,
    weighted_windows,
)
from .kernels.drift import scaled_frequency, smooth_variance, whitened
from .kernels.group_means import group_means
from .kernels.spectra import cepstrum

#: No power of double precision has a larger logarithm: a value above it is no logarithm.
_LARGEST = 1e4
#: Added to squared distances: a group that is the same everywhere, as the steadiness of windows of
#: one segment, must not make the product 0 for all conditions.
_LEAST = 1e-12


class SpectralDistance(CheckedEstimator, DocumentedEstimator, TransformerMixin, BaseEstimator):
    r"""Distance of log spectra from those of each condition, with a change of speed discounted.

    A window comes as one or several groups of log spectra over frequency. Each group g is reduced
    to its cosine coefficients :math:`d_g` without the first, the gain. Its distance from condition
    c is the root of

    .. math::

        r_{gc}^2 = \tfrac{1}{\dim d_g}\,(d_g - \bar d_{gc})^T (S_w + S_v + S_s)^{-1}
        (d_g - \bar d_{gc}),

    with :math:`\bar d_{gc}` the mean over the training windows of c, and :math:`S_w` the covariance
    of all training windows about the means of their conditions. The rest is what a change of speed
    may do to the spectra of all conditions: :math:`S_v = \mathrm{diag}(c\,n^{-2} + f)` is drift
    that is smooth over frequency, and drift of any other kind; :math:`S_s` is the change of the
    conditions' mean spectra when the frequency axis is scaled by :math:`e^{\pm 0.1}`, as for all
    that follows the shaft.

    The residual of condition c is the geometric mean over G groups, together with the distance
    :math:`r_c` of several groups joined to one vector, whose covariance also holds how they scatter
    together:

    .. math::

        \rho_c = \Big(\prod_g r_{gc}\Big)^{(1 - w) / G} \; r_c^{\,w} .

    The product is what Student's t distribution with few degrees of freedom makes of groups that
    speed moves by an amount that is not known: one group that speed has moved far does not outvote
    the others, as it would in a sum of squares.

    Parameters
    ----------
    joint_weight : float, default=0.0
        The weight w of the joint distance, in [0, 1]. At 0 there is only the product of the groups,
        at 1 only the joint distance.
    joint_groups : sequence of int or None, default=None
        The groups in the joint distance, by their places along axis 1 of X, each once. None: all.
    smooth_drift : float, default=0.1
        The constant c in squared nepers of power, at least 0. The log spectrum of one bearing
        drifts by this much when its speed changes by 3 to 30 %.
    rough_drift : float, default=0.01
        The constant f in squared nepers of power, above 0.
    frequency_drift : float, default=0.1
        Weight of :math:`S_s`, at least 0.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    whiteners_ : ndarray of shape (n_groups, n_coefficients, n_coefficients)
        For each group, lower triangular W with W W' the inverse of the covariance.
    references_ : ndarray of shape (n_classes, n_groups, n_coefficients)
        Means of the conditions times the whitener of their group.
    joint_whitener_ : ndarray of shape (n_all_coefficients, n_all_coefficients)
        The same for the joined groups; only where `joint_weight` is above 0.
    joint_references_ : ndarray of shape (n_classes, n_all_coefficients)
        The same for the joined groups; only where `joint_weight` is above 0.
    n_features_in_ : int
        Number of groups, or of frequencies where X has two axes.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    LogSpectra : Gives groups of log spectra.
    ExtendedStatePIObserverBank : Gives them by observers.
    ThresholdLadder : Decides by the smallest residual.

    References
    ----------
    R. J. Martin (2000), "A metric for ARMA processes", IEEE Transactions on Signal Processing
    48(4), 1164-1170.

    Examples
    --------
    Log spectra of any origin can be compared. Here two conditions differ by a ripple, and the
    windows to be told apart have a tilt, which no training window had:

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

    classes_: NDArray[Any]
    whiteners_: NDArray[Any]
    references_: NDArray[Any]
    joint_whitener_: NDArray[Any]
    joint_references_: NDArray[Any]

    #: Metadata routing hands weights over without a call of `set_fit_request`.
    __metadata_request__fit: ClassVar = {"sample_weight": True}

    _state = WINDOWS | {
        "classes_": Labels(),
        "whiteners_": Values(lambda e: (e._n_groups(), *2 * [e.window_shape_[-1] - 1]), MODERATE),
        "references_": Values(
            lambda e: (len(e.classes_), e._n_groups(), e.window_shape_[-1] - 1), MODERATE
        ),
    }

    def __init__(
        self,
        *,
        joint_weight: float = 0.0,
        joint_groups: Sequence[int] | None = None,
        smooth_drift: float = 0.1,
        rough_drift: float = 0.01,
        frequency_drift: float = 0.1,
    ) -> None:
        self.joint_weight = joint_weight
        self.joint_groups = joint_groups
        self.smooth_drift = smooth_drift
        self.rough_drift = rough_drift
        self.frequency_drift = frequency_drift

    def fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> Self:
        """Calibrate references and covariances.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_groups, n_frequencies) or (n_windows, n_frequencies)
            Log spectra, natural logarithms of power at the midpoints of equal cells.
        y : array-like of shape (n_windows,)
            Condition of each window.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            How many windows each one stands for, at least 0: its weight in means and covariances.
            None: one each.

        Returns
        -------
        SpectralDistance
            The fitted transformer.

        Raises
        ------
        ValueError
            If a parameter is out of its range, or a weight is negative.
        """
        self._calibrate(X, y, sample_weight)
        return self

    def fit_transform(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Calibrate, and give the residuals of the same windows.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_groups, n_frequencies) or (n_windows, n_frequencies)
            As in `fit`.
        y : array-like of shape (n_windows,)
            Condition of each window.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            As in `fit`. Windows of weight 0 get residuals, too.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            What `transform` gives.
        """
        X, cepstra = self._calibrate(X, y, sample_weight)
        return self._residuals(cepstra).astype(X.dtype, copy=False)

    @one_thread
    def _calibrate(self, X, y, sample_weight):
        X, y = self._validate(X, y, reset=True)
        self._check_parameters()
        self._check_groups()
        rows, y, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        self.classes_, target = np.unique(y, return_inverse=True)
        means = group_means(X[rows].astype(np.float64, copy=False), target, weights)
        cepstra, centres, moved = _cepstra(X), _cepstra(means), _cepstra(_moved(means))
        # A covariance holds squares, so a weight counts by its root.
        scatter = (cepstra[rows] - centres[target]) * np.sqrt(weights)[:, np.newaxis, np.newaxis]
        total = weights.sum()
        calibrated = [
            self._calibrate_part(scatter[:, [g]], centres[:, [g]], moved[:, [g]], total)
            for g in range(X.shape[1])
        ]
        self.whiteners_ = np.stack([whitener for whitener, _ in calibrated])
        self.references_ = np.stack([references for _, references in calibrated], axis=1)
        if self._is_joint():
            chosen = self._joint_groups()
            self.joint_whitener_, self.joint_references_ = self._calibrate_part(
                scatter[:, chosen], centres[:, chosen], moved[:, chosen], total
            )
        remember_parameters(self)
        return X, cepstra

    def _calibrate_part(self, scatter, centres, moved, total):
        """Whitener and whitened references of the groups that are given, as one vector."""
        n_groups = scatter.shape[1]
        scatter, centres, moved = (_joined(a) for a in (scatter, centres, moved))
        covariance = scatter.T @ scatter / total
        covariance += np.diag(self._smooth_variance(n_groups, self.rough_drift))
        covariance += self.frequency_drift * moved.T @ moved / len(moved)
        whitener = np.linalg.cholesky(np.linalg.inv(covariance))
        return whitener, whitened(centres, whitener)

    def adapt(self, X: ArrayLike, y: ArrayLike) -> Self:
        r"""Move all references by the smooth drift that windows at a new speed show.

        Healthy windows, which a user often has at every speed, tell by how much their own cosine
        coefficients have moved, m. All conditions share the smooth part of that, which is most
        likely :math:`C (S_w + S_v + S_s)^{-1} m` with :math:`C = \mathrm{diag}(c\,n^{-2})`.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_groups, n_frequencies) or (n_windows, n_frequencies)
            Log spectra at the new speed.
        y : array-like of shape (n_windows,)
            Their conditions, among `classes_`; commonly all healthy.

        Returns
        -------
        SpectralDistance
            This transformer, for use at the new speed. Adapting again starts from where it is.

        Raises
        ------
        ValueError
            If a condition was not in `fit`.
        """
        vars(self).update(as_fitted(self)._moved_references(X, y))
        return self

    def _moved_references(self, X, y):
        X, y = self._validate(X, y, reset=False)
        unknown = np.setdiff1d(y, self.classes_)
        if len(unknown) > 0:
            raise ValueError(
                f"y has conditions that were not in fit: {unknown.tolist()}, expected among "
                f"{self.classes_.tolist()}."
            )
        target, cepstra = np.searchsorted(self.classes_, y), _cepstra(X)
        references = [
            self._adapted(cepstra[:, [g]], target, W, self.references_[:, g])
            for g, W in enumerate(self.whiteners_)
        ]
        moved = {"references_": np.stack(references, axis=1)}
        if self._is_joint():
            moved["joint_references_"] = self._adapted(
                cepstra[:, self._joint_groups()],
                target,
                self.joint_whitener_,
                self.joint_references_,
            )
        return moved

    @one_thread
    def _adapted(self, cepstra, target, whitener, references):
        rows = whitened(_joined(cepstra), whitener)
        moved = np.mean(rows - references[target], axis=0)
        smooth = self._smooth_variance(cepstra.shape[1], 0.0)
        return references + whitener.T @ (smooth * (whitener @ moved))

    @uses_fitted
    def transform(self, X: ArrayLike) -> NDArray[Any]:
        """One residual for each window and condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_groups, n_frequencies) or (n_windows, n_frequencies)
            Log spectra.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            Residuals: 1 is usual for windows of the condition at the training speed.
        """
        X, _ = self._validate(X, reset=False)
        return self._residuals(_cepstra(X)).astype(X.dtype, copy=False)

    @one_thread
    def _residuals(self, cepstra):
        n_groups = cepstra.shape[1]
        joint = self.joint_weight if self._is_joint() else 0.0
        residuals = 1.0
        for g in range(n_groups):
            squared = _squared_distances(cepstra[:, g], self.whiteners_[g], self.references_[:, g])
            residuals = residuals * squared ** ((1 - joint) / (2 * n_groups))
        if joint > 0:
            squared = _squared_distances(
                _joined(cepstra[:, self._joint_groups()]),
                self.joint_whitener_,
                self.joint_references_,
            )
            residuals = residuals * squared ** (joint / 2)
        return residuals

    def _joint_groups(self):
        n_groups = int(self.window_shape_[0])
        return list(range(n_groups)) if self.joint_groups is None else list(self.joint_groups)

    def _is_joint(self):
        return self.joint_weight > 0 and len(self.window_shape_) == 2 and self.window_shape_[0] > 1

    def _smooth_variance(self, n_groups, rough):
        of_group = smooth_variance(int(self.window_shape_[-1]) - 1, self.smooth_drift, rough)
        return np.tile(of_group, n_groups)

    @uses_fitted
    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[Any]:
        """Names of the residuals: their conditions.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Checked against what the transformer was fitted on; residuals are not named after it.

        Returns
        -------
        ndarray of str of shape (n_classes,)
            One name a column of what `transform` returns.
        """
        check_input_names(self, input_features)
        return np.array([f"{name}_distance" for name in self.classes_], dtype=object)

    def _validate(self, X, y=None, *, reset):
        expected = "(n_windows, n_groups, n_frequencies) or (n_windows, n_frequencies)"
        X, y = validate_signals(
            self, X, y, reset=reset, expected=f"log spectra of shape {expected}"
        )
        largest = np.max(np.abs(X))
        if largest > _LARGEST:
            raise ValueError(
                f"X has values up to {largest:.3g}, expected natural logarithms of power."
            )
        return X.reshape(len(X), -1, X.shape[-1]), y

    def _check_parameters(self):
        check_real(self.joint_weight, "joint_weight", min_val=0, max_val=1)
        check_real(self.rough_drift, "rough_drift", min_val=0, include_boundaries="neither")
        for name in ("smooth_drift", "frequency_drift"):
            check_real(getattr(self, name), name, min_val=0)
        chosen = [0] if self.joint_groups is None else list(self.joint_groups)
        are_indices = all(isinstance(g, Integral) and g >= 0 for g in chosen)
        if not chosen or len(set(chosen)) < len(chosen) or not are_indices:
            raise ValueError(
                f"joint_groups == {self.joint_groups!r}, expected different integers of at least 0."
            )

    def _n_groups(self):
        return int(self.window_shape_[0]) if len(self.window_shape_) == 2 else 1

    def _check_relations(self):
        self._check_groups()
        if self._is_joint():
            n = len(self._joint_groups()) * (int(self.window_shape_[-1]) - 1)
            shapes = {"joint_whitener_": (n, n), "joint_references_": (len(self.classes_), n)}
            for name, shape in shapes.items():
                check_value(self, name, vars(self).get(name), Values(shape, MODERATE))

    def _check_groups(self):
        n_groups = self._n_groups()
        if self.joint_groups is not None and max(self.joint_groups) >= n_groups:
            raise ValueError(
                f"joint_groups == {self.joint_groups!r}, expected different integers from 0 to "
                f"{n_groups - 1}."
            )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        tags.input_tags.three_d_array = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags


def _moved(means):
    """Changes of mean log spectra when the frequency axis is scaled, for each group."""
    return np.stack([scaled_frequency(of_group) for of_group in means.swapaxes(0, 1)], axis=1)


def _cepstra(log_spectra):
    """Cosine coefficients, without the first, of shape (n_rows, n_groups, n_coefficients)."""
    rows = np.asarray(log_spectra, dtype=np.float64).reshape(-1, log_spectra.shape[-1])
    return cepstrum(rows).reshape(*log_spectra.shape[:2], -1)


def _joined(cepstra):
    return cepstra.reshape(len(cepstra), -1)


def _squared_distances(cepstra, whitener, references):
    rows = whitened(cepstra, whitener)
    n_coefficients = max(rows.shape[1], 1)
    squared = np.sum((rows[:, np.newaxis] - references) ** 2, axis=-1) / n_coefficients
    return squared + _LEAST
