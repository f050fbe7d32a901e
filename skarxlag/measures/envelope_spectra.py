"""Envelope spectra: that of a signal, and the combs of bearing faults in those of rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_array

from ..core.parallel import map_rows
from ..core.speeds import check_speeds, with_plausible_speeds
from ..core.state import expect
from ..core.validation import ABOVE_0, as_samples, check_real
from ..kernels.comb import comb_frequency
from ..kernels.fault_orders import squared_envelope_spectrum

#: Revolutions of the bearing's shaft that a row must have.
LEAST_REVOLUTIONS = 2
#: Multiples of the shaft's frequency in a search of its speed.
_N_HARMONICS = 40


def impact_orders(orders: NDArray[Any]) -> NDArray[Any]:
    """Return the orders of impacts of faults.

    A fault of a rolling element hits both rings in each revolution of the element.

    Parameters
    ----------
    orders : ndarray of shape (n_bearings, 4)
        Orders of the cage (FTF), the spin of an element (BSF), the inner race (BPFI)
        and the outer race (BPFO).

    Returns
    -------
    ndarray of shape (n_bearings, 3)
        Orders of ball, inner and outer race.
    """
    return orders[:, 1:] * [2, 1, 1]


def samples_per_revolution_of_rows(
    X: NDArray[Any],
    sampling_rate: float,
    rpm: ArrayLike | None,
    speed_range: tuple[float, float] | None,
    least_revolutions: float,
    train_rpm: Sequence[float] = (),
) -> NDArray[Any]:
    """Return the samples in a revolution of each row of shape (1, n_samples).

    They are NaN for rows without a plausible speed, of less than two revolutions, or
    too short for a search of the speed.

    Raises
    ------
    ValueError
        If `rpm` has neither one speed for each row, nor one for each of their samples.
    """
    n_rows, _, length = X.shape
    rpm, is_plausible = with_plausible_speeds(rpm, n_rows, train_rpm)
    if rpm is not None:
        speeds = check_speeds(rpm, n_rows, length)
        mean_speeds = speeds.reshape(n_rows, -1).mean(axis=1)
        n_revolutions = length * mean_speeds / (60 * sampling_rate)
        is_usable = (
            is_plausible
            & (n_revolutions >= least_revolutions)
            & (n_revolutions <= length / 2)
        )
        return np.where(is_usable, 60 * sampling_rate / speeds.T, np.nan).T
    low, high = speed_range or (0.0, 0.0)
    if length * low < least_revolutions * 60 * sampling_rate:
        return np.full(n_rows, np.nan)
    nominal = 60 * sampling_rate / np.sqrt(low * high)
    tolerance = np.log(high / low) / 2

    def frequency(_, samples):
        return comb_frequency(samples, 1 / nominal, tolerance, _N_HARMONICS)

    return 1 / np.array(map_rows(frequency, X, n_jobs=1))


def envelope_spectrum(
    signal: ArrayLike,
    sampling_rate: float,
    *,
    band: tuple[float, float] | None = None,
    prewhiten: bool = True,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the spectrum of the squared envelope of a signal.

    Parameters
    ----------
    signal : array-like of shape (n_samples,)
        At least 8 samples, in any unit.
    sampling_rate : float
        In Hz, above 0.
    band : tuple of two floats or None, default=None
        Lowest and highest frequency in Hz that the envelope is taken of. None: all
        frequencies.
    prewhiten : bool, default=True
        Whether all frequencies get the same magnitude first, which is called cepstrum
        prewhitening. It removes the lines of gears and of the shaft, and the loudness
        of resonances.

    Returns
    -------
    frequencies : ndarray of shape (n_frequencies,)
        From 0 to half the sampling rate in Hz. Divided by the shaft's frequency, they
        are orders.
    power : ndarray of shape (n_frequencies,)
        Power of the squared envelope less its mean, relative to the mean squared.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> signal = 0.1 * rng.normal(size=20_000)
    >>> signal[np.cumsum(rng.normal(400, 1, size=49)).astype(int)] += 1  # 50 impacts a second
    >>> frequencies, power = envelope_spectrum(signal, 20_000)
    >>> float(frequencies[power[:100].argmax()])
    50.0
    """
    check_real(sampling_rate, "sampling_rate", **ABOVE_0)
    options = {"ensure_2d": False, "ensure_min_samples": 8, "input_name": "signal"}
    signal = check_array(as_samples(signal, "signal"), dtype=np.float64, **options)
    expect(signal.ndim == 1, "signal.shape", signal.shape, "one axis")
    low, high = (0.0, sampling_rate / 2) if band is None else band
    expected = (
        f"two frequencies from 0 to {sampling_rate / 2:g} Hz, the lower one first"
    )
    expect(0 <= low < high <= sampling_rate / 2, "band", band, expected)
    part = low / sampling_rate, high / sampling_rate
    power = squared_envelope_spectrum(signal, part, prewhiten)
    return np.arange(len(power)) * sampling_rate / len(signal), power
