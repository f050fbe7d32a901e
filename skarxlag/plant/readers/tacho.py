"""Speed of a shaft from the pulses of a tachometer that arrive in blocks."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...measures.measured_speeds import pulse_levels, pulse_times

#: Seconds on which the levels of pulses in a stream are measured. Two pulses in this
#: time are a speed.
_TACHO_SECONDS = 4.0


class TachoStream:
    """Speed of a shaft from the pulses of a tachometer that arrive in blocks.

    The speed at a sample follows from the last two pulses before it, or from the time
    since the last pulse if that is longer. The levels of a pulse are those of
    :func:`rpm_from_tacho` in the last complete four seconds, unless their range is less
    than half of the range before: the shaft then stands still. The speeds do not depend
    on how the signal is cut into blocks.

    Parameters
    ----------
    sampling_rate : float
        In Hz.
    pulses : int
        Pulses in a revolution of the shaft.

    Examples
    --------
    >>> pulses = np.arange(10_000) % 100 < 10              # at 1000 Hz, 10 in a second
    >>> tacho = TachoStream(1000.0, pulses=2)
    >>> speeds = np.concatenate([tacho.speeds(part) for part in np.split(pulses * 1.0, 4)])
    >>> speeds[3999], speeds[5000:].round(6).tolist() == [300.0] * 5000
    (np.float64(nan), True)
    """

    def __init__(self, sampling_rate: float, pulses: int) -> None:
        self._n = int(_TACHO_SECONDS * sampling_rate)
        self._scale = 60 * sampling_rate / pulses
        self._signal = np.empty(0)
        self._levels = (0.0, 0.0)

    def speeds(self, signal: NDArray[Any]) -> NDArray[Any]:
        """Return the speed at each of the next samples, NaN if it is not known."""
        signal = pd.Series(signal).ffill().fillna(0.0).to_numpy()
        speeds = []
        first = self._n - len(self._signal) % self._n
        for part in np.split(signal, range(first, len(signal), self._n)):
            self._signal = np.append(self._signal, part)
            speeds.append(self._speeds_of_last(len(part)))
            if len(self._signal) in (self._n, 2 * self._n):
                self._signal = self._signal[-self._n :]
                quarter, middle = pulse_levels(self._signal)
                if middle - quarter >= 0.5 * (self._levels[1] - self._levels[0]):
                    self._levels = quarter, middle
        return np.concatenate(speeds)

    def _speeds_of_last(self, n_new):
        times = pulse_times(self._signal, *self._levels)
        if len(times) < 2:
            return np.full(n_new, np.nan)
        samples = np.arange(len(self._signal) - n_new, len(self._signal))
        last = np.searchsorted(times, samples) - 1
        intervals = np.diff(times)[np.maximum(last - 1, 0)]
        intervals = np.maximum(intervals, samples - times[last])
        return np.where(last > 0, self._scale / intervals, np.nan)
