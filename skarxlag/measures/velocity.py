"""RMS of the vibration velocity, if the unit of a signal is known."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Range in Hz of the velocity that ISO 20816-1 evaluates on most machines.
BAND = (10.0, 1000.0)
#: Factor to mm/s^2 or mm/s, and whether the quantity is an acceleration.
_UNITS = {
    "m/s2": (1e3, True),
    "mm/s2": (1.0, True),
    "g": (9806.65, True),
    "m/s": (1e3, False),
    "mm/s": (1.0, False),
}


def velocity_rms(
    samples: NDArray[Any], sampling_rate: float | None, unit: str | None
) -> float | None:
    r"""Compute the RMS of the velocity from 10 to 1000 Hz, as ISO 20816 evaluates it.

    With the power density :math:`S_a` of an acceleration, that of the velocity is
    :math:`S_a / (2 \pi f)^2`. The RMS is the root of its integral.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        Acceleration or velocity.
    sampling_rate : float or None
        In Hz.
    unit : str or None
        Unit of the samples, as `plain_unit` returns it.

    Returns
    -------
    float or None
        In mm/s. None if the unit is not known, the sampling rate is below 2000 Hz, or
        the samples take less than half a second.

    Examples
    --------
    An acceleration of 1 m/s^2 peak at 50 Hz has a velocity of 1000 / (100 pi) mm/s:

    >>> time = np.arange(20_000) / 10_000
    >>> acceleration = np.sin(2 * np.pi * 50 * time)
    >>> rms = velocity_rms(acceleration, 10_000, "m/s2")
    >>> round(rms, 3), round(float(1000 / (100 * np.pi) / np.sqrt(2)), 3)
    (2.251, 2.251)
    """
    if unit not in _UNITS or sampling_rate is None or sampling_rate < 2 * BAND[1]:
        return None
    if len(samples) < sampling_rate / 2:
        return None
    from scipy.signal import welch

    segment = min(int(sampling_rate), len(samples))
    frequencies, power = welch(samples, sampling_rate, nperseg=segment)
    is_inside = (frequencies >= BAND[0]) & (frequencies <= BAND[1])
    power = power[is_inside]
    frequencies = frequencies[is_inside]
    factor, is_acceleration = _UNITS[unit]
    if is_acceleration:
        power = power / (2 * np.pi * frequencies) ** 2
    step = sampling_rate / segment
    return float(factor * np.sqrt(power.sum() * step))
