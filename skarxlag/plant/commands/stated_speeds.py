"""Check of a stated speed against the lines of the shaft in the signal."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram

#: Stated speeds below this one are repeated to the reader.
_SLOW = 60.0
#: Stated speeds that may be in another unit: below the first in Hertz, above the second
#: sixty times too high. Lines cannot tell a speed from twice or half of it: of 199 right
#: speeds on eight rigs, 57 have higher lines there.
_LIKE_HERTZ = 200.0
_LIKE_SIXTY = 20_000.0
#: Multiples of the shaft's frequency that are compared, the tolerance of each, and the
#: width of its surroundings, as shares of the shaft's frequency.
_MULTIPLES = (1, 2, 3)
_TOLERANCE = 0.03
_WIDTH = 0.4
#: Frequencies in Hz whose lines are those of the mains.
_MAINS = np.array([50.0, 60.0, 100.0, 120.0])
_MAINS_TOLERANCE = 0.005
#: Mean height of lines above noise from which on they count, in dB.
_LEAST_HEIGHT = 6.0


def speed_remarks(
    samples: NDArray[Any], sampling_rate: float | None, rpm: float | None
) -> Iterator[str]:
    """Yield a remark on a speed that is slow, or was probably stated in another unit.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        The signal.
    sampling_rate : float or None
        In Hz.
    rpm : float or None
        The stated speed.

    Examples
    --------
    >>> time = np.arange(40_000) / 4_000
    >>> rng = np.random.default_rng(0)
    >>> signal = sum(np.sin(30 * np.pi * n * time) for n in (1, 2, 3)) + rng.normal(size=40_000)
    >>> [*speed_remarks(signal, 4_000, 900)]
    []
    >>> [*speed_remarks(signal, 4_000, 15)]
    ['The speed was read as 15 rpm (0.25 Hz). The signal has lines of a shaft at 900 rpm (15 Hz):
    state the speed in revolutions per minute.']
    """
    if rpm is None:
        return
    text = f"The speed was read as {rpm:g} rpm ({rpm / 60:.3g} Hz)."
    others = []
    if rpm < _LIKE_HERTZ:
        # A motor of four poles turns at half the frequency of its supply.
        others = [30 * rpm, 60 * rpm]
    elif rpm > _LIKE_SIXTY:
        others = [rpm / 60]
    heights = {rpm: _LEAST_HEIGHT}
    if sampling_rate is not None and others:
        for speed in (rpm, *others):
            heights[speed] = _line_height(samples, sampling_rate, speed / 60)
        heights[rpm] = max(heights[rpm], _LEAST_HEIGHT)
    best = max(heights, key=lambda speed: heights[speed])
    if best != rpm:
        yield (
            f"{text} The signal has lines of a shaft at {best:.4g} rpm "
            f"({best / 60:.3g} Hz): state the speed in revolutions per minute."
        )
    elif rpm < _SLOW:
        yield text


def _line_height(samples, sampling_rate, shaft):
    """Return the mean height of the lines of a shaft in dB above the highest ones of noise."""
    if not samples.size / sampling_rate * shaft * _TOLERANCE > 1 / 4:
        return -np.inf
    if max(_MULTIPLES) * shaft * (1 + _WIDTH) > sampling_rate / 2:
        return -np.inf
    if (np.abs(shaft / _MAINS - 1) < _MAINS_TOLERANCE).any():
        return -np.inf
    frequencies, power = periodogram(samples, sampling_rate, "hann")
    heights = []
    for multiple in _MULTIPLES:
        distance = np.abs(frequencies / shaft - multiple)
        near = power[distance <= multiple * _TOLERANCE]
        surroundings = np.median(power[distance <= _WIDTH])
        if len(near) == 0 or surroundings == 0:
            return -np.inf
        # The largest of n cells of noise, over their median.
        of_noise = (np.log(len(near) / 2 + 1) + 0.58) / np.log(2)
        heights.append(10 * np.log10(near.max() / surroundings / of_noise))
    return float(np.mean(heights))
