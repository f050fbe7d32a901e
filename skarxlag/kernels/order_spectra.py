"""Order spectra of a signal's envelopes, and their distance from references at any speed."""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from .arrays import Array
from .scaling import centred
from .short_time import hann_window, windowed_segments

#: Samples of the shortest signal that has envelopes.
LEAST_SAMPLES = 32
#: Share of a signal's power that is added to the power of each of its frequencies, so
#: that frequencies which hold nothing but rounding errors do not count.
_FLOOR = 1e-14
#: Power of a normalised envelope that is added before the logarithm, for constant
#: envelopes.
_LEAST_POWER = 1e-9
#: Points of a zero-padded spectrum for each cell of the plain one: they are then
#: so close that a straight line between two neighbours is within .03 neper.
_PADDING = 4
#: Frames of the short-time spectrum start half a frame apart, or down to this share of
#: a frame.
_MOST_OVERLAP = 8
#: Step of the logarithm of the factor on the speed.
_FACTOR_STEP = 0.02
#: Largest logarithm of this factor in standard deviations.
_MOST_DEVIATIONS = 2
#: Independent values that an order spectrum is worth. An unlikely factor weighs as one
#: of them.
_INDEPENDENT_VALUES = 50
#: Logarithm of the factor up to which segments of one length do.
_GROUP_WIDTH = 0.2
#: Segments of Welch's method start this share of a segment apart.
_OVERLAP = 4


