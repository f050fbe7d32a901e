"""Methods that give one verdict for a stretch: ours, windows that vote, and rules of engineers.

All have ``fit(X, y, rpm)`` and ``predict(X, rpm)``. Those of `RACES` know the bearing
and name the fault location only.
"""

from functools import partial

import numpy as np
from scipy.signal import hilbert, welch

from benchmarks.cross_speed.peers import minirocket, multirocket_hydra
from benchmarks.cross_speed.protocol import log_evidence
from skarxlag import make_diagnoser

#: Fault locations that the rules look for, with the multiples of their orders that
#: they add up.
_LOCATIONS = {"outer": (1, 2, 3), "inner": (1, 2, 3), "ball": (1, 2)}
#: Relative width of the band about an order in which the largest peak counts, for slip.
_SLIP = 0.02
#: Share of healthy training stretches that the rules call healthy.
_HEALTHY_SHARE = 0.95


def output(X):
    """The output channel of each stretch."""
    return np.asarray(X)[:, 0] if np.ndim(X) == 3 else np.asarray(X)


class Stretches:
    """`make_diagnoser` with nominal speeds that are off by a share, or without speeds.

    Parameters
    ----------
    sampling_rate : float
        In Hz.
    error : float or None, default=0.0
        The speeds of `predict` are multiplied by 1 + error and 1 - error in turn. None:
        no speeds at all.
    """

    def __init__(self, sampling_rate, error=0.0):
        self.diagnoser = make_diagnoser(sampling_rate=sampling_rate)
        self.error = error

    def fit(self, X, y, rpm):
        """Fit with the nominal speeds."""
        self.diagnoser.fit(X, y, rpm=rpm)
        return self

    def predict(self, X, rpm):
        """Conditions, with the wrong speeds."""
        if self.error is None:
            return self.diagnoser.predict(X)
        signs = np.where(np.arange(len(X)) % 2, -1, 1)
        return self.diagnoser.predict(X, rpm=rpm * (1 + self.error * signs))


class FewStretches(Stretches):
    """`make_diagnoser`, trained on the first few stretches of each condition only.

    Parameters
    ----------
    sampling_rate : float
        In Hz.
    most : int
        Stretches of a condition.
    """

    def __init__(self, sampling_rate, most):
        super().__init__(sampling_rate)
        self.most = most

    def fit(self, X, y, rpm):
        """Fit with the nominal speeds.

        Raises
        ------
        TooFew
            If there are no more stretches than those that are used anyway.
        """
        if np.unique(y, return_counts=True)[1].min() <= self.most:
            raise TooFew
        first = np.concatenate(
            [np.flatnonzero(y == name)[: self.most] for name in np.unique(y)]
        )
        return super().fit(X[first], y[first], rpm[first])


class TooFew(Exception):
    """A rig has too few stretches for a method."""


class OrdersAlone(Stretches):
    """The residual of order spectra without that of the windows."""

    def predict(self, X, rpm):
        """Return the conditions of the least residual."""
        innovations = self.diagnoser[:1].transform(X)
        residual = self.diagnoser["decide"].residual_.order_residual_
        return residual.classes_[
            residual.transform(innovations, rpm=rpm).argmin(axis=1)
        ]


class WindowsVote:
    """Classifier that adds the evidence of a classifier of windows over each stretch.

    Parameters
    ----------
    make_classifier : callable
        Makes the classifier.
    window_length : int
        Samples in a window.
    """

    def __init__(self, make_classifier, window_length):
        self.classifier = make_classifier()
        self.window_length = window_length

    def _windows(self, X):
        n = X.shape[-1] // self.window_length
        cut = X[..., : n * self.window_length].reshape(
            *X.shape[:-1], n, self.window_length
        )
        return np.moveaxis(cut, -2, 1).reshape(
            -1, *X.shape[1:-1], self.window_length
        ), n

    def fit(self, X, y, rpm):
        """Fit on the windows in the stretches."""
        windows, n = self._windows(X)
        self.classifier.fit(windows, np.repeat(y, n))
        return self

    def predict(self, X, rpm):
        """Return the conditions of most evidence."""
        windows, n = self._windows(X)
        evidence, _ = log_evidence(
            self.classifier, windows, self.classifier.predict(windows)
        )
        total = evidence.reshape(len(X), n, -1).sum(axis=1)
        return np.asarray(self.classifier.classes_)[total.argmax(axis=1)]


