"""Transmission paths of the simulated rig: from a source in the bearing to the sensor."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

__all__ = ["TransmissionPath", "TransmissionPaths", "friction_response", "impulse_response"]

# Where the slowest mode is 120 dB down, the response is cut.
DECAY = np.log(1e6)


@dataclass(frozen=True)
class TransmissionPath:
    """Decaying resonances between a source and the sensor.

    Parameters
    ----------
    frequencies : tuple of float
        Natural frequencies of the modes, in Hz.
    damping : tuple of float
        Damping ratio of each mode, in (0, 1).
    amplitudes : tuple of float
        Participation of each mode, dimensionless; only their ratios count.
    gain : float
        Transmission of the path, dimensionless, >= 0 (1 for a source next to the sensor).
    delay : float
        Travel time to the sensor, in seconds, >= 0.

    Raises
    ------
    ValueError
        If the modes are not given alike, or a value is out of range.

    Examples
    --------
    >>> from skarxlag.datasets.transmission import TransmissionPath
    >>> TransmissionPath((20e3,), (0.02,), (1.0,), gain=0.5, delay=0.0).gain
    0.5
    """

    frequencies: tuple[Any, ...]
    damping: tuple[Any, ...]
    amplitudes: tuple[Any, ...]
    gain: float
    delay: float

    def __post_init__(self) -> None:
        n_modes = len(self.frequencies)
        for name in ("frequencies", "damping", "amplitudes"):
            values = getattr(self, name)
            if len(values) != n_modes or n_modes == 0 or not np.all(np.isfinite(values)):
                raise ValueError(
                    f"{name} must hold one finite number for each of {n_modes} modes (at least "
                    f"one), got {values!r}."
                )
        if min(self.frequencies) <= 0:
            raise ValueError(f"frequencies must be positive, got {self.frequencies!r}.")
        if min(self.damping) <= 0 or max(self.damping) >= 1:
            raise ValueError(f"damping must lie in (0, 1), got {self.damping!r}.")
        if not any(self.amplitudes):
            raise ValueError(f"amplitudes must not all be zero, got {self.amplitudes!r}.")
        for name in ("gain", "delay"):
            value = getattr(self, name)
            if not np.isfinite(value) or value < 0:
                raise ValueError(f"{name} must be finite and not negative, got {value!r}.")


def _default_outer():
    return TransmissionPath(
        frequencies=(7_400.0, 14_100.0, 22_800.0, 33_500.0, 60_000.0),
        damping=(0.015, 0.015, 0.015, 0.015, 0.05),
        amplitudes=(1.0, 1.0, 1.0, 1.0, 0.5),
        gain=1.0,
        delay=5e-6,
    )


def _default_inner():
    return TransmissionPath(
        frequencies=(9_800.0, 27_900.0, 53_400.0, 60_000.0, 86_400.0),
        damping=(0.03, 0.03, 0.03, 0.05, 0.03),
        amplitudes=(1.0, 1.0, 1.0, 0.5, 1.0),
        gain=0.4,
        delay=15e-6,
    )


def _default_ball():
    return TransmissionPath(
        frequencies=(14_100.0, 30_000.0, 53_400.0, 60_000.0),
        damping=(0.025, 0.025, 0.025, 0.05),
        amplitudes=(1.0, 1.0, 1.0, 0.5),
        gain=0.6,
        delay=10e-6,
    )


@dataclass(frozen=True)
class TransmissionPaths:
    r"""The transmission path of each place in the bearing where emission arises.

    The default is built for the SKF 6205 bearing. Rings: free in-plane bending modes of a steel
    ring, n = 3-6 of the outer ring (mean radius 24.74 mm, thickness 2.51 mm) and n = 2-5 of the
    inner ring (14.02 mm, 3.05 mm), :math:`f_n = \frac{c h}{2 \pi \sqrt{12} R^2}
    \frac{n (n^2 - 1)}{\sqrt{n^2 + 1}}` [1]_ with c = 5150 m/s, rounded to 100 Hz. Ball: 30 kHz
    is the resonance of a ball of 2.04 g on two Hertzian contacts of 3.6e7 N/m (some 100 N), and it
    excites a mode of either ring. 60 kHz in every path is the resonance of a low-frequency
    acoustic emission sensor. Damping, participation and gain are chosen: 1.5 % for a
    ring fitted in its housing, more for every oiled contact on the way (2.5 % for a ball,
    3 % for the inner ring), and a loss of 4 dB for each contact. The delays are 15, 30 and 45 mm
    at 3000 m/s.

    Parameters
    ----------
    outer, inner, ball : TransmissionPath
        Path of a source at the outer raceway, at the inner raceway and at a ball.

    References
    ----------
    .. [1] A. E. H. Love, "A Treatise on the Mathematical Theory of Elasticity", 4th ed., 1927,
       section 293.

    Examples
    --------
    >>> from skarxlag.datasets.transmission import TransmissionPaths
    >>> paths = TransmissionPaths()
    >>> paths.outer.gain > paths.ball.gain > paths.inner.gain
    True
    """

    outer: TransmissionPath = field(default_factory=_default_outer)
    inner: TransmissionPath = field(default_factory=_default_inner)
    ball: TransmissionPath = field(default_factory=_default_ball)


def impulse_response(path: TransmissionPath, sampling_rate: float) -> NDArray[Any]:
    r"""Response of a path to a unit impulse, scaled to a peak of 1.

    .. math::

        h(t) \propto \sum_m a_m e^{-2\pi\zeta_m f_m (t - \tau)}
        \sin\left(2\pi f_m \sqrt{1-\zeta_m^2}\,(t - \tau)\right), \quad t \ge \tau

    with modes :math:`f_m, \zeta_m, a_m` and the delay :math:`\tau` rounded to a sample. The
    gain of the path is not applied.

    Parameters
    ----------
    path : TransmissionPath
        The path.
    sampling_rate : float
        In Hz; more than twice every natural frequency.

    Returns
    -------
    response : ndarray of shape (n_taps,)
        The response from the impulse until it is 120 dB down.

    Raises
    ------
    ValueError
        If a natural frequency is not below half the sampling rate.

    Examples
    --------
    >>> from skarxlag.datasets.transmission import TransmissionPath, impulse_response
    >>> path = TransmissionPath((20e3,), (0.05,), (1.0,), gain=0.5, delay=8e-6)
    >>> response = impulse_response(path, 250e3)
    >>> response[:3].tolist()
    [0.0, 0.0, 0.0]
    >>> float(abs(response).max())
    1.0
    """
    frequencies, damping, amplitudes = (
        np.asarray(values, dtype=float)[:, None]
        for values in (path.frequencies, path.damping, path.amplitudes)
    )
    if frequencies.max() >= sampling_rate / 2:
        raise ValueError(
            f"frequencies of a transmission path must lie below sampling_rate / 2 = "
            f"{sampling_rate / 2:g} Hz, got {path.frequencies!r}."
        )
    decay = 2 * np.pi * damping * frequencies
    time = np.arange(np.ceil(DECAY / decay.min() * sampling_rate)) / sampling_rate
    ringing = np.sin(2 * np.pi * frequencies * np.sqrt(1 - damping**2) * time)
    response = np.sum(amplitudes * np.exp(-decay * time) * ringing, axis=0)
    lead = np.zeros(round(path.delay * sampling_rate))
    return np.concatenate([lead, response / np.abs(response).max()])


def friction_response(
    path: TransmissionPath, sampling_rate: float, contact_time: float
) -> NDArray[Any]:
    r"""Filter that colours white noise into friction emission, scaled to unit RMS at its output.

    Asperities in contact for a time :math:`\tau_c` emit pulses of about that length, so the
    source has the low-pass spectrum :math:`1 / (1 + (2 \pi f \tau_c)^2)` before it passes the path:
    the faster the contact, the wider its spectrum [1]_.

    Parameters
    ----------
    path : TransmissionPath
        The path.
    sampling_rate : float
        In Hz.
    contact_time : float
        Duration of an asperity contact, in seconds, > 0.

    Returns
    -------
    response : ndarray of shape (n_taps,)
        Impulse response of unit energy. The gain of the path is not applied.

    References
    ----------
    .. [1] Y. Fan, F. Gu, A. Ball, "Modelling acoustic emissions generated by sliding
       friction", Wear 268 (2010).

    Examples
    --------
    >>> from skarxlag.datasets.transmission import TransmissionPaths, friction_response
    >>> response = friction_response(TransmissionPaths().inner, 250e3, 1e-5)
    >>> round(float(response @ response), 6)
    1.0
    """
    pole = np.exp(-1 / (contact_time * sampling_rate))
    response = lfilter([1.0], [1.0, -pole], impulse_response(path, sampling_rate))
    return response / np.linalg.norm(response)
