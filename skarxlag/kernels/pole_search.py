r"""The Laguerre pole of each channel, by separable least squares on correlations.

For given poles the fit is linear, and it depends on the data only through the correlations of the
channels. These are accumulated once, so the cost of trying a pole does not depend on the length of
the data.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize

from .correlation_fit import best_fits, state_correlations

#: Poles beyond this settle more slowly than any window lasts.
LARGEST_POLE = 0.98
#: Most samples of a segment; longer windows are cut.
LONGEST_SEGMENT = 2**14
_SAMPLES_A_BATCH = 2**16
_N_TAPS = 32
#: As artanh of the pole: the dense part of the grid ends at 0.9, where a network of high order is
#: as slow as a window is long, and 0.956 is tried for slow inputs.
_DENSE_END, _GRID_END = 1.5, 1.9


def correlations(windows: NDArray[Any]) -> NDArray[Any]:
    """Sum the correlations of the channels over the windows.

    Windows longer than `LONGEST_SEGMENT` are cut into segments of equal length, so that the cost
    per sample and the memory do not grow with the length of the windows. Products across a
    boundary are omitted, both between segments and between windows. The response of a network that
    continues beyond a boundary counts as error for every pole.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs, centred.

    Returns
    -------
    ndarray of shape (n_channels, n_channels, 2 * n_lags + 1)
        Entry (a, b, n_lags + l) is the sum over time of s_a(k + l) s_b(k), where samples outside of
        the segment count as zero; n_lags is one less than the samples of a segment.

    Examples
    --------
    >>> import numpy as np
    >>> correlations(np.array([[[1.0, 2.0, -3.0]]])).round(9)
    array([[[-3., -4., 14., -4., -3.]]])
    """
    n_windows, n_channels, n_samples = windows.shape
    length = -(-n_samples // -(-n_samples // LONGEST_SEGMENT))
    n_fft = fft.next_fast_len(2 * length, real=True)
    batch = max(1, _SAMPLES_A_BATCH // (n_channels * n_fft))
    n_whole = n_samples // length
    spectra = np.zeros((n_channels, n_channels, n_fft // 2 + 1), dtype=complex)
    whole = windows[..., : n_whole * length].reshape(n_windows, n_channels, n_whole, length)
    for segments in (whole, windows[..., np.newaxis, n_whole * length :]):
        n_segments = n_windows * segments.shape[2] if segments.size else 0
        for first in range(0, n_segments, batch):
            chosen = np.arange(first, min(first + batch, n_segments))
            window, segment = np.divmod(chosen, segments.shape[2])
            transform = fft.rfft(segments[window, :, segment], n_fft)
            for a in range(n_channels):
                for b in range(a + 1):
                    product = np.einsum("wf,wf->f", transform[:, a], transform[:, b].conj())
                    spectra[a, b] += product
    circular = fft.irfft(spectra, n_fft)
    found = np.concatenate((circular[..., n_fft - length + 1 :], circular[..., :length]), axis=-1)
    for a in range(1, n_channels):
        found[:a, a] = found[a, :a, ::-1]
    return found


def closed_form_pole(taps: NDArray[Any]) -> float:
    r"""Return the pole whose Laguerre series represents an impulse response most compactly.

    The pole minimises :math:`\sum_n n g_n^2` over the Laguerre coefficients g of the response
    (Fu and Dumont 1993): :math:`\zeta = (s - \sqrt{s^2 - 4c^2})/(2c)` with
    :math:`s = \sum_k (2k-1) h_k^2` and :math:`c = \sum_k k h_k h_{k+1}`.

    Parameters
    ----------
    taps : ndarray of shape (n_responses, n_taps)
        Impulse responses h_1, h_2, ... that share the pole.

    Returns
    -------
    float
        The pole, in (-1, 1).

    Examples
    --------
    >>> round(closed_form_pole(0.7 ** np.arange(60.0)[np.newaxis]), 6)
    0.7
    """
    k = np.arange(1, taps.shape[1] + 1)
    s = np.sum((2 * k - 1) * taps**2)
    c = np.sum(k[:-1] * taps[:, :-1] * taps[:, 1:])
    if c == 0:
        return 0.0
    return float((s - np.sqrt(max(s * s - 4 * c * c, 0.0))) / (2 * c))


def least_of_cubics(places: NDArray[Any], values: NDArray[Any], slopes: NDArray[Any]) -> float:
    """Find the minimum of a piecewise cubic through values and slopes, to a twentieth of a piece.

    Parameters
    ----------
    places, values, slopes : ndarray of shape (n_places,)
        The points, in rising order of `places`.

    Returns
    -------
    float
        Position of the minimum.

    Examples
    --------
    >>> import numpy as np
    >>> places = np.array([-1.0, 0.0, 2.0])
    >>> round(least_of_cubics(places, (places - 0.5) ** 2, 2 * (places - 0.5)), 9)
    0.5
    """
    t = np.linspace(0, 1, 21)
    width = np.diff(places)[:, np.newaxis]
    left, right = values[:-1, np.newaxis], values[1:, np.newaxis]
    leaving, arriving = slopes[:-1, np.newaxis], slopes[1:, np.newaxis]
    cubic = left + (right - left) * t**2 * (3 - 2 * t)
    cubic += width * t * (1 - t) * (leaving * (1 - t) - arriving * t)
    piece, at = np.unravel_index(np.argmin(cubic), cubic.shape)
    return float(places[piece] + width[piece, 0] * t[at])


def search_poles(correlations: NDArray[Any], orders: Any, poles: Any, alpha: float) -> NDArray[Any]:
    """Find the poles with the smallest prediction error, summed over the models.

    The search has three steps. First, every free channel starts at the closed-form pole of the
    unrestricted impulse response. Second, each channel in turn moves to the minimum of a cubic
    through error and slope on a grid. With several free channels this step is repeated, and the
    first grid is coarser. Third, a bounded quasi-Newton search moves all free poles together. The
    error has ripples, so another pole may be better by a fraction of a percent.

    Parameters
    ----------
    correlations : ndarray of shape (n_models, n_channels, n_channels, 2 * n_lags + 1)
        Correlations of each model's windows.
    orders : sequence of int, of length n_channels
        The networks' orders.
    poles : sequence of float or None, of length n_channels
        Fixed poles; None for a pole that is to be found.
    alpha : float
        Ridge parameter, which is added to the sum of squares.

    Returns
    -------
    ndarray of shape (n_channels,)
        The poles.
    """
    free = [channel for channel, pole in enumerate(poles) if pole is None]
    n_models, n_channels, _, n_points = correlations.shape
    orders = np.asarray(orders, dtype=np.int64)
    power = np.ascontiguousarray(correlations[:, 0, 0, n_points // 2])

    def fits(orders, poles):
        states = state_correlations(correlations, orders, poles)
        return best_fits(states, power, orders, poles, alpha)

    taps, _, _ = fits(np.full(n_channels, _N_TAPS), np.zeros(n_channels))
    taps = taps.reshape(n_models, n_channels, _N_TAPS)
    found = np.array(
        [closed_form_pole(taps[:, c]) if p is None else p for c, p in enumerate(poles)]
    )
    found[free] = np.clip(found[free], -LARGEST_POLE, LARGEST_POLE)

    def error_and_slopes(places, channels):
        tried = found.copy()
        tried[channels] = np.tanh(places)
        _, error, slopes = fits(orders, tried)
        return error, slopes[channels]

    for fine in (False, True) if len(free) > 1 else (True,):
        for channel in free:
            # The error ripples with artanh of the pole, about as often as there are filters.
            n_dense = 20 + orders[channel] // 2 if fine else 9
            dense = np.linspace(-_DENSE_END, _DENSE_END, n_dense)
            places = np.unique([-_GRID_END, *dense, _GRID_END, np.arctanh(found[channel])])
            tried = [error_and_slopes(place, channel) for place in places]
            found[channel] = np.tanh(least_of_cubics(places, *np.transpose(tried)))
    start, end = np.arctanh(found[free]), np.arctanh(LARGEST_POLE)
    unit = error_and_slopes(start, free)[0] or 1.0
    refined = optimize.minimize(
        lambda places: [part / unit for part in error_and_slopes(places, free)],
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=[(-end, end)] * len(free),
        options={"ftol": 1e-10, "gtol": 1e-7},
    )
    found[free] = np.tanh(refined.x)
    return found
