"""Measures of windows: groups of log spectra on common frequency bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.base import ArrayTransformer, InnovationsTransformer
from ..core.parallel import map_batches
from ..core.state import uses_fitted
from ..core.validation import check_count, validate_innovations
from ..kernels.spectra import SPECTRUM_ORDER, own_spectra

_GROUPS = ("spectral_shape", "steadiness")


@dataclass(kw_only=True, eq=False, repr=False)
class LogSpectra(InnovationsTransformer, ArrayTransformer, auto_wrap_output_keys=None):
    r"""Transformer from innovations to groups of log spectra on common frequency bands.

    The groups are:

    - "spectral_shape": the log power spectrum of the autoregressive model that is
      identified on the window alone, averaged over each of 126 bands.
    - "steadiness": the logarithm of the median power of a band over time less that of
      the mean power, from the short-time Fourier transform with a Hann window of 128
      samples, or of all samples of a shorter window. It is 0 for a steady tone,
      :math:`\log\log 2` for Gaussian noise, and far lower for a band in which impacts
      ring. Two neighbouring bands have the same value, because this transform has half
      as many bands.

    A constant factor on a window moves the spectral shape by the same constant in all
    bands. `SpectralDistance` removes this constant.

    Parameters
    ----------
    spectrum_order : int, default=128
        Order of the autoregressive model of a window, at least 1. At most an eighth of
        the samples of a window is used.
    n_jobs : int or None, default=None
        Number of threads. Results do not depend on it.

    Attributes
    ----------
    n_models_ : int
        Number of models that the innovations are from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, if fitted on a table.

    See Also
    --------
    SpectralDistance : Compares such groups with those of each condition.
    ExtendedStatePIObserver : Measures innovations by observers instead.

    Notes
    -----
    The model of a pipeline's first step adds the same log spectrum to the spectral
    shape of all windows. This term cancels in a comparison, so one model for all
    conditions is as good as one for each. With several models, the groups of one model
    follow those of another.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(0).normal(size=(10, 1200))
    >>> spectra = LogSpectra().fit_transform(noise)
    >>> spectra.shape
    (10, 2, 126)
    >>> float(spectra[:, 1].mean().round(1))
    -0.3
    """

    spectrum_order: int = SPECTRUM_ORDER
    n_jobs: int | None = None

    _learns_in_batches = True

    @uses_fitted
    def transform(self, X: ArrayLike) -> NDArray[Any]:
        """Compute the groups of each window, as the class describes them.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        ndarray of shape (n_windows, n_groups, n_frequencies)
            Natural logarithms of power. With several models, the groups of one model
            follow those of another.
        """
        X, _ = validate_innovations(self, X, reset=False)

        def of_batch(batch):
            return own_spectra(X[batch].reshape(-1, X.shape[2]), self.spectrum_order)

        parts = map_batches(of_batch, len(X), self.n_jobs)
        groups = np.concatenate(parts).astype(X.dtype, copy=False)
        return groups.reshape(len(X), -1, groups.shape[-1])

    @uses_fitted
    def get_feature_names_out(
        self, input_features: ArrayLike | None = None
    ) -> NDArray[Any]:
        """Return the names of the groups.

        Parameters
        ----------
        input_features : array-like of str or None, default=None
            Names of the models, as `ARXLaguerre.get_feature_names_out` returns them.

        Returns
        -------
        ndarray of str of shape (n_groups,)
            One name for each entry along axis 1 of the output. With several models,
            each name begins with the name of its model.
        """
        prefixes = self._model_prefixes(input_features, least=2)
        names = [prefix + group for prefix in prefixes for group in _GROUPS]
        return np.array(names, dtype=object)

    def _check_parameters(self):
        check_count(self.spectrum_order, "spectrum_order")
