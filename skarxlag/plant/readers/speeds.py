"""Shaft speeds of recordings: over time, and as texts that state them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Beginning of a source of speeds that is a channel of pulses.
TACHO = "tacho:"
#: Even times over which a mean is computed.
_N_MEAN = 1000
#: No shaft turns faster: a slow machine may have three digits before a point.
HIGHEST_RPM = 1e5


def is_speed_source(text: str) -> bool:
    """Return whether a text names a channel of pulses or a log of speeds.

    Examples
    --------
    >>> [is_speed_source(text) for text in ("tacho:pulses", "speeds.csv", "900")]
    [True, True, False]
    """
    return text.startswith(TACHO) or text.lower().endswith(".csv")


class SpeedProfile(NamedTuple):
    """Shaft speed of a recording over time.

    Attributes
    ----------
    seconds : ndarray of shape (n_times,)
        Times since the first sample, ascending.
    rpm : ndarray of shape (n_times,)
        Speeds. They are interpolated linearly between the times, and constant beyond
        them.

    Examples
    --------
    >>> profile = SpeedProfile(np.array([0.0, 1.0]), np.array([600.0, 900.0]))
    >>> profile.rows(np.array([0, 20]), 20, sampling_rate=40)[:, [0, 10]]
    array([[600., 675.],
           [750., 825.]])
    """

    seconds: NDArray[Any]
    rpm: NDArray[Any]

    def mean(self) -> float:
        """Return the mean over time."""
        even = np.linspace(self.seconds[0], self.seconds[-1], _N_MEAN)
        return float(np.interp(even, *self).mean())

    def rows(
        self, start: NDArray[Any], n_samples: int, sampling_rate: float
    ) -> NDArray[Any]:
        """Return the speeds of rows at each sample.

        Parameters
        ----------
        start : ndarray of int of shape (n_rows,)
            Position of the first sample of each row in the recording.
        n_samples : int
            Samples in a row.
        sampling_rate : float
            In Hz.

        Returns
        -------
        ndarray of shape (n_rows, n_samples)
        """
        samples = np.asarray(start)[:, np.newaxis] + np.arange(n_samples)
        return np.interp(samples / sampling_rate, *self)
