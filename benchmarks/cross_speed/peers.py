"""Methods of the benchmark: ours and their peers, each a function that returns a classifier.

Every peer starts by centring each window and scaling it to unit RMS, as the users of these methods
do when sensor gains are not known to agree, and sees the output channel only. Settings are the
library's defaults wherever the library has one; what it leaves open is stated in the function.
"""

import numpy as np
from scipy.signal import welch
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import HistGradientBoostingClassifier, RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.svm import SVC

RANDOM_STATE = 0
N_BANDS = 32
AR_ORDER = 16


def unit_rms(X):
    """Return the output channel of each window, centred and scaled to unit RMS.

    Parameters
    ----------
    X : array of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)

    Returns
    -------
    windows : array of shape (n_windows, n_samples)
        A constant window becomes zeros.
    """
    y = np.asarray(X, dtype=float)
    y = y[:, 0] if y.ndim == 3 else y
    y = y - y.mean(axis=1, keepdims=True)
    rms = np.sqrt(np.mean(y**2, axis=1, keepdims=True))
    return y / np.where(rms > 0, rms, 1.0)


def band_energies(X, n_bands=N_BANDS):
    """Log energy in equal bands from 0 to half the sampling rate, from the periodogram."""
    power = np.abs(np.fft.rfft(X, axis=1)[:, 1:]) ** 2
    bands = np.array_split(power, n_bands, axis=1)
    energy = np.column_stack([band.sum(axis=1) for band in bands])
    return np.log(energy + np.finfo(float).tiny)


def log_spectrum(X):
    """Log power spectrum by Welch's method with SciPy's defaults: 256 samples, Hann, half overlap.

    The bin at zero frequency is left out: the windows are centred.
    """
    return np.log(welch(X, axis=1)[1][:, 1:] + np.finfo(float).tiny)


def ar_coefficients(X, order=AR_ORDER):
    """Coefficients of an autoregressive model, y(k) = sum_i a_i y(k-i), autocorrelation method.

    Solves the Yule-Walker equations of each window with its biased autocorrelation.
    """
    n_samples = X.shape[1]
    spectrum = np.fft.rfft(X, n=2 * n_samples, axis=1)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2, axis=1)[:, : order + 1] / n_samples
    lag = np.abs(np.subtract.outer(np.arange(order), np.arange(order)))
    return np.linalg.solve(correlation[:, lag], correlation[:, 1:, None])[..., 0]


class LabelsOnly(ClassifierMixin, BaseEstimator):
    """Wrapper of a classifier that hides its probabilities, which are only 0 and 1.

    The classifiers of aeon that end in a ridge regression return such probabilities, and have to
    compute all features again for them.

    Parameters
    ----------
    classifier : classifier
    """

    def __init__(self, classifier):
        self.classifier = classifier

    def fit(self, X, y):
        """Fit a clone of the classifier."""
        self.classifier_ = clone(self.classifier).fit(X, y)
        self.classes_ = self.classifier_.classes_
        return self

    def predict(self, X):
        """Labels of the classifier."""
        return self.classifier_.predict(X)


def _classify(*steps):
    return make_pipeline(FunctionTransformer(unit_rms), *steps)


def bands_forest():
    forest = RandomForestClassifier(random_state=RANDOM_STATE)
    return _classify(FunctionTransformer(band_energies), forest)


def bands_boosting():
    boosting = HistGradientBoostingClassifier(random_state=RANDOM_STATE)
    return _classify(FunctionTransformer(band_energies), boosting)


def bands_lda():
    return _classify(FunctionTransformer(band_energies), LinearDiscriminantAnalysis())


def spectrum_lda():
    return _classify(FunctionTransformer(log_spectrum), LinearDiscriminantAnalysis())


def spectrum_svm():
    return _classify(FunctionTransformer(log_spectrum), StandardScaler(), SVC())


def ar_lda():
    return _classify(FunctionTransformer(ar_coefficients), LinearDiscriminantAnalysis())


def catch22_forest():
    from aeon.classification.feature_based import Catch22Classifier

    return _classify(Catch22Classifier(random_state=RANDOM_STATE))


def minirocket():
    from aeon.classification.convolution_based import MiniRocketClassifier

    return _classify(LabelsOnly(MiniRocketClassifier(random_state=RANDOM_STATE)))


def multirocket_hydra():
    from aeon.classification.convolution_based import MultiRocketHydraClassifier

    return _classify(LabelsOnly(MultiRocketHydraClassifier(random_state=RANDOM_STATE)))


def cnn():
    from benchmarks.cross_speed.cnn import ConvolutionalClassifier

    return _classify(ConvolutionalClassifier(random_state=RANDOM_STATE))


def alpio():
    from skarxlag.diagnosers import make_alpio

    return make_alpio()


def extended_state_pio():
    from skarxlag.diagnosers import make_extended_state_pio

    return make_extended_state_pio()


def make_single_observer_pio(**pipeline):
    """Make the paper's proposal with one observer, as the printed equations suggest.

    One extended-state observer receives the innovations of each condition's model. Its sliding-mode
    gain, which settles at a median over the whole window, is the residual of that condition. A
    median does not show impacts, so this is the weakest diagnoser of all.

    Parameters
    ----------
    **pipeline
        Parameters of `make_alpio`.

    Returns
    -------
    DiagnosisPipeline
    """
    from skarxlag import ExtendedStatePIObserver, make_alpio

    return make_alpio(**pipeline).set_params(observe=ExtendedStatePIObserver())


def diagnoser():
    from skarxlag.diagnosers import make_diagnoser

    return make_diagnoser()


OURS = {
    "make_diagnoser": diagnoser,
    "make_alpio": alpio,
    "make_extended_state_pio": extended_state_pio,
    "make_single_observer_pio": make_single_observer_pio,
}
PEERS = {
    "band energies + random forest": bands_forest,
    "band energies + LDA": bands_lda,
    "log spectrum + LDA": spectrum_lda,
    "log spectrum + SVM": spectrum_svm,
    "AR(16) + LDA": ar_lda,
    "MiniRocket": minirocket,
}
#: Peers that take most of the time of all. MultiRocketHydra takes 0.1 s for a window.
SLOW = {
    "band energies + gradient boosting": bands_boosting,
    "catch22 + random forest": catch22_forest,
    "1-D CNN": cnn,
    "MultiRocketHydra": multirocket_hydra,
}
METHODS = {**OURS, **PEERS, **SLOW}
