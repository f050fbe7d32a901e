"""Shaft speeds from signals: a comb of harmonics, and the pulses of a tachometer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_array

from ..core.speeds import samples_per_revolution
from ..core.state import expect
from ..core.validation import (
    ABOVE_0,
    as_samples,
    check_count,
    check_real,
    check_sampling_rate,
)
from ..kernels.comb import comb_frequency

#: Largest logarithm of an estimated speed over the nominal one.
_SPEED_TOLERANCE = 0.1
#: Harmonics that count.
_N_HARMONICS = 40


def estimate_shaft_speed(
    X: ArrayLike, sampling_rate: float, rpm: ArrayLike
) -> NDArray[Any]:
    r"""Estimate the speed of the shaft near a nominal value, by a comb of harmonics.

    Unbalance, misalignment, couplings and blades make vibration at multiples of the
    shaft's frequency f. The estimate is the frequency whose multiples stand out most
    from the spectrum around them,

    .. math:: \hat f = \arg\max_f \sum_{h=1}^{40} \max(\ln P(h f) - F(h f), 0),
              \qquad |\ln (f / f_0)| \le 0.1,

    with P the power spectrum of a row, F the median of :math:`\ln P` over 0.8 f about
    each frequency, and :math:`f_0` the nominal frequency. Multiples above half the
    sampling rate do not count.

    Strong impacts of a bearing fault have harmonics, too. If their frequency is nearly
    a multiple of that of the shaft, they shift the estimate, by up to 3 % at the outer
    race of a bearing 6205. A row without harmonics of the shaft gives an arbitrary
    value, and a constant row the nominal speed.

    Parameters
    ----------
    X : array-like of shape (n_stretches, n_samples) or (n_stretches, n_channels, n_samples)
        Signals, of which the first channel is used; each row holds at least 3 revolutions,
        and better 10.
    sampling_rate : float
        In Hz.
    rpm : float or array-like of shape (n_stretches,)
        Nominal speed in revolutions per minute.

    Returns
    -------
    ndarray of shape (n_stretches,)
        Estimates in revolutions per minute.

    Raises
    ------
    ValueError
        If a parameter is out of its range, speeds are not above 0, or a row has less
        than 3 revolutions.

    Examples
    --------
    >>> time = np.arange(20_000) / 10_000
    >>> noise = np.random.default_rng(0).normal(size=time.shape)
    >>> angle = 2 * np.pi * 612 / 60 * time                  # 612 rpm
    >>> signal = noise + sum(np.cos(h * angle + h**2) for h in range(1, 8))
    >>> bool(abs(estimate_shaft_speed([signal], 10_000, 600)[0] - 612) < 3)
    True
    """
    check_sampling_rate(sampling_rate)
    X = check_array(as_samples(X, "X"), allow_nd=True, dtype=np.float64, input_name="X")
    rows = X[:, 0] if X.ndim == 3 else X
    revolution_lengths = samples_per_revolution(
        rpm, sampling_rate, len(rows), rows.shape[1]
    )
    expect(
        revolution_lengths.ndim == 1,
        "rpm.shape",
        revolution_lengths.shape,
        "one speed for each stretch",
    )
    frequencies = [
        comb_frequency(row, nominal, _SPEED_TOLERANCE, _N_HARMONICS)
        for row, nominal in zip(rows, 1 / revolution_lengths, strict=True)
    ]
    return 60 * sampling_rate * np.array(frequencies)


def rpm_from_tacho(
    tacho: ArrayLike, sampling_rate: float, *, pulses_per_revolution: int = 1
) -> NDArray[Any]:
    r"""Compute the shaft speed at each sample from the pulses of a tachometer.

    A pulse begins at :math:`t_i`, where the signal rises through the middle of its
    range, from the percentile 0.1 to the percentile 99.9. The speed between two pulses
    is

    .. math:: n(\tfrac{1}{2}(t_i + t_{i+1})) = \frac{60}{P\,(t_{i+1} - t_i)},

    with P pulses in a revolution. It is interpolated linearly between these times, and
    constant before the first and after the last of them. A pulse counts only if the
    signal was below a quarter of its range before, so that noise at the edge of a pulse
    is not counted as further pulses.

    Parameters
    ----------
    tacho : array-like of shape (n_samples,)
        Signal of the tachometer, in any unit. For pulses that are negative, pass its
        negative.
    sampling_rate : float
        In Hz.
    pulses_per_revolution : int, default=1
        The number P, at least 1.

    Returns
    -------
    ndarray of shape (n_samples,)
        Speed in revolutions per minute. Its mean is the ``rpm`` of a recording. If the
        speed varies, cut it as the signal is cut and pass one row of speeds for each
        stretch.

    Raises
    ------
    ValueError
        If a parameter is out of its range or the signal has fewer than two pulses.

    Examples
    --------
    >>> time = np.arange(5000) / 1000
    >>> pulses = np.sin(2 * np.pi * 10 * time) > 0.95        # 10 revolutions in a second
    >>> rpm_from_tacho(pulses, 1000).mean().round(1)
    np.float64(600.0)
    """
    check_real(sampling_rate, "sampling_rate", **ABOVE_0)
    check_count(pulses_per_revolution, "pulses_per_revolution")
    signal = check_array(tacho, ensure_2d=False, dtype=np.float64, input_name="tacho")
    expect(signal.ndim == 1, "tacho.shape", signal.shape, "(n_samples,)")
    times, speeds = pulse_speeds(signal, sampling_rate, pulses_per_revolution)
    return np.interp(np.arange(len(signal)) / sampling_rate, times, speeds)


def pulse_speeds(
    signal: NDArray[Any], sampling_rate: float, pulses_per_revolution: int
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the times halfway between pulses in seconds, and the speeds between them.

    Parameters
    ----------
    signal, sampling_rate, pulses_per_revolution
        As in `rpm_from_tacho`.

    Raises
    ------
    ValueError
        If the signal has fewer than two pulses.
    """
    times = _pulse_times(signal) / sampling_rate
    name = f"Number of pulses in {len(signal)} samples of tacho"
    expect(len(times) >= 2, name, len(times), "at least 2")
    return (times[1:] + times[:-1]) / 2, 60 / (pulses_per_revolution * np.diff(times))


def _pulse_times(signal):
    """Return where pulses begin, in samples."""
    low, high = np.percentile(signal, [0.1, 99.9])
    # Halves before they are subtracted: the range of huge values is not infinite.
    quarter = high / 4 - low / 4
    middle = low + 2 * quarter
    # The sample at which the signal last was low or high decides which of both it is.
    level = np.where(signal >= middle, 1, np.where(signal <= low + quarter, -1, 0))
    low_or_high = np.array([], dtype=int)
    if quarter > 0:
        low_or_high = np.flatnonzero(level)
    rises = np.flatnonzero(np.diff(level[low_or_high]) == 2)
    after = low_or_high[rises + 1]
    before = after - 1
    return before + (middle - signal[before]) / (signal[after] - signal[before])
