"""Contrast of envelope spectra over orders of the shaft, and combs of faults in it."""

import math
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy import fft
from scipy.ndimage import maximum_filter1d

from .arrays import Array
from .order_spectra import envelopes_over_angle, equal_angles
from .running_median import running_median
from .scaling import centred
from .short_time import hann_window

#: Orders at which contrasts are stored: from 0 to the highest, in these steps.
ORDER_STEP = 0.01
HIGHEST_ORDER = 40.0
N_ORDERS = round(HIGHEST_ORDER / ORDER_STEP) + 1
#: Width of the running median that a spectrum is compared with, in orders.
_FLOOR_WIDTH = 0.75
#: Least width of this median in cells of the plain spectrum: three main lobes of a Hann
#: window.
_FLOOR_CELLS = 12
#: Points of a zero-padded spectrum for each cell of the plain one.
_PADDING = 4
#: Bands of frequency with an envelope each.
_N_BANDS = 8
#: Length of the Hann window of their short-time spectrum in seconds.
_FRAME = 2.5e-3
#: Highest frequency in Hz that counts, if envelopes up to the highest order fit below
#: it: lines of healthy machines that resemble combs are stronger above. Of seven
#: values, it is best for the ROC AUC and for the fault locations alike, also if it is
#: chosen without one of the rigs.
_HIGHEST_FREQUENCY = 6.4e3
#: A segment has this many seconds, but a number of revolutions in this range: the
#: longer it is, the more do lines of the shaft stand out against impacts that slip.
_SECONDS = 1.0
_REVOLUTIONS = (10, 30)
#: A long segment has this many times the samples of a segment.
_LONG = 5
#: Weights of the contrast of bands, of the prewhitened signal in segments, and in long
#: segments.
_WEIGHTS = np.array([1.0, 1.0, 0.4]) / 2.4
#: ln ln 2 is the median of the logarithm of exponentially distributed power, less that
#: of its mean.
_MEDIAN_OF_NOISE = math.log(math.log(2))
#: Step of the logarithm of the factor on the speed.
FACTOR_STEP = 0.002
_LEAST_POWER = 1e-12
#: Nepers that the largest slip costs a comb.
_SLIP_COST = 0.15
#: Nepers that an error of the speed of the same size costs all combs together.
_SPEED_COST = 0.6
#: Multiples of each part of a fault's comb.
RACE_MULTIPLES = 3
SPIN_MULTIPLES = 4
CAGE_MULTIPLES = 4
_MULTIPLES = np.array([CAGE_MULTIPLES, SPIN_MULTIPLES, *3 * [RACE_MULTIPLES]])
#: Weight of the cage's comb in the score of a ball.
CAGE_WEIGHT = 0.6
#: Most of the cage's comb that counts, in nepers. Strong faults of a race show the
#: cage, too.
MOST_OF_CAGE = 1.0
#: Locations of faults in the order of the scores.
FAULTS = ("ball", "inner", "outer")
#: Decibels of power in a neper of power.
NEPER_IN_DB = 10 / math.log(10)


class Comb(NamedTuple):
    """Scores of the faults, and the factors on the speed that they belong to.

    Parameters
    ----------
    scores : ndarray of shape (3,)
        For ball, inner and outer race, in nepers.
    factors : ndarray of shape (3,)
        True over nominal speed: slip of the elements and error of the speed together.
    """

    scores: NDArray[np.float64]
    factors: NDArray[np.float64]


def order_contrast(samples: Array, period: float | Array, rate: float) -> Array:
    r"""Compute how far the envelope spectra of a signal rise above their surroundings.

    Frequencies above 6.4 kHz do not count, or above 80 times that of the shaft if that
    is more. The signal is cut into segments of 1 s, but from 10 to 30 revolutions.
    Three spectra contribute. The first is the mean over eight frequency bands, each with the
    envelope of :func:`band_envelopes <skarxlag.kernels.order_spectra.band_envelopes>`.
    The second is the spectrum of the squared envelope after cepstrum prewhitening,
    which sets the magnitude of all frequencies to 1. The third is the second in
    segments that are five times as long. The contrast of a power spectrum P at order o
    is

    .. math:: \max\left(\ln P(o) - \mathrm{median} \ln P + \ln \ln 2,\; 0\right)

    with the running median over .75 order, or 12 divided by the revolutions of a
    segment if that is more. The largest of three neighbouring cells counts.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    period : float or ndarray of shape (n_samples,)
        Samples in a revolution of the shaft; one number for each sample if the speed varies.
    rate : float
        Sampling rate in Hz.

    Returns
    -------
    ndarray of shape (4001,)
        Contrast in nepers at the orders 0, .01, ... 40; the mean of segments. 0 at
        orders that the signal cannot show.
    """
    return _WEIGHTS @ contrast_parts(samples, period, rate)


