"""Contrast of envelope spectra over orders of the shaft, and combs of faults in it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import maximum_filter1d

from .arrays import Array
from .running_median import running_median
from .scaling import centred
from .short_time import hann_window

#: Orders at which contrasts are stored: from 0 to the highest, in these steps.
ORDER_STEP = 0.01
HIGHEST_ORDER = 40.0
N_ORDERS = round(HIGHEST_ORDER / ORDER_STEP) + 1
_ORDERS = np.arange(N_ORDERS) * ORDER_STEP
#: Multiples in the comb of a fault.
N_MULTIPLES = 4
#: Equally wide bands from 0 to half the sampling rate.
_N_BANDS = 4
#: Width of the running median that a spectrum is compared with: in orders, and at least
#: in revolutions times orders, so that a line does not fill it.
_FLOOR_WIDTH = 1.2
_FLOOR_CELLS = 24
#: Points of a zero-padded spectrum for each cell of the plain one.
_PADDING = 2
_LEAST_POWER = 1e-12
#: Step of the logarithm of the factor on the speed.
FACTOR_STEP = 0.0005
#: Scale of the logarithm of the true over the stated speed. Errors have heavy tails.
_SPEED_SCALE = 0.001
#: Multiples of the shaft that show its speed, and nepers above which a line shows no
#: more: one that is loud alone is none of the shaft.
_SHAFT_MULTIPLES = 8
_CLEAR_LINE = 4.0
#: Logarithm of order within which a multiple of the shaft may be a line of a fault.
_NEAR_FAULT = 0.04
#: Half width in orders of what is masked about lines that belong to no fault.
_MASK = 1.5 * ORDER_STEP
#: Nepers by which lines between those of a comb may be lower and still explain it.
_AS_HIGH = 0.2
#: Width of a line in cells of the plain spectrum, with a Hann window: lines that are
#: closer are not tested.
_LINE_WIDTH = 4.0
#: Lowest order of impacts that are searched besides those of the bearing.
_LOWEST_OTHER = 1.2
#: Nepers by which the comb of a train may be lower than that of its multiples.
_SAME_TRAIN = 0.5
#: Locations of faults in the order of the scores.
FAULTS = ("ball", "inner", "outer")
#: Decibels of power in a neper of power.
NEPER_IN_DB = 10 / math.log(10)
#: Divisors of the order of a fault at which impacts are no fault of this location.
_DIVISORS = (2, 3, 4)


class Comb(NamedTuple):
    """Scores of the faults, the factors that they belong to, and other impacts.

    Parameters
    ----------
    scores : ndarray of shape (3,)
        For ball, inner and outer race, in nepers. 0 if lines between the multiples show
        that the impacts come at a fraction of the order.
    factors : ndarray of shape (3,)
        Order of the comb over the order of the fault: slip of the elements.
    other_order, other_score : float
        Order of the strongest comb at none of these orders and their multiples, and its
        score in nepers.
    """

    scores: NDArray[np.float64]
    factors: NDArray[np.float64]
    other_order: float
    other_score: float


def order_contrast(samples: Array, period: float | Array) -> Array:
    r"""Compute how far spectra of a signal and of its envelopes rise above their surroundings.

    The squared envelope is taken of four equally wide bands from 0 to half the sampling
    rate. The contrast of its power spectrum P (one Hann window over the whole signal) is

    .. math:: C(o) = \max\left(\ln P(o) - \mathrm{median} \ln P,\; 0\right)

    with the largest P within the resolution about order o, and the running median over
    1.2 orders, or 24 divided by the revolutions if that is more. The root mean square
    over those bands counts that are wide enough to show the order. So a line of a
    longer signal has more contrast, and noise has the same one for every length, rate
    and speed.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    period : float or ndarray of shape (n_samples,)
        Samples in a revolution of the shaft; one number for each sample if the speed
        varies.

    Returns
    -------
    ndarray of shape (3, 4001)
        Contrast in nepers at the orders 0, .01, ... 40: of envelopes, of envelopes
        after cepstrum prewhitening, which sets the magnitude of all frequencies to 1,
        and of the signal itself. 0 at orders that the signal cannot show.
    """
    n_samples = len(samples)
    rows, _ = centred(samples[np.newaxis])
    spectrum = fft.rfft(rows[0])
    size = np.abs(spectrum)
    white = np.zeros_like(spectrum)
    has_power = size > _LEAST_POWER * size.max()
    np.divide(spectrum, size, out=white, where=has_power)
    highest = (HIGHEST_ORDER + 1) * n_samples / np.mean(period)
    low = spectrum[: int(min(highest, len(spectrum) - 1)) + 1]
    signal = fft.irfft(low, 2 * len(low))
    parts = [_envelopes(spectrum, period), _envelopes(white, period), [signal]]
    return np.stack([_contrast(part, n_samples, period) for part in parts])


def _envelopes(spectrum, period):
    """Return the squared envelopes of the bands of a spectrum, each at its own rate."""
    envelopes = []
    for band in np.array_split(spectrum[1:], _N_BANDS):
        if len(band) < 2:
            continue
        # At twice the width of the band, squares are not aliased.
        n_values = fft.next_fast_len(2 * len(band))
        analytic = fft.ifft(band, n_values)
        squared = analytic.real**2 + analytic.imag**2
        mean = squared.mean()
        if mean > 0:
            envelopes.append(squared / mean - 1)
    return envelopes


def _contrast(rows, n_samples, period):
    """Return the contrast over orders of rows that each last as long as the signal."""
    n_revolutions = n_samples / np.mean(period)
    if np.ndim(period) > 0:
        n_revolutions = np.sum(1 / period)
        rows = [_over_angle(row, period) for row in rows]
    if len(rows) == 0:
        return np.zeros(N_ORDERS)
    levels = np.array([_log_power(row, n_revolutions) for row in rows])
    shows = np.array([_ORDERS * n_revolutions < len(row) / 2 for row in rows])
    width = max(_FLOOR_WIDTH, _FLOOR_CELLS / n_revolutions)
    floor = running_median(levels, 2 * int(width / ORDER_STEP / 2) + 1, "edge")
    square = np.where(shows, np.maximum(levels - floor, 0) ** 2, 0)
    return np.sqrt(square.sum(axis=0) / np.maximum(shows.sum(axis=0), 1))


def _over_angle(row, period):
    """Resample a row at equal steps of the shaft's angle."""
    turns = np.append(0, np.cumsum(1 / period))
    times = np.linspace(0, len(period), len(row), endpoint=False)
    angles = np.interp(times, np.arange(len(turns)), turns)
    return np.interp(np.linspace(0, turns[-1], len(row), endpoint=False), angles, row)


