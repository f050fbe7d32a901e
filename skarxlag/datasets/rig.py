"""Acoustic emission of the simulated rig: of each defect, and of the healthy background."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import oaconvolve
from sklearn.utils import check_scalar

from skarxlag.bearings import BearingGeometry, contact_speed
from skarxlag.datasets.strikes import impact_velocity, simulate_strikes, transit_time
from skarxlag.datasets.torque import DriveTorque, simulate_torque
from skarxlag.datasets.transmission import (
    TransmissionPaths,
    friction_response,
    impulse_response,
)

__all__ = ["LOCATIONS", "Rig", "background", "defect_emission"]

LOCATIONS = ("outer", "inner", "ball")
METRES_PER_MICROMETRE = 1e-6

# Smallest and largest value of each parameter, and which of these two limits is itself allowed.
RANGES = {
    "sampling_rate": (0, np.inf, "neither"),
    "slip": (0, 0.1, "both"),
    "load_distribution": (0, np.inf, "neither"),
    "impact_level": (0, np.inf, "left"),
    "entry_ratio": (0, np.inf, "left"),
    "friction_level": (0, np.inf, "left"),
    "rubbing_level": (0, np.inf, "left"),
    "asperity_um": (0, np.inf, "neither"),
    "noise_level": (0, np.inf, "left"),
}


@dataclass(frozen=True)
class Rig:
    """The physical parameters of the simulated rig.

    `skarxlag.datasets.simulate_rig` documents each parameter with its unit, default and source.

    Parameters
    ----------
    sampling_rate : float
        Sampling rate in Hz.
    bearing : BearingGeometry
        The bearing.
    paths : TransmissionPaths
        Transmission paths from the bearing to the sensor.
    torque : DriveTorque
        Components of the drive torque.
    torque_leak : sequence of float
        Impulse response of the output to the torque, in V/(N m).
    slip, load_distribution, entry_ratio : float
        Slip, load distribution factor, and strength of the entry relative to the impact. All are
        dimensionless.
    impact_level, friction_level : float
        Levels of impacts and of friction, in V/(m/s).
    rubbing_level : float
        Level of rubbing at a crack, in V/(m/s)/mm.
    asperity_um : float
        Length of an asperity contact, in micrometres.
    noise_level : float
        RMS of the sensor noise, in V.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of its range or of another type.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.bearings import SKF_6205
    >>> from skarxlag.datasets.rig import Rig, background, defect_emission
    >>> from skarxlag.datasets.torque import DriveTorque
    >>> from skarxlag.datasets.transmission import TransmissionPaths
    >>> rig = Rig(sampling_rate=250e3, bearing=SKF_6205, paths=TransmissionPaths(),
    ...           torque=DriveTorque(), torque_leak=(0.1, -0.1), slip=0.01,
    ...           load_distribution=0.5, impact_level=0.5, entry_ratio=0.3, friction_level=0.02,
    ...           rubbing_level=0.01, asperity_um=5.0, noise_level=5e-4)
    >>> generators = {name: np.random.default_rng(seed) for seed, name in enumerate(
    ...     ("friction", "torque", "noise", "strikes", "rubbing"))}
    >>> healthy, torque = background(rig, 500.0, 24_000, generators.get)
    >>> faulty = healthy + defect_emission(rig, 500.0, "outer", 3.0, 24_000, generators.get)
    >>> bool(faulty.std() > healthy.std())
    True
    """

    sampling_rate: float
    bearing: BearingGeometry
    paths: TransmissionPaths
    torque: DriveTorque
    torque_leak: tuple[Any, ...]
    slip: float
    load_distribution: float
    impact_level: float
    entry_ratio: float
    friction_level: float
    rubbing_level: float
    asperity_um: float
    noise_level: float

    def __post_init__(self) -> None:
        for name, (least, largest, included) in RANGES.items():
            check_scalar(
                getattr(self, name),
                name,
                (int, float, np.integer, np.floating),
                min_val=least,
                max_val=largest,
                include_boundaries=included,
            )
            if np.isnan(getattr(self, name)):
                raise ValueError(f"{name} must be a number, got nan.")
        for name, expected in (
            ("bearing", BearingGeometry),
            ("paths", TransmissionPaths),
            ("torque", DriveTorque),
        ):
            if not isinstance(getattr(self, name), expected):
                raise TypeError(
                    f"{name} must be a {expected.__name__}, got {getattr(self, name)!r}."
                )
        try:
            leak = np.asarray(self.torque_leak, dtype=float)
        except (TypeError, ValueError):
            leak = np.array(np.nan)
        if leak.ndim != 1 or not np.all(np.isfinite(leak)):
            raise ValueError(
                "torque_leak must be a sequence of finite numbers in V/(N m), "
                f"got {self.torque_leak!r}."
            )


def _friction_at_sensor(rig, rpm, location, n_samples, rng):
    """Simulate the friction emission of one place; its RMS equals the gain of its path."""
    path = getattr(rig.paths, location)
    contact_time = rig.asperity_um * METRES_PER_MICROMETRE / contact_speed(rig.bearing, rpm)
    response = path.gain * friction_response(path, rig.sampling_rate, contact_time)
    source = rng.standard_normal(n_samples + len(response) - 1)
    return oaconvolve(source, response, mode="valid")


def _strikes_at_sensor(rig, rpm, location, crack_mm, n_samples, rng):
    path = getattr(rig.paths, location)
    response = path.gain * impulse_response(path, rig.sampling_rate)
    transit = transit_time(rig.bearing, rpm, crack_mm)
    # Strikes before the start of the recording still ring in it.
    lead = len(response) - 1
    times, load = simulate_strikes(
        rig.bearing,
        rpm,
        location,
        duration=n_samples / rig.sampling_rate,
        before=lead / rig.sampling_rate + transit,
        slip=rig.slip,
        load_distribution=rig.load_distribution,
        rng=rng,
    )
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
    generator: Callable[..., Any],
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
    strikes = _strikes_at_sensor(rig, rpm, location, crack_mm, n_samples, generator("strikes"))
    rubbing = _friction_at_sensor(rig, rpm, location, n_samples, generator("rubbing"))
    return strikes + rig.rubbing_level * crack_mm * contact_speed(rig.bearing, rpm) * rubbing


def background(
    rig: Rig, rpm: float, n_samples: int, generator: Callable[..., Any]
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
        _friction_at_sensor(rig, rpm, location, n_samples, rng) for location in LOCATIONS
    )
    emission = rig.friction_level * contact_speed(rig.bearing, rpm) * friction
    n_lags = len(rig.torque_leak)
    torque = simulate_torque(
        rig.torque, rpm, n_samples + n_lags, rig.sampling_rate, generator("torque")
    )
    if n_lags:
        emission += np.convolve(torque[:-1], rig.torque_leak, mode="valid")
    emission += rig.noise_level * generator("noise").standard_normal(n_samples)
    return emission, torque[n_lags:]