def contrast_parts(samples: Array, period: float | Array, rate: float) -> Array:
    """Compute the three contrasts that `order_contrast` is the weighted mean of.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    period : float or ndarray of shape (n_samples,)
        Samples in a revolution of the shaft.
    rate : float
        Sampling rate in Hz.

    Returns
    -------
    ndarray of shape (3, 4001)
        Contrast of bands, of the prewhitened signal, and of the prewhitened signal in
        long segments.
    """
    samples, period, rate = _without_high_frequencies(samples, period, rate)
    fewest, most = np.multiply(_REVOLUTIONS, np.mean(period))
    length = np.clip(_SECONDS * rate, fewest, most)
    segments = _segments(samples, period, length)
    frame = 2 ** max(round(math.log2(_FRAME * rate)), 2)
    n_samples = len(segments[0][0])
    shortest_frame = min(frame, n_samples // 8)
    n_bands = min(_N_BANDS, max(shortest_frame // 2 - 1, 1))
    bands = (frame, n_bands, HIGHEST_ORDER)
    banded = [
        mean_contrast(*envelopes_over_angle(*segment, *bands)) for segment in segments
    ]
    in_short = [mean_contrast(*prewhitened_envelope(*segment)) for segment in segments]
    in_long = in_short
    if len(segments) > 1:
        long_segments = _segments(samples, period, _LONG * length)
        in_long = [
            mean_contrast(*prewhitened_envelope(*segment)) for segment in long_segments
        ]
    parts = (banded, in_short, in_long)
    return np.stack([np.mean(of_segments, axis=0) for of_segments in parts])


def _without_high_frequencies(samples, period, rate):
    """Resample a signal to twice the highest frequency that counts."""
    highest = max(_HIGHEST_FREQUENCY, 2 * HIGHEST_ORDER * rate / np.mean(period))
    n_kept = math.ceil(2 * highest / rate * len(samples))
    if n_kept >= len(samples):
        return samples, period, rate
    share = n_kept / len(samples)
    if np.ndim(period) > 0:
        period = period[(np.arange(n_kept) / share).astype(int)]
    spectrum = fft.rfft(centred(samples[np.newaxis])[0][0])
    return fft.irfft(spectrum, n_kept), period * share, rate * share


def _segments(samples, period, longest):
    """Return samples and periods of equal segments, at least as long as given, or of all."""
    n_segments = max(int(len(samples) / longest + 1e-9), 1)
    length = len(samples) // n_segments
    segments = []
    for i in range(n_segments):
        part = slice(i * length, (i + 1) * length)
        of_part = period if np.ndim(period) == 0 else period[part]
        segments.append((samples[part], of_part))
    return segments


def prewhitened_envelope(samples: Array, period: float | Array) -> tuple[Array, float]:
    """Compute the squared envelope of a signal after cepstrum prewhitening.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    period : float or ndarray of shape (n_samples,)
        Samples in a revolution of the shaft.

    Returns
    -------
    envelopes : ndarray of shape (1, n_values)
        Squared envelope over the angle of the shaft, averaged in blocks so that it
        shows orders up to 40 and few more.
    step : float
        Revolutions from one value to the next.
    """
    n_fft = fft.next_fast_len(len(samples))
    squared = _squared_envelope(samples, n_fft, (0.0, 0.5), prewhiten=True)
    block = max(int(np.mean(period) / (2.5 * HIGHEST_ORDER)), 1)
    n_values = len(squared) // block
    blocks = squared[: n_values * block].reshape(1, n_values, block)
    envelopes = blocks.mean(axis=2)
    if np.ndim(period) == 0:
        return envelopes, block / period
    return equal_angles(envelopes, period, block, block)


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
    squared = _squared_envelope(samples, len(samples), band, prewhiten=prewhiten)
    mean = squared.mean()
    if mean > 0:
        squared = (squared / mean - 1) * hann_window(len(samples))
    power = np.abs(fft.rfft(squared)) ** 2
    return power * (4 / len(samples)) ** 2


def _squared_envelope(samples, n_fft, band, *, prewhiten):
    rows, _ = centred(samples[np.newaxis])
    spectrum = fft.rfft(rows[0], n_fft)
    if prewhiten:
        size = np.abs(spectrum)
        has_power = size > _LEAST_POWER * size.max()
        np.divide(spectrum, size, out=spectrum, where=has_power)
    spectrum[: math.ceil(band[0] * n_fft)] = 0
    spectrum[int(band[1] * n_fft) + 1 :] = 0
    # The positive frequencies alone give half the analytic signal.
    analytic = fft.ifft(spectrum, n_fft)[: len(samples)]
    return analytic.real**2 + analytic.imag**2


def mean_contrast(envelopes: Array, step: float) -> Array:
    """Compute the mean contrast of the spectra of envelopes, see :func:`order_contrast`.

    Parameters
    ----------
    envelopes : ndarray of shape (n_bands, n_values)
        Envelopes over the angle of the shaft.
    step : float
        Revolutions from one value to the next.

    Returns
    -------
    ndarray of shape (4001,)
        In nepers, at the orders 0, .01, ... 40; 0 at orders that the envelopes cannot
        show.
    """
    n_values = envelopes.shape[1]
    if n_values < 8:
        return np.zeros(N_ORDERS)
    n_fft = fft.next_fast_len(_PADDING * n_values, real=True)
    centred_envelopes = envelopes - envelopes.mean(axis=1, keepdims=True)
    spectra = fft.rfft(centred_envelopes * hann_window(n_values), n_fft)
    cell = 1 / (n_fft * step)
    spectra = spectra[:, : int((HIGHEST_ORDER + 1) / cell) + 2]
    power = spectra.real**2 + spectra.imag**2
    mean_square = np.mean(envelopes**2, axis=1, keepdims=True)
    floor = _LEAST_POWER * mean_square + np.finfo(float).tiny
    level = np.log(power + floor * n_values)
    width = max(_FLOOR_WIDTH, _FLOOR_CELLS / (n_values * step))
    n_cells = 2 * int(width / cell / 2) + 1
    above = level - running_median(level, n_cells, "edge") + _MEDIAN_OF_NOISE
    highest = maximum_filter1d(np.maximum(above, 0), 3, axis=1)
    contrast = highest.mean(axis=0)
    positions = np.arange(N_ORDERS) * ORDER_STEP / cell
    return np.interp(positions, np.arange(len(contrast)), contrast, right=0)


def fault_comb(
    contrast: Array,
    orders: Array,
    tolerance: float,
    slip: float,
    cage_weight: float = CAGE_WEIGHT,
) -> Comb:
    r"""Compute how well the comb of each fault fits a contrast.

    An error of the nominal speed multiplies all orders by one factor :math:`e^d`. Slip
    of the rolling elements multiplies each order by a factor :math:`e^t` of its own.
    The comb of order o with K multiples is

    .. math:: \max_{|t| \le \sigma}\; \frac{1}{K} \sum_{k=1}^{K} C(k\, e^{d + t} o)
        - 0.15 \left(\frac{t}{\sigma}\right)^2

    with the contrast C and the slip :math:`\sigma`. A race has the comb of its order
    with 3 multiples. A ball has half the sum of the combs of twice its spin (3) and of
    its spin (4), plus .6 times the comb of the cage (4), but at most .6 nepers. The
    common d maximises the median of the three scores less :math:`0.6\, (d / \sigma)^2`,
    so that a line that fits a single comb does not move the speed.

    Parameters
    ----------
    contrast : ndarray of shape (n_orders,)
        As `order_contrast` returns it.
    orders : ndarray of shape (4,)
        Orders of the cage (FTF), the spin of a rolling element (BSF), the inner race
        (BPFI) and the outer race (BPFO).
    tolerance : float
        Largest size of d, at least 0.
    slip : float
        Largest size :math:`\sigma` of t, above 0.
    cage_weight : float, default=0.6
        Weight of the cage's comb in the score of a ball.

    Returns
    -------
    Comb
        Scores and factors :math:`e^{d + t}` of ball, inner and outer race. The factor
        of the ball is that of the better comb of its spin.
    """
    n_slip = int(slip / FACTOR_STEP + 1e-9)
    n_error = int(tolerance / FACTOR_STEP + 1e-9)
    n_shifts = n_error + n_slip
    shifts = FACTOR_STEP * np.arange(-n_shifts, n_shifts + 1)
    cage_order, spin_order, inner_order, outer_order = orders
    twice_order = 2 * spin_order
    of_combs = [cage_order, spin_order, twice_order, inner_order, outer_order]
    heights = _heights(contrast, np.array(of_combs), shifts)
    slips = FACTOR_STEP * np.arange(-n_slip, n_slip + 1)
    cost = _SLIP_COST * (slips / slip) ** 2
    slipped = sliding_window_view(heights, len(slips), axis=1) - cost
    cage, spin, twice, inner, outer = slipped.max(axis=2)
    ball = (spin + twice) / 2 + cage_weight * np.minimum(cage, MOST_OF_CAGE)
    scores = np.stack([ball, inner, outer])
    errors = shifts[n_slip : len(shifts) - n_slip]
    median = np.sort(scores, axis=0)[1]
    fit = median - _SPEED_COST * (errors / slip) ** 2
    at = _nearest_best(fit, errors)
    # The slip of a ball is that of the higher one of its two combs.
    of_ball = 1 if spin[at] > twice[at] else 2
    combs = slipped[[of_ball, 3, 4], at]
    best_slips = [slips[_nearest_best(comb, slips)] for comb in combs]
    factors = np.exp(errors[at] + np.array(best_slips))
    return Comb(scores[:, at], factors)


def _heights(contrast, orders, shifts):
    """Return mean contrasts at multiples of orders, for logarithms of a factor on the speed."""
    multiples = np.concatenate([np.arange(1, n + 1) for n in _MULTIPLES])
    positions = np.repeat(orders, _MULTIPLES) * multiples / ORDER_STEP
    positions = np.multiply.outer(positions, np.exp(shifts))
    cells = np.arange(len(contrast))
    at_multiples = np.interp(positions, cells, contrast, right=0.0)
    starts = np.cumsum(_MULTIPLES) - _MULTIPLES
    return np.add.reduceat(at_multiples, starts) / _MULTIPLES[:, np.newaxis]


def _nearest_best(values, shifts):
    """Return the index of the largest value; of equal ones, that of the smallest shift."""
    best = np.flatnonzero(values == values.max())
    return best[np.abs(shifts[best]).argmin()]
