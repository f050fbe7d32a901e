"""Transmission paths of the simulated rig, from a source in the bearing to the sensor."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from skarxlag.core.state import expect
from skarxlag.core.validation import check_real

# A response is cut off where its slowest mode has decayed by 120 dB.
DECAY = np.log(1e6)


@dataclass(frozen=True)
class TransmissionPath:
    """Transmission path between a source and the sensor, as a sum of decaying resonances.

    Parameters
    ----------
    frequencies : tuple of float
        Natural frequencies of the modes, in Hz.
    damping : tuple of float
        Damping ratio of each mode, in (0, 1).
    amplitudes : tuple of float
        Participation of each mode, dimensionless. Only the ratios of these values
        matter.
    gain : float
        Transmission of the path, dimensionless, >= 0 (1 for a source next to the
        sensor).
    delay : float
        Travel time to the sensor, in seconds, >= 0.

    Raises
    ------
    ValueError, TypeError
        If the three tuples differ in length, or a value is out of range or of another
        type.

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
        n_modes = max(len(self.frequencies), 1)
        bounds = {
            "frequencies": (0, np.inf),
            "damping": (0, 1),
            "amplitudes": (-np.inf, np.inf),
        }
        for name, (least, largest) in bounds.items():
            values = np.array(getattr(self, name))
            fits = values.shape == (n_modes,) and (values > least) & (values < largest)
            expected = (
                f"one number in ({least:g}, {largest:g}) for each of {n_modes} modes"
            )
            expect(fits, name, getattr(self, name), expected)
        expect(any(self.amplitudes), "amplitudes", self.amplitudes, "not only zeros")
        check_real(self.gain, "gain", min_val=0)
        check_real(self.delay, "delay", min_val=0)


@dataclass(frozen=True)
class TransmissionPaths:
    r"""Transmission path of each location in the bearing where emission arises.

    The defaults describe the SKF 6205 bearing.

    - Rings: the natural frequencies are those of the free in-plane bending modes of a
      steel ring, :math:`f_n = \frac{c h}{2 \pi \sqrt{12} R^2} \frac{n (n^2 -
      1)}{\sqrt{n^2 + 1}}` [1]_ with c = 5150 m/s, rounded to 100 Hz. The modes are n =
      3-6 of the outer ring (mean radius R = 24.74 mm, thickness h = 2.51 mm) and n =
      2-5 of the inner ring (14.02 mm, 3.05 mm).
    - Ball: 30 kHz is the resonance of a ball of 2.04 g on two Hertzian contacts of
      3.6e7 N/m each (at a load of about 100 N). A source at a ball also excites one
      mode of each ring.
    - Sensor: 60 kHz in every path is the resonance of a low-frequency acoustic emission
      sensor.
    - Damping, participation and gain have no source; they are chosen. The damping is
      1.5 % for a ring that is fitted in its housing. It is larger for every oiled
      contact on the way (2.5 % for a ball, 3 % for the inner ring). Each contact causes
      a loss of 4 dB.
    - The delays are the travel times at 3000 m/s over 15 mm (outer), 30 mm (ball) and
      45 mm (inner).

    Parameters
    ----------
    outer, inner, ball : TransmissionPath
        Path of a source at the outer raceway, at the inner raceway and at a ball.

    References
    ----------
    .. [1] A. E. H. Love, "A Treatise on the Mathematical Theory of Elasticity", 4th
           ed., 1927, section 293.

    Examples
    --------
    >>> from skarxlag.datasets.transmission import TransmissionPaths
    >>> paths = TransmissionPaths()
    >>> paths.outer.gain > paths.ball.gain > paths.inner.gain
    True
    """

    outer: TransmissionPath = TransmissionPath(
        frequencies=(7_400.0, 14_100.0, 22_800.0, 33_500.0, 60_000.0),
        damping=(0.015, 0.015, 0.015, 0.015, 0.05),
        amplitudes=(1.0, 1.0, 1.0, 1.0, 0.5),
        gain=1.0,
        delay=5e-6,
    )
    inner: TransmissionPath = TransmissionPath(
        frequencies=(9_800.0, 27_900.0, 53_400.0, 60_000.0, 86_400.0),
        damping=(0.03, 0.03, 0.03, 0.05, 0.03),
        amplitudes=(1.0, 1.0, 1.0, 0.5, 1.0),
        gain=0.4,
        delay=15e-6,
    )
    ball: TransmissionPath = TransmissionPath(
        frequencies=(14_100.0, 30_000.0, 53_400.0, 60_000.0),
        damping=(0.025, 0.025, 0.025, 0.05),
        amplitudes=(1.0, 1.0, 1.0, 0.5),
        gain=0.6,
        delay=10e-6,
    )


#: The paths of the simulated rig if no others are given.
DEFAULT_PATHS = TransmissionPaths()


def impulse_response(path: TransmissionPath, sampling_rate: float) -> NDArray[Any]:
    r"""Compute the response of a path to a unit impulse, scaled to a peak of 1.

    .. math::

        h(t) \propto \sum_m a_m e^{-2\pi\zeta_m f_m (t - \tau)}
        \sin\left(2\pi f_m \sqrt{1-\zeta_m^2}\,(t - \tau)\right), \quad t \ge \tau

    Mode m has the natural frequency :math:`f_m`, the damping ratio :math:`\zeta_m` and
    the participation :math:`a_m`. The delay :math:`\tau` is rounded to a whole sample.
    The gain of the path is not applied.

    Parameters
    ----------
    path : TransmissionPath
        The path.
    sampling_rate : float
        Sampling rate in Hz. It must be more than twice every natural frequency.

    Returns
    -------
    response : ndarray of shape (n_taps,)
        The response from the impulse until it has decayed by 120 dB.

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
    modes = np.array([path.frequencies, path.damping, path.amplitudes], dtype=float)
    frequencies, damping, amplitudes = modes[..., np.newaxis]
    expected = f"frequencies below sampling_rate / 2 = {sampling_rate / 2:g} Hz"
    expect(frequencies < sampling_rate / 2, "frequencies", path.frequencies, expected)
    decay = 2 * np.pi * damping * frequencies
    time = np.arange(np.ceil(DECAY / decay.min() * sampling_rate)) / sampling_rate
    ringing = np.sin(2 * np.pi * frequencies * np.sqrt(1 - damping**2) * time)
    response = np.sum(amplitudes * np.exp(-decay * time) * ringing, axis=0)
    lead = np.zeros(round(path.delay * sampling_rate))
    return np.concatenate([lead, response / np.abs(response).max()])


def friction_response(
    path: TransmissionPath, sampling_rate: float, contact_time: float
) -> NDArray[Any]:
    r"""Compute the filter that turns white noise into friction emission of unit RMS.

    Asperities that are in contact for a time :math:`\tau_c` emit pulses of about this
    duration. The source therefore has the low-pass spectrum :math:`1 / (1 + (2 \pi f
    \tau_c)^2)` before the transmission path. A faster contact is shorter and gives a
    wider spectrum [1]_.

    Parameters
    ----------
    path : TransmissionPath
        The path.
    sampling_rate : float
        Sampling rate in Hz.
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
