"""The simulated rig: the emission of each defect, the healthy background, and the torque."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import oaconvolve
from sklearn.utils import check_scalar

from skarxlag.bearings import SKF_6205, BearingGeometry, contact_speed
from skarxlag.core.state import expect
from skarxlag.core.validation import ABOVE_0, check_real
from skarxlag.datasets.strikes import impact_velocity, simulate_strikes, transit_time
from skarxlag.datasets.transmission import (
    DEFAULT_PATHS,
    TransmissionPaths,
    friction_response,
    impulse_response,
)

_Generators = Callable[[str], np.random.Generator]
LOCATIONS = ("outer", "inner", "ball")
METRES_PER_MICROMETRE = 1e-6
#: Mean drive torque in N m: the rated torque of a four-pole motor of about 0.37 kW.
MEAN_TORQUE = 2.0
#: Amplitude relative to the mean, and order of the shaft, of each ripple:
#: misalignment, a gear mesh, and the lowest harmonic of an inverter-fed motor of two
#: pole pairs.
TORQUE_RIPPLES = ((0.02, 1), (0.01, 25), (0.01, 12))
#: RMS of the white fluctuation of the torque in N m.
TORQUE_FLUCTUATION = 0.02


@dataclass(frozen=True)
class Rig:
    """Physical parameters of the simulated rig.

    The word "chosen" marks a value that is set for physical plausibility and has no
    source.

    Parameters
    ----------
    sampling_rate : float, default=250_000.0
        Sampling rate in Hz. Source: [1]_, section 2.
    bearing : BearingGeometry, default=SKF_6205
        The bearing. The default is the SKF 6205-2RS JEM, the drive-end bearing of the
        Case Western Reserve University data, with the dimensions published there.
    paths : TransmissionPaths, default=TransmissionPaths()
        Resonances, gain and delay between each location and the sensor. The class
        states the sources.
    torque_leak : sequence of float, default=(0.10, 0.05, -0.05, -0.10)
        Response of the output to the torque 1, 2, ... samples earlier, in V/(N m). An
        empty sequence means no leak. Chosen: the values sum to zero, because amplifiers
        of acoustic emission block the mean.
    slip : float, default=0.01
        Standard deviation of the interval between two strikes relative to its mean, in
        [0, 0.1]. Source: 1 to 2 % is usual [2]_.
    load_distribution : float, default=0.5
        Load distribution factor, > 0. Source: 0.5 for a bearing without clearance [3]_.
    impact_level : float, default=0.5
        Peak output for a unit velocity of impact through a path of unit gain, in
        V/(m/s). Chosen: the bursts of a crack of 3 mm in the outer ring at 500 rpm are
        about 14 dB above the continuous emission.
    entry_ratio : float, default=0.3
        Strength of the strike at the entry into a crack, relative to the impact at its
        end. Chosen; the entry is weaker than the impact [4]_.
    friction_level : float, default=0.02
        RMS output from friction at one location for a unit contact speed through a path
        of unit gain, in V/(m/s). Chosen: about 10 mV at 500 rpm behind a preamplifier of
        40 dB. The RMS of acoustic emission grows with the speed [5]_.
    rubbing_level : float, default=0.01
        RMS output from rubbing at a defect for each millimetre of its crack, for a unit
        contact speed through a path of unit gain, in V/(m/s)/mm. Chosen; the RMS grows
        with the defect [5]_.
    asperity_um : float, default=5.0
        Length of an asperity contact in micrometres, > 0. Together with the contact
        speed it determines the corner frequency of the friction spectrum (see
        `skarxlag.datasets.transmission.friction_response`). Chosen: a ground raceway.
    noise_level : float, default=5e-4
        RMS of the sensor noise in V. Chosen: 5 uV at the input of a preamplifier of 40
        dB.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range or of another type.

    References
    ----------
    .. [1] F. Piltan, J.-M. Kim, "Nonlinear Extended-state ARX-Laguerre PI Observer
           Fault Diagnosis of Bearings", Applied Sciences 9(5), 888, 2019.
    .. [2] R. B. Randall, J. Antoni, "Rolling element bearing diagnostics - a tutorial",
           Mechanical Systems and Signal Processing 25, 2011.
    .. [3] T.A. Harris, M.N. Kotzalas, "Rolling Bearing Analysis", 5th ed., 2006.
    .. [4] N. Sawalhi, R. B. Randall, "Vibration response of spalled rolling element
           bearings: observations, simulations and signal processing techniques to track
           the spall size", Mechanical Systems and Signal Processing 25, 2011.
    .. [5] A. M. Al-Ghamd, D. Mba, "A comparative experimental study on the use of
           acoustic emission and vibration analysis for bearing defect identification
           and estimation of defect size", Mechanical Systems and Signal Processing 20,
           2006.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.datasets.rig import Rig, background, defect_emission
    >>> rig = Rig(noise_level=0.0)
    >>> generators = {name: np.random.default_rng(seed) for seed, name in enumerate(
    ...     ("friction", "torque", "noise", "strikes", "rubbing"))}
    >>> healthy, torque = background(rig, 500.0, 24_000, generators.get)
    >>> faulty = healthy + defect_emission(rig, 500.0, "outer", 3.0, 24_000, generators.get)
    >>> bool(faulty.std() > healthy.std())
    True
    """

    sampling_rate: float = 250_000.0
    bearing: BearingGeometry = SKF_6205
    paths: TransmissionPaths = DEFAULT_PATHS
    torque_leak: Sequence[float] = (0.10, 0.05, -0.05, -0.10)
    slip: float = 0.01
    load_distribution: float = 0.5
    impact_level: float = 0.5
    entry_ratio: float = 0.3
    friction_level: float = 0.02
    rubbing_level: float = 0.01
    asperity_um: float = 5.0
    noise_level: float = 5e-4

    def __post_init__(self) -> None:
        for name in ("sampling_rate", "load_distribution", "asperity_um"):
            check_real(getattr(self, name), name, **ABOVE_0)
        for name in ("impact", "friction", "rubbing", "noise"):
            check_real(getattr(self, f"{name}_level"), f"{name}_level", min_val=0)
        check_real(self.entry_ratio, "entry_ratio", min_val=0)
        check_real(self.slip, "slip", min_val=0, max_val=0.1)
        check_scalar(self.bearing, "bearing", BearingGeometry)
        check_scalar(self.paths, "paths", TransmissionPaths)
        leak = np.asarray(self.torque_leak)
        fits = leak.ndim == 1 and leak.dtype.kind in "fiu" and np.isfinite(leak)
        expect(fits, "torque_leak", self.torque_leak, "finite numbers")


#: The rig of `simulate_rig` if no other is given.
DEFAULT_RIG = Rig()


def _friction_at_sensor(rig, rpm, location, n_samples, rng):
    """Simulate the friction emission of one location; its RMS equals the gain of its path."""
    path = getattr(rig.paths, location)
    contact_time = (
        rig.asperity_um * METRES_PER_MICROMETRE / contact_speed(rig.bearing, rpm)
    )
    response = path.gain * friction_response(path, rig.sampling_rate, contact_time)
    source = rng.standard_normal(n_samples + len(response) - 1)
    return oaconvolve(source, response, mode="valid")


def _strikes_at_sensor(rig, rpm, location, crack_mm, n_samples, rng):
    path = getattr(rig.paths, location)
    response = path.gain * impulse_response(path, rig.sampling_rate)
    transit = transit_time(rig.bearing, rpm, crack_mm)
    # Strikes before the start of the recording still ring in it.
    lead = len(response) - 1
    duration = n_samples / rig.sampling_rate
    before = lead / rig.sampling_rate + transit
    times, load = simulate_strikes(rig, rpm, location, duration, before, rng)
    peak = rig.impact_level * impact_velocity(rig.bearing, rpm, crack_mm)
    train = np.zeros(n_samples + lead)
    for delay, strength in ((0.0, rig.entry_ratio * peak), (transit, peak)):
        index = np.floor((times + delay) * rig.sampling_rate).astype(int) + lead
        inside = (index >= 0) & (index < len(train))
        np.add.at(train, index[inside], strength * load[inside])
    return oaconvolve(train, response, mode="valid")


def defect_emission(
    rig: Rig,
    rpm: float,
    location: str,
    crack_mm: float,
    n_samples: int,
    generator: _Generators,
) -> NDArray[Any]:
    r"""Simulate the emission of one defect at the sensor: its strikes, and rubbing at its crack.

    .. math:: y_d = h_d * s_d + c\,w_d\,v\,(g_d * \xi_d)

    `skarxlag.datasets.simulate_rig` defines the symbols.

    Parameters
    ----------
    rig : Rig
        The physical parameters.
    rpm : float
        Speed of the shaft, in revolutions per minute.
    location : {"outer", "inner", "ball"}
        Location of the defect.
    crack_mm : float
        Width of the crack along the rolling direction, in mm.
    n_samples : int
        Number of samples.
    generator : callable
        Function that returns a `numpy.random.Generator` for the name of a random stream
        ("strikes" or "rubbing").

    Returns
    -------
    emission : ndarray of shape (n_samples,)
        Emission in V.
    """
    strikes = _strikes_at_sensor(
        rig, rpm, location, crack_mm, n_samples, generator("strikes")
    )
    rubbing = _friction_at_sensor(rig, rpm, location, n_samples, generator("rubbing"))
    return (
        strikes
        + rig.rubbing_level * crack_mm * contact_speed(rig.bearing, rpm) * rubbing
    )


def background(
    rig: Rig, rpm: float, n_samples: int, generator: _Generators
) -> tuple[NDArray[Any], NDArray[Any]]:
    r"""Simulate the background, which is the part of a recording that no defect causes.

    .. math::

        y_0(k) = \sum_l b\,v\,(g_l * \xi'_l)(k)
        + \sum_{i \ge 1} \beta_i\, u(k - i) + \sigma\eta(k)

    `skarxlag.datasets.simulate_rig` defines the symbols.

    Parameters
    ----------
    rig : Rig
        The physical parameters.
    rpm : float
        Speed of the shaft, in revolutions per minute.
    n_samples : int
        Number of samples.
    generator : callable
        Function that returns a `numpy.random.Generator` for the name of a random stream
        ("friction", "torque" or "noise").

    Returns
    -------
    emission : ndarray of shape (n_samples,)
        Friction, torque leak and sensor noise, in V.
    torque : ndarray of shape (n_samples,)
        Drive torque in N m.
    """
    rng = generator("friction")
    friction = sum(
        _friction_at_sensor(rig, rpm, location, n_samples, rng)
        for location in LOCATIONS
    )
    emission = rig.friction_level * contact_speed(rig.bearing, rpm) * friction
    n_lags = len(rig.torque_leak)
    torque = drive_torque(
        rpm, n_samples + n_lags, rig.sampling_rate, generator("torque")
    )
    if n_lags:
        emission += np.convolve(torque[:-1], rig.torque_leak, mode="valid")
    emission += rig.noise_level * generator("noise").standard_normal(n_samples)
    return emission, torque[n_lags:]


def drive_torque(
    rpm: float, n_samples: int, sampling_rate: float, rng: np.random.Generator
) -> NDArray[Any]:
    r"""Simulate the drive torque over time.

    .. math:: u(t) = M \left(1 + \sum_i r_i \cos(2\pi o_i f_r t + \phi_i)\right) + \sigma \xi(t)

    Here M is the mean load and :math:`f_r` is the rotation rate of the shaft. The
    ripples have the amplitudes :math:`r_i`, the orders :math:`o_i` and the random
    phases :math:`\phi_i`. The fluctuation :math:`\xi` is white, and :math:`\sigma` is
    its RMS. All values are chosen.

    Parameters
    ----------
    rpm : float
        Speed of the shaft, in revolutions per minute.
    n_samples : int
        Number of samples.
    sampling_rate : float
        Sampling rate in Hz.
    rng : numpy.random.Generator
        Generator of the random phases and of the fluctuation.

    Returns
    -------
    torque : ndarray of shape (n_samples,)
        Torque in N m.
    """
    revolutions = rpm / 60 * np.arange(n_samples) / sampling_rate
    ripples, orders = np.transpose(TORQUE_RIPPLES)
    phases = rng.uniform(0, 2 * np.pi, len(ripples))
    angles = 2 * np.pi * np.outer(orders, revolutions) + phases[:, np.newaxis]
    relative = 1 + ripples @ np.cos(angles)
    return MEAN_TORQUE * relative + TORQUE_FLUCTUATION * rng.standard_normal(n_samples)
