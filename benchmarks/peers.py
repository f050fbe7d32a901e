"""Peers: features and classifiers that do not come from this package.

Every peer centres each row, scales it to unit RMS and receives the output channel only,
unless its name says otherwise. Settings are the defaults of scikit-learn, SciPy and
aeon.
"""

import numpy as np
from scipy.fft import dct
from scipy.linalg import solve_toeplitz, sqrtm
from scipy.signal import coherence, get_window, welch
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.svm import SVC

RANDOM_STATE = 0
TINY = np.finfo(float).tiny
#: Samples of a segment of the short-time spectra, and from one to the next.
_SEGMENT, _HOP = 64, 32
_PERCENTILES = (25, 50, 90)
#: Copies of a training row with random gains; size of the gains in nepers of power, and
#: number of their cosines.
_N_COPIES, _GAIN, _N_COSINES = 6, 0.6, 24


def unit_rms(X):
    """Return the output channel of each row, centred and scaled to unit RMS.

    A constant row becomes zeros.
    """
    y = np.asarray(X, dtype=float)
    y = y[:, 0] if y.ndim == 3 else y
    y = y - y.mean(axis=1, keepdims=True)
    rms = np.sqrt(np.mean(y**2, axis=1, keepdims=True))
    return y / np.where(rms > 0, rms, 1.0)


def band_energies(X, n_bands=32):
    """Compute the log energy in equal bands of the periodogram."""
    power = np.abs(np.fft.rfft(X, axis=1)[:, 1:]) ** 2
    bands = np.array_split(power, n_bands, axis=1)
    return np.log(np.column_stack([band.sum(axis=1) for band in bands]) + TINY)


def log_spectrum(X):
    """Compute the log of Welch's estimate with SciPy's defaults, without the zero bin."""
    return np.log(welch(X, axis=1)[1][:, 1:] + TINY)


def incoherent_spectrum(X):
    """Compute the log spectrum of the part of the output that the input does not explain."""
    output, torque = np.moveaxis(np.asarray(X, dtype=float)[:, :2], 1, 0)
    explained = coherence(output, torque, axis=1)[1][:, 1:]
    spectrum = log_spectrum(unit_rms(output))
    return spectrum + np.log(np.maximum(1 - explained, TINY))


def short_time_power(X):
    """Return the power of short segments, of shape (n_rows, n_segments, 32)."""
    segments = np.lib.stride_tricks.sliding_window_view(X, _SEGMENT, axis=1)[:, ::_HOP]
    spectrum = np.fft.rfft(segments * get_window("hann", _SEGMENT), axis=2)[..., 1:]
    return np.abs(spectrum) ** 2 + TINY


def spectrum_percentiles(X):
    """Compute three percentiles over time of the log short-time power, and its log mean."""
    power = short_time_power(X)
    percentiles = np.percentile(np.log(power), _PERCENTILES, axis=1)
    return np.hstack([*percentiles, np.log(power.mean(axis=1))])


def spectrum_and_percentiles(X):
    """Join both features."""
    return np.hstack([log_spectrum(X), spectrum_percentiles(X)])


def ar_coefficients(X, order=16):
    """Solve the Yule-Walker equations of each row."""
    padded = np.fft.rfft(X, n=2 * X.shape[1], axis=1)
    correlation = np.fft.irfft(np.abs(padded) ** 2, axis=1)[:, : order + 1]
    rows = [solve_toeplitz(lags[:-1], lags[1:]) for lags in correlation]
    return np.array(rows)


def ar_spectrum(X, order=64):
    """Compute the log spectrum of the autoregressive model of each row, in 2 order bins."""
    coefficients = np.column_stack([np.ones(len(X)), -ar_coefficients(X, order)])
    return -2 * np.log(np.abs(np.fft.rfft(coefficients, n=4 * order, axis=1)) + TINY)


class SpectralDistances(ClassifierMixin, BaseEstimator):
    """Nearest mean of two log spectra that expects a smooth change with speed.

    A method of twenty lines: the cosine coefficients of the autoregressive log spectrum,
    and of the log ratio of the median to the mean of the short-time power. The distance
    is the sum of two mean Mahalanobis distances, with the covariance within conditions
    plus ``.4 n^-2 + .01`` for coefficient n.
    """

    def fit(self, X, y):
        """Compute means, and one covariance for all conditions."""
        self.classes_, of_row = np.unique(y, return_inverse=True)
        self.groups_ = []
        for d in self._coefficients(X):
            means = np.array(
                [d[of_row == c].mean(axis=0) for c in range(of_row.max() + 1)]
            )
            n = np.arange(1, d.shape[1] + 1)
            covariance = np.cov((d - means[of_row]).T) + np.diag(0.4 / n**2 + 0.01)
            self.groups_.append((means, np.linalg.inv(covariance)))
        return self

    def predict(self, X):
        """Return the nearest condition."""
        distance = 0
        groups = zip(self._coefficients(X), self.groups_, strict=True)
        for d, (means, inverse) in groups:
            away = d[:, np.newaxis] - means
            distance += np.einsum("rcn,nm,rcm->rc", away, inverse, away) / d.shape[1]
        return self.classes_[distance.argmin(axis=1)]

    def _coefficients(self, X):
        power = short_time_power(X)
        ratio = np.log(np.median(power, axis=1) / power.mean(axis=1))
        spectra = (ar_spectrum(X), ratio)
        return [dct(each, norm="ortho", axis=1)[:, 1:] for each in spectra]


