"""Residuals that are calibrated on how spectra scatter and on what a change of speed does."""

from numbers import Integral
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils import check_scalar
from sklearn.utils.validation import check_is_fitted

from ._parallel import map_batches
from ._state import (
    check_fitted_array,
    check_fitted_classes,
    check_fitted_input,
    check_fitted_number,
    is_moderate,
    remember_parameters,
)
from ._validation import check_input_names, check_real, validate_innovations
from .kernels.drift import raised_noise, scaled_frequency, smooth_variance, whitened
from .kernels.spectra import (
    LOG_SPECTRUM_CELLS,
    autoregressive_log_spectrum,
    cepstrum,
    short_time_log_spectra,
)


class CepstralResidual(TransformerMixin, BaseEstimator):
    r"""Distance of a window's innovations from those of each condition, with speed discounted.

    Two log spectra of the innovations are taken: their colour, by the autoregressive model
    identified on the window itself, and the steadiness of each band, the logarithm of its median
    over its mean power. Both become cepstra d, without the gain. The residual of condition c is
    the Mahalanobis distance

    .. math::

        r_c^2 = \tfrac{1}{\dim d}\,(d - \bar d_c)^T (S_w + S_v + S_s + S_n)^{-1} (d - \bar d_c)

    with :math:`\bar d_c` the mean over the training windows of c and :math:`S_w` the covariance of
    the training windows about these means. The rest is what a change of speed may do, to all
    conditions alike: :math:`S_v = \mathrm{diag}(c\,n^{-2} + f)` is smooth drift over frequency and
    drift of any other kind; :math:`S_s` the change when the frequency axis is scaled, as for all
    that follows the shaft; :math:`S_n` the change when the noise floor rises. :math:`S_s` and
    :math:`S_n` are computed from the mean spectra of the conditions. All of it is calibrated at
    the training speed.

    A model's own log spectrum enters d and :math:`\bar d_c` alike and cancels, so one model for
    all conditions serves as well as a bank.

    Parameters
    ----------
    spectrum_order : int, default=128
        Order of the autoregressive model of a window, at least 1; at most an eighth of
        a window is used.
    n_coefficients : int, default=48
        Cosine coefficients of the colour that are kept, from 1 to 255.
    segment : int, default=128
        Samples in a segment of the short-time spectrum that tells steadiness, at least 4; at most
        a window is used.
    smooth_drift : float, default=0.1
        The constant c in squared nepers of power, at least 0: what the log spectrum of one
        bearing drifts by when its speed changes by 3 to 30 %.
    rough_drift : float, default=0.01
        The constant f in squared nepers of power, above 0.
    frequency_drift : float, default=0.1
        Weight of :math:`S_s`, at least 0: the mean square change when frequency is scaled by
        :math:`e^{\pm 0.1}`.
    noise_drift : float, default=0.5
        Weight of :math:`S_n`, at least 0: the mean square change when white noise is added 20 and
        26 dB below the mean power.
    n_jobs : int or None, default=None
        Threads that work on windows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    references_ : ndarray of shape (n_classes, n_features)
        Mean cepstra :math:`\bar d_c`, in coordinates in which the covariance is the identity.
    whitener_ : ndarray of shape (n_features, n_features)
        Lower triangular W with W W' the inverse of the covariance.
    shared_drift_ : ndarray of shape (n_features, n_features)
        Share of a move that all conditions make, in the same coordinates; eigenvalues in [0, 1).
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

    classes_: NDArray[Any]
    references_: NDArray[Any]
    whitener_: NDArray[Any]
    shared_drift_: NDArray[Any]

    def __init__(
        self,
        *,
        spectrum_order: int = 128,
        n_coefficients: int = 48,
        segment: int = 128,
        smooth_drift: float = 0.1,
        rough_drift: float = 0.01,
        frequency_drift: float = 0.1,
        noise_drift: float = 0.5,
        n_jobs: int | None = None,
    ) -> None:
        self.spectrum_order = spectrum_order
        self.n_coefficients = n_coefficients
        self.segment = segment
        self.smooth_drift = smooth_drift
        self.rough_drift = rough_drift
        self.frequency_drift = frequency_drift
        self.noise_drift = noise_drift
        self.n_jobs = n_jobs

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
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
        self._calibrate(X, y)
        return self

    def fit_transform(self, X: ArrayLike, y: ArrayLike) -> NDArray[Any]:
        """Calibrate, and give the residuals of the same windows.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            As in `fit`.
        y : array-like of shape (n_windows,)
            Condition of each window.

        Returns
        -------
        ndarray of shape (n_windows, n_classes)
            What `transform` gives; of innovations of one model their spectra are taken only once.
        """
        innovations, cepstra = self._calibrate(X, y)
        if innovations.shape[1] > 1:
            return self.transform(X)
        rows = whitened(cepstra, self.whitener_)[:, np.newaxis]
        return self._distances(rows).astype(innovations.dtype)

    def _calibrate(self, X, y):
        """Innovations as validated, and the cepstra of each window's own model."""
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        self.classes_, target = np.unique(y, return_inverse=True)
        n_classes, n_models = len(self.classes_), X.shape[1]
        if n_models not in (1, n_classes):
            raise ValueError(
                f"X has the innovations of {n_models} models, expected 1 or one for each of the "
                f"{n_classes} conditions in y."
            )
        parts = self._of_own_models(self._log_spectra, X, target)
        colour, steadiness = (np.concatenate(part) for part in zip(*parts, strict=True))
        means = [_class_means(log_spectra, target) for log_spectra in (colour, steadiness)]
        references = self._cepstra(*means)
        cepstra = self._cepstra(colour, steadiness)
        scatter = cepstra - references[target]
        covariance = scatter.T @ scatter / len(scatter) + self._drift(*means)
        self.whitener_ = np.linalg.cholesky(linalg.inv(covariance))
        self.references_ = whitened(references, self.whitener_)
        shared = self._smooth_variance(steadiness.shape[1] - 1, rough=0.0)
        self.shared_drift_ = (self.whitener_.T * shared) @ self.whitener_
        remember_parameters(self)
        return X, cepstra

    def adapt(self, X: ArrayLike, y: ArrayLike) -> Self:
        r"""Move all references by the smooth drift that windows at a new speed show.

        Healthy windows, which a user often has at every speed, tell how far their own cepstra have
        moved, by m. All conditions share the smooth part of that; what it is most likely to be is
        :math:`C (S_w + S_v + S_s + S_n)^{-1} m` with :math:`C = \mathrm{diag}(c\,n^{-2})`.

        Parameters
        ----------
        X : array-like of shape (n_windows, n_models, n_samples) or (n_windows, n_samples)
            Innovations at the new speed.
        y : array-like of shape (n_windows,)
            Their conditions, among `classes_`; commonly all healthy.

        Returns
        -------
        CepstralResidual
            This transformer, for use at the new speed. Adapting again starts from where it is.

        Raises
        ------
        ValueError
            If a condition was not in `fit`.
        """
        X, y = validate_innovations(self, X, y, reset=False)
        unknown = np.setdiff1d(y, self.classes_)
        if len(unknown) > 0:
            raise ValueError(
                f"y has conditions that were not in fit: {unknown.tolist()}, expected among "
                f"{self.classes_.tolist()}."
            )
        target = np.searchsorted(self.classes_, y)
        rows = np.concatenate(self._of_own_models(self._rows, X, target))
        moved = np.mean(rows - self.references_[target], axis=0)
        self.references_ = self.references_ + self.shared_drift_ @ moved
        return self

    def transform(self, X: ArrayLike) -> NDArray[Any]:
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

        def of_batch(batch):
            rows = self._rows(X[batch].reshape(-1, X.shape[-1]))
            return self._distances(rows.reshape(-1, X.shape[1], rows.shape[1]))

        return np.concatenate(map_batches(of_batch, len(X), self.n_jobs)).astype(X.dtype)

    def _distances(self, rows):
        return np.sqrt(np.mean((rows - self.references_) ** 2, axis=-1))

    def _of_own_models(self, function, X, target):
        """What a function makes of the innovations of each window's own model, by batch."""

        def of_batch(batch):
            own = target[batch] % X.shape[1]
            return function(X[batch][np.arange(len(own)), own])

        return map_batches(of_batch, len(X), self.n_jobs)

    def _rows(self, signals):
        """Whitened cepstra of shape (n_signals, n_features)."""
        return whitened(self._cepstra(*self._log_spectra(signals)), self.whitener_)

    def _log_spectra(self, signals):
        """Colour and steadiness, each of shape (n_signals, n_frequencies)."""
        segment = min(self.segment, signals.shape[-1])
        mean, median = short_time_log_spectra(signals, segment, max(segment // 8, 1))
        return (
            autoregressive_log_spectrum(signals, self.spectrum_order, LOG_SPECTRUM_CELLS),
            median - mean,
        )

    def _cepstra(self, colour, steadiness):
        kept = cepstrum(colour)[:, : self.n_coefficients]
        return np.concatenate([kept, cepstrum(steadiness)], axis=1)

    def _drift(self, colour, steadiness):
        """Covariance of what a change of speed may do to mean log spectra."""
        shifted = self._cepstra(scaled_frequency(colour), scaled_frequency(steadiness))
        noise = raised_noise(colour)
        noisy = self._cepstra(noise, np.zeros((len(noise), steadiness.shape[1])))
        return (
            np.diag(self._smooth_variance(steadiness.shape[1] - 1, self.rough_drift))
            + self.frequency_drift * shifted.T @ shifted / len(shifted)
            + self.noise_drift * noisy.T @ noisy / len(noisy)
        )

    def _smooth_variance(self, n_steadiness, rough):
        return np.concatenate(
            [
                smooth_variance(n, self.smooth_drift, rough)
                for n in (self.n_coefficients, n_steadiness)
            ]
        )

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
        check_is_fitted(self)
        check_input_names(self, input_features)
        return np.array([f"{name}_cepstral" for name in self.classes_], dtype=object)

    def _check_parameters(self):
        check_scalar(self.spectrum_order, "spectrum_order", Integral, min_val=1)
        check_scalar(
            self.n_coefficients,
            "n_coefficients",
            Integral,
            min_val=1,
            max_val=LOG_SPECTRUM_CELLS - 1,
        )
        check_scalar(self.segment, "segment", Integral, min_val=4)
        check_real(self.rough_drift, "rough_drift", min_val=0, include_boundaries="neither")
        for name in ("smooth_drift", "frequency_drift", "noise_drift"):
            check_real(getattr(self, name), name, min_val=0)

    def _check_state(self):
        self._check_parameters()
        check_fitted_input(self, windows=True)
        n_classes = len(check_fitted_classes(self))
        is_plain = len(self.window_shape_) == 1
        check_fitted_number(
            self,
            "n_models_",
            kind="i",
            valid=lambda n: (
                n == 0 if is_plain else n in (1, n_classes) and n == self.n_features_in_
            ),
            expected="the number of models in window_shape_, or 0 for plain windows",
        )
        n_bands = max(min(self.segment, int(self.window_shape_[-1])) // 2 - 1, 1)
        n_features = self.n_coefficients + n_bands - 1
        for name, n_rows in (
            ("references_", n_classes),
            ("whitener_", n_features),
            ("shared_drift_", n_features),
        ):
            check_fitted_array(
                self,
                name,
                (n_rows, n_features),
                given="classes_, window_shape_ and the parameters",
                valid=is_moderate,
                expected="below 1e150",
            )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        tags.input_tags.three_d_array = True
        tags.transformer_tags.preserves_dtype = ["float64", "float32"]
        return tags


def _class_means(rows, target):
    return np.stack([rows[target == c].mean(axis=0) for c in range(target.max() + 1)])
