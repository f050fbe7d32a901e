"""Measures of windows: groups of log spectra on common frequency bands."""

from dataclasses import dataclass

from ..core.base import GroupTransformer
from ..core.validation import check_count
from ..kernels.spectra import own_spectra


@dataclass(kw_only=True, eq=False, repr=False)
class LogSpectra(GroupTransformer, auto_wrap_output_keys=None):
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

    spectrum_order: int = 128
    n_jobs: int | None = None

    def _groups(self, signals):
        return own_spectra(signals, self.spectrum_order)

    def _group_names(self):
        return ["spectral_shape", "steadiness"]

    def _check_parameters(self):
        check_count(self.spectrum_order, "spectrum_order")
