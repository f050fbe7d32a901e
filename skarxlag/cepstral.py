"""Residuals that are calibrated on how spectra scatter and on what a change of speed does."""

from numbers import Integral, Real

import numpy as np
from scipy import linalg
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils import check_scalar, gen_batches
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.parallel import Parallel, delayed
from sklearn.utils.validation import check_is_fitted

from .kernels.drift import shift_drift, shrunk_scatter, smooth_drift, whitened
from .kernels.spectra import autoregressive_log_spectrum, band_impulsiveness, cepstrum
from .validation import check_input_names, validate_innovations

#: Cells of (0, pi) on which log spectra are taken.
_N_FREQUENCIES = 256
#: Segments of the short-time spectrum start this share of a segment apart.
_OVERLAP = 8
#: Windows in one unit of parallel work.
_BATCH = 64


class CepstralResidual(TransformerMixin, BaseEstimator):
    r"""Distance of a window's innovations from those of each condition, with speed discounted.

    Two log spectra of the innovations are taken: their colour, by the autoregressive model
    identified on the window itself, and the impulsiveness of each band, the logarithm of its
    median over its mean power. Both become cepstra d, without the gain. The residual of condition
    c is the Mahalanobis distance

    .. math::

        r_c^2 = \tfrac{1}{\dim d}\,(d - \bar d_c)^T (S_w + S_v + S_s)^{-1} (d - \bar d_c),

    where :math:`\bar d_c` is the mean over the training windows of c; :math:`S_w` their scatter
    within conditions, shrunk to its diagonal; :math:`S_v = \mathrm{diag}(c\,n^{-2} + f)` the
    smooth drift of a log spectrum when speed changes, common to all conditions; and :math:`S_s`
    what moves when all of it shifts along the frequency axis, as all that follows the shaft does.
    Only :math:`\bar d_c`, :math:`S_w` and :math:`S_s` are calibrated, at the training speed.

    A model's own log spectrum enters d and :math:`\bar d_c` alike and cancels, so one model for
    all conditions serves as well as a bank.

    Parameters
    ----------
    spectrum_order : int, default=64
        Order of the autoregressive model of a window, at least 1; at most half a window is used.
    segment : int, default=128
        Samples in a segment of the short-time spectrum that tells impulsiveness, at least 4; at
        most a window is used.
    drift : float, default=0.1
        The constant c of the smooth drift in squared nepers of power, at least 0: 0.1 is what
        one bearing's log spectrum drifts by when its speed changes by 3 to 30 %.
    floor : float, default=0.03
        The constant f of the drift that is not smooth, in squared nepers of power, above 0.
    shift : float, default=0.1
        Share at which the drift by a shift of frequency counts, at least 0.
    n_jobs : int or None, default=None
        Threads that work on windows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    references_ : ndarray of shape (n_classes, n_coefficients)
        Mean cepstra :math:`\bar d_c`, in coordinates in which the covariance is the identity.
    whitener_ : ndarray of shape (n_coefficients, n_coefficients)
        Lower triangular W with W W' the inverse of the covariance.
    n_models_ : int
        Models that the innovations came from; 0 for plain windows.
    n_features_in_ : int
        Number of models, or samples in a plain window.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    PIObserver : Its whiteness evaluation needs no calibration, and no conditions in `fit`.

    References
    ----------
    R. J. Martin (2000), "A metric for ARMA processes", IEEE Transactions on Signal Processing
    48(4), 1164-1170.

    J. Schaefer and K. Strimmer (2005), "A shrinkage approach to large-scale covariance matrix
    estimation", Statistical Applications in Genetics and Molecular Biology 4(1), 32.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> noise = np.random.default_rng(0).normal(size=(40, 1200))
    >>> X = np.concatenate([lfilter([1], [1, -0.9], noise[:20]), noise[20:]])
    >>> y = np.repeat(["coloured", "white"], 20)
    >>> CepstralResidual().fit(X, y).transform(X).argmin(axis=1)[[0, 19, 20, 39]]
    array([0, 0, 1, 1])
    """

    def __init__(
        self,
        *,
        spectrum_order=64,
        segment=128,
        drift=0.1,
        floor=0.03,
        shift=0.1,
        n_jobs=None,
    ):
        self.spectrum_order = spectrum_order
        self.segment = segment
        self.drift = drift
        self.floor = floor
        self.shift = shift
        self.n_jobs = n_jobs

    def fit(self, X, y):
        """Calibrate references and covariance.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations of one model, or of one model for each condition in `y`, sorted; or plain
            windows.
        y : array-like of shape (n_windows,)
            Condition of each window.

        Returns
        -------
        CepstralResidual
            The fitted transformer.

        Raises
        ------
        ValueError
            If a parameter is out of its range, or X comes of several models, but not of one for
            each condition.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        check_classification_targets(y)
        self._check_parameters()
        self.classes_, target = np.unique(y, return_inverse=True)
        n_classes, n_models = len(self.classes_), X.shape[1]
        if n_models not in (1, n_classes):
            raise ValueError(
                f"X has the innovations of {n_models} models, expected 1 or one for each of the "
                f"{n_classes} conditions in y."
            )
        log_spectra = self._log_spectra(X)
        own = [s[np.arange(len(X)), target % n_models] for s in log_spectra]
        means = [np.stack([s[target == c].mean(axis=0) for c in range(n_classes)]) for s in own]
        references = np.concatenate([cepstrum(m) for m in means], axis=1)
        cepstra = np.concatenate([cepstrum(s) for s in own], axis=1)
        covariance = shrunk_scatter(cepstra - references[target])
        shifts = np.concatenate([shift_drift(m) for m in means], axis=1)
        covariance += self.shift * shifts.T @ shifts / len(shifts)
        covariance += np.diag(
            np.concatenate([smooth_drift(m.shape[1] - 1, self.drift, self.floor) for m in means])
        )
        self.whitener_ = np.linalg.cholesky(linalg.inv(covariance))
        self.references_ = whitened(references, self.whitener_)
        return self

    def transform(self, X):
        """One residual for each window and condition.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            Mahalanobis distances, a root mean square over coefficients.
        """
        X, _ = validate_innovations(self, X, reset=False)
        parts = Parallel(n_jobs=self.n_jobs, prefer="threads")(
            delayed(self._distances)(X[batch]) for batch in gen_batches(len(X), _BATCH)
        )
        return np.concatenate(parts).astype(X.dtype, copy=False)

    def _distances(self, X):
        n_windows, n_models, _ = X.shape
        cepstra = np.concatenate(
            [cepstrum(s.reshape(n_windows * n_models, -1)) for s in self._log_spectra(X)], axis=1
        )
        rows = whitened(cepstra, self.whitener_).reshape(n_windows, n_models, -1)
        return np.sqrt(np.mean((rows - self.references_) ** 2, axis=-1))

    def _log_spectra(self, X):
        """Colour and impulsiveness, each of shape (n_windows, n_models, n_frequencies)."""
        signals = X.reshape(-1, X.shape[-1]).astype(np.float64)
        segment = min(self.segment, X.shape[-1])
        colour = autoregressive_log_spectrum(signals, self.spectrum_order, _N_FREQUENCIES)
        impulsiveness = band_impulsiveness(signals, segment, max(segment // _OVERLAP, 1))
        return [s.reshape(*X.shape[:2], -1) for s in (colour, impulsiveness)]

    def get_feature_names_out(self, input_features=None):
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
        check_is_fitted(self)
        check_input_names(self, input_features)
        return np.array([f"{name}_cepstral" for name in self.classes_], dtype=object)

    def _check_parameters(self):
        check_scalar(self.spectrum_order, "spectrum_order", Integral, min_val=1)
        check_scalar(self.segment, "segment", Integral, min_val=4)
        check_scalar(self.drift, "drift", Real, min_val=0)
        check_scalar(self.floor, "floor", Real, min_val=0, include_boundaries="neither")
        check_scalar(self.shift, "shift", Real, min_val=0)

    def __sklearn_tags__(self):
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        tags.input_tags.three_d_array = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags
