"""What all observers share: validation, residual evaluation, trajectories."""

from __future__ import annotations

from numbers import Integral
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin, clone
from sklearn.utils import Bunch, check_scalar

from ._base import DocumentedEstimator
from ._parallel import map_batches
from ._validation import (
    INNOVATIONS,
    CheckedEstimator,
    Values,
    check_input_names,
    check_real,
    check_value,
    remember_parameters,
    uses_fitted,
    validate_innovations,
)
from .kernels import observer, residual_levels
from .kernels.scaling import root_mean_square
from .residual_evaluations import RESIDUAL_EVALUATIONS


class Observer(CheckedEstimator, DocumentedEstimator, TransformerMixin, BaseEstimator):
    """Innovations to residual levels, for any observer that is a recursion on them.

    A subclass certifies its gains in `_certify`, and names them in `_loop_constants` and
    `_small_signal_gains`.
    """

    _state = INNOVATIONS

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Certify that the observer is stable.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations, or windows, which are the innovations of a model that predicts nothing.
        y : ignored
            Here by convention.

        Returns
        -------
        estimator
            The fitted observer.

        Raises
        ------
        ValueError
            If a parameter is out of its range or the gains are unstable; the message has the
            numbers.
        """
        validate_innovations(self, X, reset=True)
        self._check_parameters()
        self._certify()
        remember_parameters(self)
        return self

    @uses_fitted
    def transform(self, X: ArrayLike) -> NDArray[Any]:
        """One residual level for each window and model.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        ndarray of shape (n_windows, n_models) or (n_windows, 2 * n_models)
            Residual levels; then, with ``fault_estimate=True``, the levels of the fault estimates.
        """
        innovations, _ = validate_innovations(self, X, reset=False)
        parts = map_batches(
            lambda batch: self._levels(innovations[batch]), len(innovations), self.n_jobs
        )
        return np.concatenate(parts).astype(innovations.dtype, copy=False)

    def _levels(self, innovations):
        innovations = np.require(innovations, dtype=np.float64, requirements=["C", "W"])
        loop = self._loop()
        levels = RESIDUAL_EVALUATIONS[self.evaluation].levels(innovations, loop, self)
        if self.fault_estimate:
            estimated = root_mean_square(observer.observe(innovations, loop)[1])
            levels = np.concatenate([levels, estimated], axis=1)
        return levels

    def _loop(self):
        return tuple(map(float, self._loop_constants()))

    @uses_fitted
    def small_signal_response(self, frequency: NDArray[Any]) -> NDArray[Any]:
        """Frequency response from small innovations to the output error.

        Parameters
        ----------
        frequency : ndarray
            In radians a sample.

        Returns
        -------
        ndarray of complex
            Shaped like `frequency`.
        """
        pole, kp, ki = self._small_signal_gains()
        z = np.exp(1j * frequency)
        if ki == 0:
            return (z - pole) / (z - pole + kp)
        return (z - pole) * (z - 1) / ((z - pole + kp) * (z - 1) + ki)

    @uses_fitted
    def observe(self, X: ArrayLike) -> Bunch:
        r"""Trajectories, for looking at them.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        Bunch
            Arrays shaped like X, in its unit: ``error`` e; ``fault_estimate``, the estimate before
            each sample; ``sliding_surface`` :math:`S = \lambda e + (e(k) - e(k-1))`;
            ``switching_gain`` K_s; ``residual``, :math:`r = K_s\,\mathrm{sgn}(S)` or, with a
            boundary layer, :math:`r = K_s\,\mathrm{sat}(S / (\phi K_s))`.
        """
        innovations, _ = validate_innovations(self, X, reset=False)
        shape = np.shape(X)
        innovations = np.require(innovations, dtype=np.float64, requirements=["C", "W"])
        error, fault_estimate = (
            path.reshape(-1, shape[-1]) for path in observer.observe(innovations, self._loop())
        )
        surface = residual_levels.sliding_surface(error, self.sliding_slope)
        gain = residual_levels.switching_gain(surface, self.adaptation_step)
        layer = self.boundary_layer * gain
        saturated = np.divide(surface, layer, out=np.sign(surface), where=layer > 0)
        trajectories = {
            "error": error,
            "fault_estimate": fault_estimate,
            "sliding_surface": surface,
            "switching_gain": gain,
            "residual": gain * np.clip(saturated, -1, 1),
        }
        return Bunch(**{name: path.reshape(shape) for name, path in trajectories.items()})

    @uses_fitted
    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[Any]:
        """Names of the levels: model and evaluation.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the models, as `ARXLaguerre.get_feature_names_out` gives them.

        Returns
        -------
        ndarray of str
            One name a column of what `transform` returns.
        """
        names = check_input_names(self, input_features)
        if self.n_models_ == 0:
            prefixes = [""]
        elif names is None:
            prefixes = [f"model{c}_" for c in range(self.n_models_)]
        else:
            prefixes = [f"{name}_" for name in names]
        kinds = [self.evaluation] + ["fault_estimate"] * self.fault_estimate
        return np.array([prefix + kind for kind in kinds for prefix in prefixes], dtype=object)

    def _check_parameters(self):
        check_real(self.pole, "pole", min_val=-1, max_val=1, include_boundaries="neither")
        check_real(self.kp, "kp")
        if self.evaluation not in RESIDUAL_EVALUATIONS:
            raise ValueError(
                f"evaluation == {self.evaluation!r}, must be one of "
                f"{', '.join(RESIDUAL_EVALUATIONS)}."
            )
        check_real(self.sliding_slope, "sliding_slope", min_val=0)
        check_real(
            self.adaptation_step,
            "adaptation_step",
            min_val=0,
            max_val=1,
            include_boundaries="right",
        )
        check_real(self.boundary_layer, "boundary_layer", min_val=0)
        check_scalar(self.spectrum_order, "spectrum_order", Integral, min_val=1)
        check_real(self.quefrency_exponent, "quefrency_exponent", min_val=0, max_val=10)

    def _check_relations(self):
        # The loops run on the parameters, and all else that `fit` found follows from these.
        afresh = clone(self)
        afresh._certify()
        for name in filter(lambda name: name.endswith("_"), vars(afresh)):
            expected, found = vars(afresh)[name], vars(self).get(name)
            check_value(self, name, found, Values(np.shape(expected)))
            if not np.allclose(found, expected, rtol=1e-6):
                raise ValueError(f"{name} == {found!r}, but the parameters give {expected!r}.")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags
