"""Base class of observers: fitting, residuals and trajectories."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils import Bunch

from ..core.base import SignalEstimator
from ..core.batches import RowsInBatches
from ..core.parallel import BATCH, map_batches
from ..core.state import expect, uses_fitted
from ..core.validation import (
    UP_TO_1,
    WITHIN_1,
    check_count,
    check_input_names,
    check_real,
    validate_innovations,
    weighted_windows,
)
from ..distances.comparison import SpectralDistance
from ..kernels import observer, residual_levels
from ..kernels.observer_bank import bank_levels, member_gains

#: Residuals of a single observer.
EVALUATIONS = ["power", "switching_gain"]
#: Constants of the comparison of a bank.
_DRIFT = {"smooth_drift": 0.1, "rough_drift": 0.005}
#: Bounds of the nonlinearity that are tried in turn, as shares of the range in which a
#: constant gain leaves the loop stable.
_SHARES = 0.5 ** np.arange(1, 5)


@dataclass(kw_only=True, eq=False, repr=False)
class Observer(SignalEstimator, TransformerMixin, BaseEstimator):
    """Transformer from innovations to residuals by recursions on the innovations.

    A subclass returns the largest bound of the nonlinearity in `_saturation`.
    """

    pole: float = 0.3
    kp: float = 0.1
    ki: float = 0.05
    n_observers: int = 1
    adaptation_step: float = 0.05
    evaluation: str = "power"
    sliding_slope: float = 10.0
    boundary_layer: float = 0.0
    n_jobs: int | None = None

    #: Metadata routing passes these without `set_fit_request` and
    #: `set_transform_request`.
    __metadata_request__fit: ClassVar = {"rpm": True, "sample_weight": True}
    __metadata_request__transform: ClassVar = {"rpm": True}
    _learns_in_batches = True

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Set the gains; a bank also learns its estimates of each condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations, or windows, which are the innovations of a model that predicts
            nothing.
        y : array-like of shape (n_windows,) or None, default=None
            Condition of each window. A bank needs it. A single observer names its
            residuals after it.
        rpm : float, array-like of shape (n_windows,) or (n_windows, n_samples), default=None
            Speed of each window in revolutions per minute, as in `SpectralDistance`.
            None: the speed is not known. A single observer ignores it.
        sample_weight : array-like of shape (n_windows,) or None, default=None
            How many windows each one stands for, at least 0. None: one each.

        Returns
        -------
        Observer
            The fitted transformer.

        Raises
        ------
        ValueError
            If a parameter is out of its range, the observer is unstable, or X has
            neither one model nor one for each condition.
        """
        self._fit(X, y, rpm, sample_weight)
        return self

    def fit_transform(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> NDArray[Any]:
        """Fit, and compute the residuals of the same windows.

        Parameters
        ----------
        X, y, rpm, sample_weight : array-like
            As in `fit`.

        Returns
        -------
        ndarray of shape (n_windows, n_classes) or (n_windows, n_models)
            As `transform` returns them.
        """
        fitted = copy.copy(self)
        measured = fitted._fit(X, y, rpm, sample_weight)
        vars(self).update(vars(fitted))
        return self._residuals(measured, rpm)

    def _fit(self, X, y, rpm, sample_weight):
        """Fit, and return what the observers measure of each window."""
        self._check_parameters()
        X, y = validate_innovations(self, X, y, reset=True)
        self._begin(y, sample_weight)
        measured = np.asarray(RowsInBatches(X, self._measure))
        self.distance_: SpectralDistance | None = None
        if self._is_bank():
            distance = SpectralDistance(**_DRIFT).set_output(transform="default")
            self.distance_ = distance.fit(
                measured, y, rpm=rpm, sample_weight=sample_weight
            )
        return measured

    def _begin(self, y, sample_weight):
        """Check the number of models, and set the gains."""
        self.classes_: NDArray[Any] = np.arange(max(self.n_models_, 1))
        if y is not None:
            conditions = np.unique(weighted_windows(y, y, sample_weight)[1])
            fits = self.n_models_ in (0, 1, len(conditions))
            expected = (
                f"1 or {len(conditions)}, one for each condition in y. If axis 1 of X holds "
                "channels, put ARXLaguerre before the observer"
            )
            expect(fits, "Number of models in X", self.n_models_, expected)
            if self._is_bank() or len(conditions) == len(self.classes_):
                self.classes_ = conditions
        radius = self._radius()
        if not radius < 1:
            raise ValueError(
                f"The observer is unstable: with pole={self.pole}, kp={self.kp} and "
                f"ki={self.ki}, its spectral radius is {radius:.6g}. Reduce ki or kp, so that "
                "pole - kp + ki < 1 and 2 (1 + pole - kp) + ki > 0."
            )
        kp, ki, bounds = self._gains()
        self.kp_: NDArray[Any] = kp
        self.ki_: NDArray[Any] = ki
        self.bounds_: NDArray[Any] = bounds

    def _radius(self):
        return observer.spectral_radius(self.pole, self.kp, self.ki)

    def _gains(self):
        """Return the gains and bounds of all observers that the parameters give."""
        kp, ki = np.array([[float(self.kp)], [float(self.ki)]])
        if self._is_bank():
            kp, ki = member_gains(self.pole, self.n_observers, self._radius())
        bounds = np.zeros(len(kp))
        if self._saturation() > 0:
            stable = (1 - (self.pole - kp)) / ki - 1
            tried = np.minimum(self._saturation(), np.outer(_SHARES, stable))
            is_met = observer.meets_circle_criterion(self.pole, kp, ki, tried)
            bounds = np.max(tried * is_met, axis=0)
        return kp, ki, bounds

    def _measure(self, innovations):
        """Return groups of log spectra of each window, or the level of each model."""
        measure, together = self._levels, max(BATCH // innovations.shape[1], 1)
        if self._is_bank():
            measure, together = self._groups, BATCH
        # The trajectories of so few windows stay in the processor's caches.
        parts = map_batches(
            lambda batch: measure(innovations[batch]),
            len(innovations),
            self.n_jobs,
            together,
        )
        return np.concatenate(parts).astype(innovations.dtype, copy=False)

    def _levels(self, innovations):
        rows = np.require(innovations, dtype=np.float64, requirements=["C", "W"])
        if self.evaluation == "power":
            return observer.power_levels(rows, self._loop())
        error, _ = observer.observe(rows, self._loop())
        surface = residual_levels.sliding_surface(error, self.sliding_slope)
        surface = surface.reshape(-1, surface.shape[-1])
        gain = residual_levels.switching_gain(surface, self.adaptation_step)
        return residual_levels.settled_level(gain).reshape(error.shape[:2])

    def _groups(self, innovations):
        mean = np.mean(innovations, axis=1, dtype=np.float64)
        gains = self.kp_, self.ki_, self.bounds_, float(self.adaptation_step)
        power, gain = bank_levels(mean, float(self.pole), *gains)
        return np.stack([power, gain, gain - power], axis=1)

    @uses_fitted
    def transform(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute one residual for each window and condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.
        rpm : float, array-like of shape (n_windows,) or (n_windows, n_samples), default=None
            Speed of each window in revolutions per minute, as in `SpectralDistance`. A
            single observer ignores it.

        Returns
        -------
        ndarray of shape (n_windows, n_classes) or (n_windows, n_models)
            Distance from each condition; of a single observer, the level of each model.
        """
        innovations, _ = validate_innovations(self, X, reset=False)
        return self._residuals(self._measure(innovations), rpm)

    def _residuals(self, measured, rpm):
        if self.distance_ is None:
            return measured
        return self.distance_.transform(measured, rpm=rpm)

    @uses_fitted
    def observe(self, X: ArrayLike) -> Bunch:
        r"""Compute the trajectories of the observers.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        Bunch
            Arrays of the unit of X and, of a single observer, of its shape; of a bank,
            of shape (n_windows, n_observers, n_samples): ``error`` e,
            ``fault_estimate`` before each sample, ``sliding_surface`` S,
            ``switching_gain`` K_s, and ``residual``, :math:`r = K_s\,\mathrm{sgn}(S)`
            or, with a boundary layer, :math:`r = K_s\,\mathrm{sat}(S / (\phi K_s))`.
            The surface of a single observer is :math:`S = \lambda e + (e(k) -
            e(k-1))`. That of an observer in a bank is its fault estimate.
        """
        innovations, _ = validate_innovations(self, X, reset=False)
        innovations = np.require(innovations, dtype=np.float64, requirements=["C", "W"])
        if self._is_bank():
            innovations = innovations.mean(axis=1, keepdims=True)
        loops = zip(self.kp_, self.ki_, self.bounds_, strict=True)
        paths = [
            observer.observe(innovations, (float(self.pole), *map(float, loop)))
            for loop in loops
        ]
        error, fault_estimate = np.concatenate(paths, axis=2)
        surface = fault_estimate
        if not self._is_bank():
            surface = residual_levels.sliding_surface(error, self.sliding_slope)
        sizes = surface.reshape(-1, surface.shape[-1])
        gain = residual_levels.switching_gain(sizes, self.adaptation_step)
        gain = gain.reshape(surface.shape)
        layer = self.boundary_layer * gain
        saturated = np.divide(surface, layer, out=np.sign(surface), where=layer > 0)
        trajectories = {
            "error": error,
            "fault_estimate": fault_estimate,
            "sliding_surface": surface,
            "switching_gain": gain,
            "residual": gain * np.clip(saturated, -1, 1),
        }
        shape = error.shape if self._is_bank() else np.shape(X)
        return Bunch(
            **{name: path.reshape(shape) for name, path in trajectories.items()}
        )

    @uses_fitted
    def get_feature_names_out(
        self, input_features: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Return the names of the residuals, which are those of the conditions.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Must be the names that `fit` saw; residuals are not named after them.

        Returns
        -------
        ndarray of str
            One name for each column of the output of `transform`: the condition or, if
            `fit` was not given as many conditions as there are models, the number of
            the model.
        """
        check_input_names(self, input_features)
        return self.classes_.astype(str).astype(object)

    def _is_bank(self):
        return self.n_observers > 1

    def _saturation(self):
        return 0.0

    def _loop(self):
        """Return the parameters of the loop of a single observer."""
        gains = self.kp_[0], self.ki_[0], self.bounds_[0]
        return float(self.pole), *map(float, gains)

    def _capabilities(self):
        if self.distance_ is None:
            return {"takes_rpm": False}
        return self.distance_._capabilities()

    def _check_parameters(self):
        check_real(self.pole, "pole", **WITHIN_1)
        check_real(self.kp, "kp")
        check_real(self.ki, "ki", min_val=0)
        check_count(self.n_observers, "n_observers")
        check_real(self.adaptation_step, "adaptation_step", **UP_TO_1)
        is_name = str(self.evaluation) in EVALUATIONS
        expect(is_name, "evaluation", self.evaluation, f"one of {EVALUATIONS}")
        check_real(self.sliding_slope, "sliding_slope", min_val=0)
        check_real(self.boundary_layer, "boundary_layer", min_val=0)

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        self._check_classes()
        n_residuals = max(self.n_models_, 1)
        fits = self._is_bank() or len(self.classes_) == n_residuals
        expect(fits, "classes_", self.classes_, f"{n_residuals}, one for each model")
        names = ("kp_", "ki_", "bounds_")
        for name, given in zip(names, self._gains(), strict=True):
            self._check_array(name, (None,))
            kept = getattr(self, name)
            is_current = kept.shape == given.shape and np.allclose(
                kept, given, rtol=1e-6
            )
            self._check_is_current(name, is_current)
        self._check_is_current(
            "distance_", (self.distance_ is None) == (not self._is_bank())
        )
        if self._is_bank():
            self._check_part("distance_")

    def _check_is_current(self, name, holds):
        if not holds:
            raise ValueError(
                f"{name} of {type(self).__name__} is not what the parameters give: "
                "parameters changed since fit: call fit."
            )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = self.n_observers != 1
        return tags
