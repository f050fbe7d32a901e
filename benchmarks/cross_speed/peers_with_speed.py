"""Peers that receive the shaft speed: as a feature, or as the scale of the frequency axis."""

import numpy as np
from sklearn.base import BaseEstimator, ClassifierMixin

from benchmarks.cross_speed.peers import log_spectrum, shrinkage_lda, unit_rms


class SpectrumWithSpeed(ClassifierMixin, BaseEstimator):
    """Shrinkage LDA of log spectra and of the speed of each window.

    Parameters
    ----------
    over_orders : bool, default=False
        True: the spectra are resampled to orders of the shaft, where they end at the
        smallest Nyquist frequency of training. False: the logarithm of the speed is a
        further feature.
    """

    def __init__(self, *, over_orders=False):
        self.over_orders = over_orders

    def fit(self, X, y, rpm):
        """Fit on windows and their speeds."""
        self.reference_rpm_ = np.max(rpm)
        self.classifier_ = shrinkage_lda().fit(self._features(X, rpm), y)
        self.classes_ = self.classifier_.classes_
        return self

    def predict_proba(self, X, rpm):
        """Probability of each condition."""
        return self.classifier_.predict_proba(self._features(X, rpm))

    def predict(self, X, rpm):
        """Most probable condition."""
        return self.classifier_.predict(self._features(X, rpm))

    def _features(self, X, rpm):
        spectra = log_spectrum(unit_rms(X))
        rpm = np.broadcast_to(rpm, len(spectra))
        if self.over_orders:
            return over_orders(spectra, rpm, self.reference_rpm_)
        return np.column_stack([spectra, np.log(rpm)])


def over_orders(spectra, rpm, reference_rpm):
    """Resample spectra to the orders that their bins have at a reference speed.

    Parameters
    ----------
    spectra : array of shape (n_windows, n_bins)
        Over equidistant frequencies above 0.
    rpm : array of shape (n_windows,)
        Speeds.
    reference_rpm : float
        At this speed, a spectrum is unchanged. Beyond the last bin, its value is
        repeated.

    Examples
    --------
    >>> over_orders(np.array([[1.0, 2, 3, 4], [1, 2, 3, 4]]), np.array([100, 50]), 100).tolist()
    [[1.0, 2.0, 3.0, 4.0], [1.0, 1.0, 1.5, 2.0]]
    """
    bins = np.arange(1, spectra.shape[1] + 1)
    return np.array(
        [
            np.interp(bins * speed / reference_rpm, bins, spectrum)
            for spectrum, speed in zip(spectra, rpm, strict=True)
        ]
    )
