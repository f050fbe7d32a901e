"""Methods of the benchmark: ours and their peers, each a function that returns a classifier.

Every peer starts by centring each window and scaling it to unit RMS, as the users of
these methods do when sensor gains are not known to agree, and sees the output channel
only. Settings are the library's defaults wherever the library has one; what it leaves
open is stated in the function.
"""

from functools import partial

import numpy as np
from scipy.signal import get_window, welch
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import HistGradientBoostingClassifier, RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.svm import SVC

RANDOM_STATE = 0
SEEDS = (0, 1, 2)
N_BANDS = 32
AR_ORDER = 16
#: Samples of a segment of the short-time Fourier transform, and from one segment to the
#: next.
SEGMENT = 64
HOP = 32
PERCENTILES = (25, 50, 90)
#: Copies of a row with random gains; size of the gains in nepers of power, and number
#: of cosines.
N_COPIES = 6
GAIN = 0.6
N_COSINES = 24


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


def spectrum_percentiles(X):
    """Percentiles over time of the log power of short segments, and the log of their mean power.

    Segments have 64 samples, a Hann window and half overlap; they do not reach beyond
    the window. The bin at zero frequency is left out.

    Returns
    -------
    features : array of shape (n_windows, 4 * 32)
        The 32 bins of the 25th percentile, then those of the 50th, the 90th and the
        mean.
    """
    segments = np.lib.stride_tricks.sliding_window_view(X, SEGMENT, axis=1)[:, ::HOP]
    spectrum = np.fft.rfft(segments * get_window("hann", SEGMENT), axis=2)[..., 1:]
    power = np.abs(spectrum) ** 2 + np.finfo(float).tiny
    percentiles = np.percentile(np.log(power), PERCENTILES, axis=1)
    return np.hstack([*percentiles, np.log(power.mean(axis=1))])


def smooth_gains(n_rows, n_bins, random_state):
    """Draw random smooth log gains over frequency, sums of cosines that decrease with their number.

    Returns
    -------
    gains : array of shape (n_rows, n_bins)
        Sum over n of ``0.6 N(0, 1) / n sqrt(2) cos(pi n f)``, with f from 0 to 1.
    """
    n = np.arange(1, N_COSINES + 1)
    frequency = (np.arange(n_bins) + 0.5) / n_bins
    cosines = np.sqrt(2) * np.cos(np.pi * np.outer(n, frequency))
    rng = np.random.default_rng(random_state)
    return rng.normal(scale=GAIN / n, size=(n_rows, N_COSINES)) @ cosines