def _log_power(row, n_revolutions):
    """Return the logarithm of the largest power within the resolution of each order."""
    n_values = len(row)
    n_fft = fft.next_fast_len(_PADDING * n_values, real=True)
    cell = n_values / (n_fft * n_revolutions)
    spectrum = fft.rfft(row * hann_window(n_values), n_fft)
    spectrum = spectrum[: int((HIGHEST_ORDER + 1) / cell) + 2]
    power = spectrum.real**2 + spectrum.imag**2
    level = np.log(power + _LEAST_POWER * power.mean() + np.finfo(float).tiny)
    n_cells = max(round(max(ORDER_STEP, 1 / n_revolutions) / cell), 1) | 1
    largest = maximum_filter1d(level, n_cells)
    return np.interp(_ORDERS / cell, np.arange(len(level)), largest)


def speed_error(contrasts: Array, orders: Array, tolerance: float) -> float:
    r"""Find the true speed by the lines of the shaft.

    With the contrasts :math:`C_i` of `order_contrast`, the logarithm d of the true over
    the stated speed maximises

    .. math:: \sum_{i=1}^{3} \overline{\min(C_i(h e^d), 4)}
        - \ln\left(1 + |d| / 0.001\right)

    with the mean over the first eight multiples h of the shaft that are not within 4 %
    of lines of faults, neither at the stated speed nor at the true one. The second term
    is the logarithm of a distribution of errors with heavy tails.

    Parameters
    ----------
    contrasts : ndarray of shape (3, 4001)
        As `order_contrast` returns them.
    orders : ndarray of shape (n,)
        Orders of impacts of faults.
    tolerance : float
        Largest size of d, at least 0.

    Returns
    -------
    float
        The logarithm d.
    """
    errors = _steps(tolerance)
    multiples = np.arange(1, int(HIGHEST_ORDER))[:, np.newaxis]
    is_apart = _apart(multiples, orders, _NEAR_FAULT).ravel()
    # Those near lines of faults come last.
    multiples = multiples[np.argsort(~is_apart, kind="stable")[:_SHAFT_MULTIPLES]]
    at = multiples * np.exp(errors)
    # At another speed, a multiple of the shaft may meet a line of a fault.
    is_apart = _apart(at, orders, _NEAR_FAULT)
    counts = np.maximum(is_apart.sum(axis=0), _SHAFT_MULTIPLES // 2)
    fit = -np.log1p(np.abs(errors) / _SPEED_SCALE)
    for contrast in np.minimum(contrasts, _CLEAR_LINE):
        heights = np.interp(at, _ORDERS, contrast, right=0.0)
        fit += heights.sum(axis=0, where=is_apart) / counts
    return float(errors[fit.argmax()])


def _apart(at, orders, distance):
    """Return which orders have this distance in their logarithm from all lines of faults."""
    lines = np.outer(orders, np.arange(1, N_MULTIPLES + 1))
    lines = np.sort(np.log(lines), axis=None)
    log_at = np.log(at)
    nearest = lines[np.searchsorted((lines[1:] + lines[:-1]) / 2, log_at)]
    return np.abs(log_at - nearest) > distance


def _steps(largest):
    """Return logarithms of factors from 0 outwards, so that of equals the nearest is first."""
    steps = FACTOR_STEP * np.arange(1, int(largest / FACTOR_STEP + 1e-9) + 1)
    return np.append(0.0, np.column_stack([steps, -steps]))


def at_true_speed(contrasts: Array, error: float) -> Array:
    """Return the mean contrast of envelopes over orders of the true speed.

    Parameters
    ----------
    contrasts : ndarray of shape (3, 4001)
        As `order_contrast` returns them.
    error : float
        As `speed_error` returns it.

    Returns
    -------
    ndarray of shape (4001,)
        In nepers.
    """
    envelopes = contrasts[:2].mean(axis=0)
    return np.interp(_ORDERS * math.exp(error), _ORDERS, envelopes, right=0.0)


def no_fault_lines(trains: Sequence[float]) -> NDArray[np.bool_]:
    """Return where the lines of the shaft and of other trains stand.

    Parameters
    ----------
    trains : sequence of float
        Orders whose multiples belong to no fault, such as twice the mains frequency.
        Those below 1 are not used: they would leave nothing.

    Returns
    -------
    ndarray of bool of shape (4001,)
        True at multiples of the shaft and of the trains.
    """
    is_line = np.zeros(N_ORDERS, dtype=bool)
    for order in [1.0, *(train for train in trains if train > 1)]:
        multiple = np.round(_ORDERS / order)
        distance = np.abs(_ORDERS - multiple * order)
        # Trains that are not of the shaft wander by a thousandth.
        wander = 0.0 if order == 1 else 1e-3 * _ORDERS
        is_line |= (multiple > 0) & (distance <= _MASK + wander)
    return is_line


def fault_comb(
    contrast: Array,
    orders: Array,
    slip: float,
    n_revolutions: float,
    masked: NDArray[np.bool_],
) -> Comb:
    r"""Compute how well the comb of each fault fits a contrast.

    The comb of order o is the mean contrast at its first four multiples,

    .. math:: \max_{|t| \le \sigma}\; \overline{C(k\, e^t o)},
        \qquad k = 1, \dots, 4,

    with the slip :math:`\sigma` of the rolling elements. Multiples that are masked do
    not count. If lines between the multiples are as high, at halves, thirds or quarters
    of the order or about once in a revolution of the shaft, the impacts come at that
    fraction of the order, and the score is 0. It is also 0 if the signal is too short to
    resolve any of the four multiples of o from the multiples of the shaft.

    Parameters
    ----------
    contrast : ndarray of shape (4001,)
        Over orders of the true speed.
    orders : ndarray of shape (3,)
        Orders of impacts of ball, inner and outer race.
    slip : float
        Largest size :math:`\sigma` of t, at least 0, in steps of .0005.
    n_revolutions : float
        Revolutions in the signal: lines closer than their inverse are not resolved.
    masked : ndarray of bool of shape (4001,)
        As `no_fault_lines` returns it.

    Returns
    -------
    Comb
        Scores, factors :math:`e^t`, and the strongest other comb.
    """
    heights = maximum_filter1d(contrast, 3)
    lines = np.where(masked, 0.0, maximum_filter1d(np.where(masked, 0, contrast), 3))
    slips = _steps(slip)
    scores, factors = np.empty((2, len(orders)))
    for fault, order in enumerate(orders):
        fit = _mean_of_comb(lines, masked, order * np.exp(slips))
        factors[fault] = np.exp(slips[fit.argmax()])
        found = order * factors[fault]
        resolved = found * n_revolutions / _LINE_WIDTH
        # An order near a multiple of the shaft may be a part of its comb.
        divisors = {*_DIVISORS, max(round(found), 2)}
        between = [_between(heights, found, n) for n in divisors if n < resolved]
        is_fault = fit.max() > max(between, default=0.0) + _AS_HIGH
        # Multiples within the half width of a line of the shaft are not resolved from it.
        farthest = N_MULTIPLES * abs(order - round(order))
        is_parted = farthest * n_revolutions >= _LINE_WIDTH / 2
        scores[fault] = fit.max() if is_fault and is_parted else 0.0
    highest = np.log(HIGHEST_ORDER / N_MULTIPLES)
    others = np.exp(np.arange(np.log(_LOWEST_OTHER), highest, FACTOR_STEP))
    fit = _mean_of_comb(lines, masked, others)
    fit[~_apart(others, orders, slip)] = 0
    # Of a train and its multiples, the train.
    first = np.argmax(fit >= fit.max() - _SAME_TRAIN)
    n_near = int(slip / FACTOR_STEP) + 1
    best = first + fit[first : first + n_near].argmax()
    return Comb(scores, factors, float(others[best]), float(fit[best]))


def _mean_of_comb(lines, masked, orders):
    """Return the mean height of lines at the multiples of orders, without masked ones."""
    multiples = np.arange(1, N_MULTIPLES + 1)[:, np.newaxis]
    cells = np.rint(multiples * orders / ORDER_STEP).astype(int)
    # Lines above the highest order count as missing.
    inside = cells < N_ORDERS
    cells = np.minimum(cells, N_ORDERS - 1)
    heights = np.where(inside, lines[cells], 0)
    counts = np.sum(~masked[cells] | ~inside, axis=0)
    # A single line is no comb.
    return heights.sum(axis=0) / np.maximum(counts, 2)


def _between(heights, order, divisor):
    """Return the mean height between the first multiples of an order, at a fraction of it."""
    numbers = np.arange(1, divisor * N_MULTIPLES)
    numbers = numbers[numbers % divisor > 0]
    cells = np.rint(numbers * order / (divisor * ORDER_STEP)).astype(int)
    return heights[cells[cells < N_ORDERS]].mean()


def squared_envelope_spectrum(
    samples: Array, band: tuple[float, float], prewhiten: bool
) -> Array:
    """Compute the power spectrum of the squared envelope of a signal.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    band : tuple of two floats
        Frequencies that count, in cycles a sample.
    prewhiten : bool
        Whether all frequencies of the band get the same magnitude first.

    Returns
    -------
    ndarray of shape (n_samples // 2 + 1,)
        Power, with a Hann window, of the squared envelope over its mean; 0 for a
        constant signal.
    """
    rows, _ = centred(samples[np.newaxis])
    spectrum = fft.rfft(rows[0])
    if prewhiten:
        size = np.abs(spectrum)
        has_power = size > _LEAST_POWER * size.max()
        np.divide(spectrum, size, out=spectrum, where=has_power)
    n_samples = len(samples)
    spectrum[: math.ceil(band[0] * n_samples)] = 0
    spectrum[int(band[1] * n_samples) + 1 :] = 0
    # The positive frequencies alone give half the analytic signal.
    analytic = fft.ifft(spectrum, n_samples)
    squared = analytic.real**2 + analytic.imag**2
    mean = squared.mean()
    if mean > 0:
        squared = (squared / mean - 1) * hann_window(n_samples)
    power = np.abs(fft.rfft(squared)) ** 2
    return power * (4 / n_samples) ** 2