class _FaultOrders:
    """Classifier by the largest location score; healthy below the training threshold."""

    def __init__(self, sampling_rate, orders):
        self.sampling_rate = sampling_rate
        self.locations = {location: orders[location] for location in _LOCATIONS}

    def fit(self, X, y, rpm):
        """Compute the threshold from healthy stretches; y contains locations."""
        # Scores of different locations differ in size on healthy stretches already.
        scores = self._scores(X[y == "healthy"], rpm[y == "healthy"])
        self.threshold = np.quantile(scores, _HEALTHY_SHARE, axis=0)
        return self

    def predict(self, X, rpm):
        """Return the fault locations."""
        relative = self._scores(X, rpm) / self.threshold
        names = np.array([*self.locations, "healthy"])
        return names[
            np.where(
                relative.max(axis=1) > 1, relative.argmax(axis=1), len(self.locations)
            )
        ]

    def _scores(self, X, rpm):
        rows = zip(output(X), rpm, strict=True)
        return np.array([self._of_one(samples, speed / 60) for samples, speed in rows])


class LargestPeak(_FaultOrders):
    """Manual method of an engineer: the largest of the peaks at the orders of the faults.

    Envelope of the whole signal by the Hilbert transform, squared; its spectrum; peaks
    within 2 % of the first multiples of each order, over the median of the spectrum.
    """

    def _of_one(self, samples, rate):
        envelope = np.abs(hilbert(samples - samples.mean())) ** 2
        frequency, power = welch(envelope, self.sampling_rate, nperseg=len(envelope))
        floor = np.median(power[(frequency > rate / 2) & (frequency < 20 * rate)])
        scores = []
        for location, order in self.locations.items():
            centres = [multiple * order * rate for multiple in _LOCATIONS[location]]
            bands = [
                np.abs(frequency - c) <= max(_SLIP * c, frequency[1]) for c in centres
            ]
            scores.append(sum(power[band].max() for band in bands) / floor)
        return scores


class PyBearing(_FaultOrders):
    """Envelope analysis of pyBearing: its root mean square about each frequency of a fault.

    The library leaves the pass band to the user: here it is the upper half of the
    spectrum.
    """

    def _of_one(self, samples, rate):
        from pybearing.analysis.envelope_analysis import (
            envelope_extraction,
            rms_around_fault_frequencies_of_envelope,
        )
        from pybearing.core.fault_frequencies import FaultFrequencies

        fs = int(self.sampling_rate)
        envelope = envelope_extraction(samples, fs, (0.25 * fs, 0.49 * fs))
        frequencies = FaultFrequencies(
            f_cage=0.4 * rate,
            f_rolling_element_about_axis=self.locations["ball"] / 2 * rate,
            f_outer_ring=self.locations["outer"] * rate,
            f_rolling_element=self.locations["ball"] * rate,
            f_inner_ring=self.locations["inner"] * rate,
        )
        levels = rms_around_fault_frequencies_of_envelope(
            envelope - envelope.mean(), fs, frequencies
        )
        names = {
            "outer": "outer_ring",
            "inner": "inner_ring",
            "ball": "rolling_element",
        }
        total = np.sqrt(np.mean((envelope - envelope.mean()) ** 2))
        return [
            levels[f"rms_f_{names[location]}"] / total for location in self.locations
        ]


#: Methods that name every condition: functions of the sampling rate.
CONDITIONS = {
    "make_diagnoser, nominal rpm": Stretches,
    "rpm wrong by 3 %": lambda rate: Stretches(rate, 0.03),
    "rpm wrong by 5 %": lambda rate: Stretches(rate, 0.05),
    "rpm wrong by 10 %": lambda rate: Stretches(rate, 0.10),
    "no rpm": lambda rate: Stretches(rate, None),
    "orders alone": OrdersAlone,
    "make_diagnoser, windows of 4800 vote": lambda rate: WindowsVote(
        make_diagnoser, 4800
    ),
    "MiniRocket, windows of 1200 vote": lambda rate: WindowsVote(minirocket, 1200),
}
#: How the result depends on the amount of training.
TRAINING = {
    f"trained on {most} stretch{'es' if most > 1 else ''} of a condition": partial(
        FewStretches, most=most
    )
    for most in (1, 2, 4)
}
#: Peers that take long.
SLOW = {
    "MultiRocketHydra, windows of 1200 vote": lambda rate: WindowsVote(
        multirocket_hydra, 1200
    )
}
#: Methods that name the fault location: functions of the sampling rate and the
#: fault's orders.
RACES = {"largest peak at the orders": LargestPeak, "pyBearing, envelope": PyBearing}