class SmoothGains(ClassifierMixin, BaseEstimator):
    """Classifier that is trained on copies of each row with random smooth gains.

    Parameters
    ----------
    classifier : classifier
        Of features as `spectrum_percentiles` computes them.
    random_state : int, default=0
        Seed of the gains.
    """

    def __init__(self, classifier, random_state=RANDOM_STATE):
        self.classifier = classifier
        self.random_state = random_state

    def fit(self, X, y):
        """Fit a clone of the classifier on six copies of each row."""
        n_statistics = len(PERCENTILES) + 1
        copies = np.repeat(X, N_COPIES, axis=0)
        gains = smooth_gains(len(copies), X.shape[1] // n_statistics, self.random_state)
        # A gain moves every statistic of a bin alike.
        copies = copies + np.tile(gains, n_statistics)
        self.classifier_ = clone(self.classifier).fit(copies, np.repeat(y, N_COPIES))
        self.classes_ = self.classifier_.classes_
        return self

    def predict(self, X):
        """Labels of the classifier."""
        return self.classifier_.predict(X)

    def decision_function(self, X):
        """Decision function of the classifier."""
        return self.classifier_.decision_function(X)


def standardised(X):
    """Features with mean 0 and variance 1 over the batch at hand.

    In `predict`, the batch is all test windows of one speed: another protocol, which
    requires an unlabelled batch that holds every condition equally often.
    """
    scale = X.std(axis=0)
    return (X - X.mean(axis=0)) / np.where(scale > 0, scale, 1.0)


def ar_coefficients(X, order=AR_ORDER):
    """Coefficients of an autoregressive model, y(k) = sum_i a_i y(k-i), autocorrelation method.

    Solves the Yule-Walker equations of each window with its biased autocorrelation.
    """
    n_samples = X.shape[1]
    spectrum = np.fft.rfft(X, n=2 * n_samples, axis=1)
    correlation = (
        np.fft.irfft(np.abs(spectrum) ** 2, axis=1)[:, : order + 1] / n_samples
    )
    lag = np.abs(np.subtract.outer(np.arange(order), np.arange(order)))
    return np.linalg.solve(correlation[:, lag], correlation[:, 1:, None])[..., 0]


class LabelsOnly(ClassifierMixin, BaseEstimator):
    """Wrapper of a classifier that hides its probabilities, which are only 0 and 1.

    The classifiers of aeon that end in a ridge regression return such probabilities,
    and have to compute all features again for them.

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


def shrinkage_lda():
    """Linear discriminant analysis with the shrinkage of Ledoit and Wolf."""
    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")


def spectrum_shrinkage_lda():
    return _classify(FunctionTransformer(log_spectrum), shrinkage_lda())


def percentiles_lda():
    return _classify(FunctionTransformer(spectrum_percentiles), shrinkage_lda())


def percentiles_lda_augmented():
    return _classify(
        FunctionTransformer(spectrum_percentiles), SmoothGains(shrinkage_lda())
    )


def percentiles_svm_augmented():
    svm = make_pipeline(StandardScaler(), SVC(C=10))
    return _classify(FunctionTransformer(spectrum_percentiles), SmoothGains(svm))


def percentiles_lda_by_speed():
    return _classify(
        FunctionTransformer(spectrum_percentiles),
        FunctionTransformer(standardised),
        shrinkage_lda(),
    )


def ar_lda():
    return _classify(FunctionTransformer(ar_coefficients), LinearDiscriminantAnalysis())


def catch22_forest():
    from aeon.classification.feature_based import Catch22Classifier

    return _classify(Catch22Classifier(random_state=RANDOM_STATE))


def minirocket(random_state=RANDOM_STATE):
    from aeon.classification.convolution_based import MiniRocketClassifier

    return _classify(LabelsOnly(MiniRocketClassifier(random_state=random_state)))


def quant():
    from aeon.classification.interval_based import QUANTClassifier

    return _classify(QUANTClassifier(random_state=RANDOM_STATE))


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

    One extended-state observer receives the innovations of each condition's model. Its
    sliding-mode gain, which settles at a median over the whole window, is the residual
    of that condition. A median does not show impacts, so this is the weakest diagnoser
    of all.

    Parameters
    ----------
    **pipeline
        Parameters of `make_alpio`.

    Returns
    -------
    DiagnosisPipeline
    """
    from skarxlag import ExtendedStatePIObserver, make_alpio

    return make_alpio(**pipeline).set_params(
        observe=ExtendedStatePIObserver(n_observers=1)
    )


def diagnoser():
    from skarxlag.diagnosers import make_diagnoser

    return make_diagnoser()


#: Constants of the choice without the rig at hand; the command makes it for each rig.
LEFT_OUT = "make_diagnoser, constants chosen without the rig"
OURS = {
    "make_diagnoser": diagnoser,
    LEFT_OUT: diagnoser,
    "make_alpio": alpio,
    "make_extended_state_pio": extended_state_pio,
    "make_single_observer_pio": make_single_observer_pio,
}
#: The best plain methods: log spectra, regularised, with and without augmentation.
PLAIN = {
    "log spectrum + shrinkage LDA": spectrum_shrinkage_lda,
    "STFT percentiles + shrinkage LDA": percentiles_lda,
    "STFT percentiles + shrinkage LDA, augmented": percentiles_lda_augmented,
    "STFT percentiles + SVM, augmented": percentiles_svm_augmented,
}
#: A method that needs an unlabelled batch of all conditions at the speed of test.
BATCH = {
    "STFT percentiles + shrinkage LDA, standardised by speed": percentiles_lda_by_speed
}
PEERS = {
    "band energies + random forest": bands_forest,
    "band energies + LDA": bands_lda,
    "log spectrum + LDA": spectrum_lda,
    "log spectrum + SVM": spectrum_svm,
    "AR(16) + LDA": ar_lda,
    **PLAIN,
    **BATCH,
}
#: Peers that need aeon or PyTorch. They take hours; their results are in the folder
#: ``stored``.
SLOW = {
    **{f"MiniRocket, seed {seed}": partial(minirocket, seed) for seed in SEEDS},
    "QUANT": quant,
    "band energies + gradient boosting": bands_boosting,
    "catch22 + random forest": catch22_forest,
    "1-D CNN": cnn,
    "MultiRocketHydra": multirocket_hydra,
}
METHODS = {**OURS, **PEERS, **SLOW}