def band_envelopes(samples: Array, frame: int, hop: int, n_bands: int) -> Array:
    r"""Compute the power of a whitened signal over time, in bands of frequency.

    The short-time power :math:`P(t, f)` at each frequency is divided by its mean over
    time, :math:`\bar P(f)`. This whitens the signal, so that loud resonances do not
    mask the rest. The envelope of a band is the mean of :math:`P(t, f) / \bar P(f)`
    over the frequencies of the band.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    frame : int
        Samples in the Hann window of the short-time spectrum, at least 4 and at most
        n_samples.
    hop : int
        Samples from one window to the next.
    n_bands : int
        Number of bands, which are equally wide from 0 to half the sampling rate.

    Returns
    -------
    ndarray of shape (n_bands, n_frames)
        Envelopes, each with mean 1, or 0 where the band holds no power.
    """
    rows, _ = centred(samples[np.newaxis])
    segments = windowed_segments(rows, hann_window(frame), hop)[0]
    spectra = fft.rfft(segments)[:, 1 : max(frame // 2, 2)].T
    # Rows of frequencies, which sums over time and over a band take less time for.
    power = np.ascontiguousarray(spectra.real**2 + spectra.imag**2)
    mean = power.mean(axis=1, keepdims=True)
    floor = _FLOOR * frame * np.mean(rows**2)
    factor = np.zeros_like(mean)
    np.divide(1.0, mean + floor, out=factor, where=mean > 0)
    power *= factor
    envelopes = [
        band.sum(axis=0) / max(len(band), 1) for band in np.array_split(power, n_bands)
    ]
    return np.stack(envelopes)


def envelopes_over_angle(
    samples: Array,
    period: float | Array,
    frame: int,
    n_bands: int,
    max_order: float,
) -> tuple[Array, float]:
    """Compute the envelopes of a signal at equal steps of the shaft's angle.

    Parameters
    ----------
    samples : ndarray of shape (n_samples,)
        A signal in any unit.
    period : float or ndarray of shape (n_samples,)
        Samples in a revolution of the shaft; one number for each sample where the speed
        varies.
    frame : int
        Samples in a window of the short-time spectrum; an eighth of the signal is
        enough.
    n_bands : int
        Number of bands.
    max_order : float
        Highest order that the envelopes shall show. Frames overlap the more the higher
        it is, up to seven eighths.

    Returns
    -------
    envelopes : ndarray of shape (n_bands, n_values)
        Envelopes, see :func:`band_envelopes`. A signal of less than 32 samples has one
        value of 0.
    step : float
        Revolutions from one value to the next.
    """
    if len(samples) < LEAST_SAMPLES:
        return np.zeros((n_bands, 1)), 1.0
    frame = min(frame, len(samples) // 8)
    hop = frame // 2
    shortest_hop = max(frame // _MOST_OVERLAP, 1)
    # The highest frequency of the envelope is half a cycle a hop.
    while hop > shortest_hop and np.mean(period) / (2 * hop) < max_order:
        hop //= 2
    envelopes = band_envelopes(samples, frame, hop, n_bands)
    if np.ndim(period) == 0:
        return envelopes, hop / period
    return equal_angles(envelopes, period, frame, hop)


def equal_angles(
    envelopes: Array, period: Array, frame: int, hop: int
) -> tuple[Array, float]:
    """Resample envelopes at equal steps of the shaft's angle, which is called order tracking.

    Parameters
    ----------
    envelopes : ndarray of shape (n_bands, n_frames)
        Envelopes over time.
    period : ndarray of shape (n_samples,)
        Samples that a revolution would take at the speed of each sample.
    frame, hop : int
        Frames of the short-time spectrum, see :func:`band_envelopes`.

    Returns
    -------
    envelopes : ndarray of shape (n_bands, n_frames)
        Envelopes over angle.
    step : float
        Revolutions from one value to the next.
    """
    centres = np.arange(envelopes.shape[1]) * hop + (frame - 1) / 2
    samples = np.arange(len(period))
    revolutions_of_samples = np.cumsum(1 / period)
    revolutions = np.interp(centres, samples, revolutions_of_samples)
    n_values = len(revolutions)
    angles = np.linspace(revolutions[0], revolutions[-1], n_values)
    resampled = [np.interp(angles, revolutions, envelope) for envelope in envelopes]
    step = (revolutions[-1] - revolutions[0]) / max(n_values - 1, 1)
    return np.stack(resampled), step


def order_spectrum(
    envelopes: Array, step: float, n_revolutions: float
) -> tuple[Array, float]:
    """Compute the log power spectra of envelopes over orders by Welch's method.

    Segments overlap by three quarters and have a Hann window; their spectra are
    zero-padded.

    Parameters
    ----------
    envelopes : ndarray of shape (n_bands, n_values)
        Envelopes over the angle of the shaft.
    step : float
        Revolutions from one value to the next.
    n_revolutions : float
        Revolutions in a segment; at least two and at most all values are used.

    Returns
    -------
    log_power : ndarray of shape (n_bands, n_frequencies)
        Natural logarithm of power at equal steps of order from 0 on.
    cell : float
        The step.
    """
    if envelopes.shape[1] < 2:
        return np.zeros((len(envelopes), 1)), 1.0
    n_segment = min(max(round(n_revolutions / step), 2), envelopes.shape[1])
    n_fft = fft.next_fast_len(_PADDING * n_segment, real=True)
    n_fft += n_fft % 2
    # scipy.signal.welch takes three times as long, which is a sixth of a stretch alone.
    hop = math.ceil(n_segment / _OVERLAP)
    segments = sliding_window_view(envelopes, n_segment, axis=1)[:, ::hop]
    window = hann_window(n_segment)
    tapered = (segments - segments.mean(axis=2, keepdims=True)) * window
    spectra = fft.rfft(tapered, n_fft)
    power = np.mean(spectra.real**2 + spectra.imag**2, axis=1)
    power *= 2 / (window @ window)
    power[:, [0, -1]] /= 2
    return np.log(power + _LEAST_POWER), 1 / n_fft / step


def at_orders(
    log_power: Array, step: float, orders: Array, factors: Array
) -> tuple[Array, Array]:
    """Interpolate spectra at orders of the shaft, for several hypotheses of its speed.

    Parameters
    ----------
    log_power : ndarray of shape (n_bands, n_frequencies)
        Log spectra at equal steps from 0 on.
    step : float
        The step, in orders of the nominal speed.
    orders : ndarray of shape (n_orders,)
        Requested orders, ascending.
    factors : ndarray of shape (n_factors,)
        Hypotheses: true speed over nominal speed.

    Returns
    -------
    spectra : ndarray of shape (n_factors, n_bands, n_orders)
        Log spectra, less their median over the orders that are inside the spectrum; 0
        outside.
    inside : ndarray of bool of shape (n_factors, n_orders)
        Which orders lie below the highest frequency of the spectrum.
    """
    n_frequencies = log_power.shape[1]
    position = np.multiply.outer(factors, orders) / step
    inside = position <= n_frequencies - 1
    cells = np.arange(n_frequencies)
    bands = [np.interp(position, cells, band) for band in log_power]
    spectra = np.stack(bands, axis=1)
    # Sorting puts the orders outside last. A masked array would take most of the time
    # of `match`.
    is_counted = inside[:, np.newaxis]
    with_infinite = np.where(is_counted, spectra, np.inf)
    ascending = np.sort(with_infinite, axis=2)
    count = inside.sum(axis=1)[:, np.newaxis, np.newaxis]
    lower = np.take_along_axis(ascending, (count - 1) // 2, axis=2)
    upper = np.take_along_axis(ascending, count // 2, axis=2)
    median = (lower + upper) / 2
    return np.where(is_counted, spectra - median, 0.0), inside


def distances(
    spectra: Array,
    inside: Array,
    references: Array,
    variances: Array,
) -> Array:
    """Compute the root-mean-square distance of order spectra from references.

    It is in standard deviations.

    Parameters
    ----------
    spectra : ndarray of shape (n_factors, n_bands, n_orders)
        Order spectra, see :func:`at_orders`.
    inside : ndarray of bool of shape (n_factors, n_orders)
        Orders that are compared.
    references : ndarray of shape (n_references, n_bands, n_orders)
        References that the spectra are compared with.
    variances : ndarray of shape (n_bands, n_orders)
        Variance of each value.

    Returns
    -------
    ndarray of shape (n_factors, n_references)
        The distances; 1 if no order is compared.
    """
    count = inside.sum(axis=1)[:, np.newaxis] * references.shape[1]
    away = (spectra[:, np.newaxis] - references) ** 2 / variances
    squares = np.einsum("frbo,fo->fr", away, inside)
    # Nothing is inside if the speed is far too high.
    mean = np.ones_like(squares)
    np.divide(squares, count, out=mean, where=count > 0)
    return np.sqrt(mean)


def match(
    envelopes: Array,
    step: float,
    n_revolutions: float,
    orders: Array,
    deviation: float,
    references: Array,
    variances: Array,
) -> tuple[Array, Array, Array]:
    r"""Compute the distance of a stretch from each reference, at the best-fitting speed.

    The logarithm of the factor s, true speed over nominal speed, is taken to be
    normally distributed, with standard deviation :math:`\tau`. So an unlikely factor
    adds to the mean square distance d, over values that are worth some 50 independent
    ones,

    .. math:: r^2 = \min_s d_s^2 + \tfrac{1}{50} (\ln s / \tau)^2, \qquad |\ln s| \le 2 \tau .

    A line of a spectrum is as wide as segments are short, so that segments must hold
    the same number of revolutions at every speed. The factors are tried in groups, each with
    segments of its own length.

    Parameters
    ----------
    envelopes : ndarray of shape (n_bands, n_values)
        Envelopes over the angle of the shaft, see :func:`envelopes_over_angle`.
    step : float
        Revolutions from one value to the next, at the nominal speed.
    n_revolutions : float
        Revolutions in a segment.
    orders : ndarray of shape (n_orders,)
        Orders that are compared.
    deviation : float
        The standard deviation :math:`\tau`, at least 0.
    references : ndarray of shape (n_references, n_bands, n_orders)
        References that the stretch is compared with.
    variances : ndarray of shape (n_bands, n_orders)
        Variance of each value.

    Returns
    -------
    residuals : ndarray of shape (n_references,)
        The residuals r.
    factors : ndarray of shape (n_references,)
        The factors that they belong to.
    spectra : ndarray of shape (n_references, n_bands, n_orders)
        The order spectra at these factors.
    """
    n_references = len(references)
    least = np.full(n_references, np.inf)
    factors = np.ones(n_references)
    closest = np.zeros_like(references)
    deviation = max(deviation, np.finfo(float).tiny)
    widest = _MOST_DEVIATIONS * deviation
    n_groups = max(math.ceil(widest / _GROUP_WIDTH - 1e-9), 1)
    n_steps = int(widest / n_groups / _FACTOR_STEP + 1e-9)
    near = _FACTOR_STEP * np.arange(-n_steps, n_steps + 1)
    for group in range(n_groups):
        centre = widest * ((2 * group + 1) / n_groups - 1)
        step_at_centre = step * math.exp(centre)
        log_power, cell = order_spectrum(envelopes, step_at_centre, n_revolutions)
        spectra, inside = at_orders(log_power, cell, orders, np.exp(near))
        away = distances(spectra, inside, references, variances)
        unlikely = ((centre + near) / deviation) ** 2
        of_factor = np.sqrt(unlikely / _INDEPENDENT_VALUES)
        residuals = np.hypot(away, of_factor[:, np.newaxis])
        smallest = residuals.min(axis=0)
        better = np.flatnonzero(smallest < least)
        best = residuals.argmin(axis=0)[better]
        least[better] = smallest[better]
        factors[better] = np.exp(centre + near[best])
        closest[better] = spectra[best]
    return least, factors, closest
