"""Drive torque of the simulated rig, which is the measured input."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["DriveTorque", "simulate_torque"]


@dataclass(frozen=True)
class DriveTorque:
    """Components of the drive torque: a mean load, three ripples and a random fluctuation.

    The word "chosen" marks values that are set for physical plausibility and have no source.

    Parameters
    ----------
    mean : float, default=2.0
        Mean load in N m. Chosen: the rated torque of a four-pole motor of about 0.37 kW.
    shaft_ripple : float, default=0.02
        Amplitude of the ripple with one period per turn of the shaft, relative to `mean`. Chosen:
        slight misalignment.
    mesh_ripple : float, default=0.01
        Amplitude of the gear mesh ripple, relative to `mean`. Chosen.
    gear_teeth : int, default=25
        Number of teeth of the gear on the shaft. It is the order of the mesh ripple. Chosen.
    electrical_ripple : float, default=0.01
        Amplitude of the motor's ripple, relative to `mean`. Chosen.
    electrical_order : float, default=12.0
        Number of periods of the motor's ripple in one turn of the shaft. The default is six times
        the supply frequency, which is the lowest torque harmonic of an inverter-fed three-phase
        motor, for a motor with two pole pairs.
    fluctuation : float, default=0.02
        RMS of the white, broadband fluctuation in N m. Chosen: 1 % of the mean load.

    Raises
    ------
    ValueError
        If a value is negative or not finite.

    Examples
    --------
    >>> from skarxlag.datasets.torque import DriveTorque
    >>> DriveTorque(mean=3.0).mean
    3.0
    """

    mean: float = 2.0
    shaft_ripple: float = 0.02
    mesh_ripple: float = 0.01
    gear_teeth: int = 25
    electrical_ripple: float = 0.01
    electrical_order: float = 12.0
    fluctuation: float = 0.02

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not np.isfinite(value) or value < 0:
                raise ValueError(f"{name} must be finite and not negative, got {value!r}.")


def simulate_torque(
    torque: DriveTorque, rpm: float, n_samples: int, sampling_rate: float, rng: np.random.Generator
) -> NDArray[Any]:
    r"""Simulate the drive torque over time.

    .. math:: u(t) = M \left(1 + \sum_i r_i \cos(2\pi o_i f_r t + \phi_i)\right) + \sigma \xi(t)

    Here M is the mean load and :math:`f_r` is the rotation rate of the shaft. The ripples have the
    amplitudes :math:`r_i`, the orders :math:`o_i` (1, gear teeth, electrical order) and the random
    phases :math:`\phi_i`. The fluctuation :math:`\xi` is white, and :math:`\sigma` is its RMS.

    Parameters
    ----------
    torque : DriveTorque
        Components of the torque.
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

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.datasets.torque import DriveTorque, simulate_torque
    >>> u = simulate_torque(DriveTorque(), 300.0, 50_000, 250e3, np.random.default_rng(0))
    >>> round(float(u.mean()), 2)
    2.0
    """
    turns = rpm / 60 * np.arange(n_samples) / sampling_rate
    ripples = (
        (torque.shaft_ripple, 1),
        (torque.mesh_ripple, torque.gear_teeth),
        (torque.electrical_ripple, torque.electrical_order),
    )
    relative = np.ones(n_samples)
    for (ripple, order), phase in zip(ripples, rng.uniform(0, 2 * np.pi, 3), strict=True):
        relative += ripple * np.cos(2 * np.pi * order * turns + phase)
    return torque.mean * relative + torque.fluctuation * rng.standard_normal(n_samples)