class SmoothGains(ClassifierMixin, BaseEstimator):
    """Classifier that is trained on copies of each row with random smooth gains.

    The gain is a sum over n of ``.6 N(0, 1) / n sqrt(2) cos(pi n f)``, with f from 0 to 1.
    """

    def __init__(self, classifier, random_state=RANDOM_STATE):
        self.classifier = classifier
        self.random_state = random_state

    def fit(self, X, y):
        """Fit a clone of the classifier on six copies of each row of percentiles."""
        n_statistics = len(_PERCENTILES) + 1
        n_bins = X.shape[1] // n_statistics
        n = np.arange(1, _N_COSINES + 1)
        frequency = (np.arange(n_bins) + 0.5) / n_bins
        cosines = np.sqrt(2) * np.cos(np.pi * np.outer(n, frequency))
        rng = np.random.default_rng(self.random_state)
        copies = np.repeat(X, _N_COPIES, axis=0)
        gains = rng.normal(scale=_GAIN / n, size=(len(copies), _N_COSINES)) @ cosines
        copies = copies + np.tile(gains, n_statistics)
        self.classifier_ = clone(self.classifier).fit(copies, np.repeat(y, _N_COPIES))
        self.classes_ = self.classifier_.classes_
        return self

    def predict(self, X):
        """Return the labels of the classifier."""
        return self.classifier_.predict(X)

    def decision_function(self, X):
        """Return the decision function of the classifier."""
        return self.classifier_.decision_function(X)


def standardised(X):
    """Standardise features over the batch at hand.

    In `predict`, the batch holds all test rows of one speed. This is another protocol:
    it needs an unlabelled batch that holds every condition equally often.
    """
    scale = X.std(axis=0)
    return (X - X.mean(axis=0)) / np.where(scale > 0, scale, 1.0)


class Coral(ClassifierMixin, BaseEstimator):
    """Shrinkage LDA on training rows with the covariance of the test batch (Sun 2016)."""

    def fit(self, X, y):
        """Keep the rows: the classifier depends on the batch of `predict`."""
        self.X_ = X
        self.y_ = y
        self.classes_ = np.unique(y)
        return self

    def predict(self, X):
        """Align the training rows with this batch, and classify it."""
        source = np.cov(self.X_.T) + np.eye(X.shape[1])
        target = np.cov(X.T) + np.eye(X.shape[1])
        align = np.linalg.inv(sqrtm(source).real) @ sqrtm(target).real
        aligned = (self.X_ - self.X_.mean(axis=0)) @ align
        return shrinkage_lda().fit(aligned, self.y_).predict(X - X.mean(axis=0))


class OverOrders(ClassifierMixin, BaseEstimator):
    """Shrinkage LDA of log spectra over orders of the shaft; it receives the speed."""

    def fit(self, X, y, rpm):
        """Fit on spectra that are resampled to the orders of the highest speed."""
        self.reference_rpm_ = np.max(rpm)
        self.classifier_ = shrinkage_lda().fit(self._spectra(X, rpm), y)
        self.classes_ = self.classifier_.classes_
        return self

    def predict_proba(self, X, rpm):
        """Return the probability of each condition."""
        return self.classifier_.predict_proba(self._spectra(X, rpm))

    def _spectra(self, X, rpm):
        spectra = log_spectrum(unit_rms(X))
        bins = np.arange(1, spectra.shape[1] + 1)
        scaled = zip(spectra, np.asarray(rpm) / self.reference_rpm_, strict=True)
        return np.array([np.interp(bins * scale, bins, row) for row, scale in scaled])


def shrinkage_lda():
    """Return linear discriminant analysis with the shrinkage of Ledoit and Wolf."""
    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")


def of_features(features, *steps):
    """Return a pipeline from centred and scaled rows to a classifier."""
    rows = FunctionTransformer(unit_rms)
    return make_pipeline(rows, FunctionTransformer(features), *steps)


def minirocket():
    """Return the classifier of aeon."""
    from aeon.classification.convolution_based import MiniRocketClassifier

    rocket = MiniRocketClassifier(random_state=RANDOM_STATE)
    return make_pipeline(FunctionTransformer(unit_rms), rocket)


#: Functions that make classifiers of windows.
PEERS = {
    "band energies + random forest": lambda: of_features(
        band_energies, RandomForestClassifier(random_state=RANDOM_STATE)
    ),
    "log spectrum + shrinkage LDA": lambda: of_features(log_spectrum, shrinkage_lda()),
    "log spectrum + SVM": lambda: of_features(log_spectrum, StandardScaler(), SVC()),
    "AR(16) + LDA": lambda: of_features(ar_coefficients, LinearDiscriminantAnalysis()),
    "STFT percentiles + shrinkage LDA, augmented": lambda: of_features(
        spectrum_percentiles, SmoothGains(shrinkage_lda())
    ),
    "STFT percentiles + SVM, augmented": lambda: of_features(
        spectrum_percentiles, SmoothGains(make_pipeline(StandardScaler(), SVC(C=10)))
    ),
    "two spectral distances (20 lines)": lambda: make_pipeline(
        FunctionTransformer(unit_rms), SpectralDistances()
    ),
}
#: Another protocol: methods that see all test rows of a speed at once.
BATCH = {
    "batch: spectra standardised by speed + shrinkage LDA": lambda: of_features(
        spectrum_and_percentiles, FunctionTransformer(standardised), shrinkage_lda()
    ),
    "batch: spectra aligned by CORAL + shrinkage LDA": lambda: of_features(
        spectrum_and_percentiles, Coral()
    ),
}
#: Peers of the simulated rig that receive the torque.
WITH_TORQUE = {
    "log spectrum without the torque's part + shrinkage LDA": lambda: make_pipeline(
        FunctionTransformer(incoherent_spectrum), shrinkage_lda()
    )
}
#: Peers that need aeon. They are computed only if they are named.
SLOW = {"MiniRocket": minirocket}
