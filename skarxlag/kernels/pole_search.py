r"""The Laguerre pole of each channel, by separable least squares on correlations.

For given poles the fit is linear, and it depends on the data only through the
correlations of the channels. These are summed once, as cross-spectra, so the cost of
trying a pole does not depend on the amount of data.
"""

from collections.abc import Sequence

import numpy as np
from scipy import fft, optimize

from .arrays import Array

#: Poles beyond this settle more slowly than any window lasts.
LARGEST_POLE = 0.98
#: Most samples of a segment; longer windows are cut.
LONGEST_SEGMENT = 2**14


def cross_spectra(windows: Array) -> Array:
    """Sum the cross-spectra of the channels over the windows.

    Windows longer than `LONGEST_SEGMENT` are cut into segments of equal length, and the
    last one is filled with zeros. Segments are padded to twice their length, so that
    their correlations do not wrap around.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs, centred.

    Returns
    -------
    ndarray of shape (n_channels, n_channels, length + 1), complex
        Entry (a, b) is the sum of the spectrum of channel a times the conjugate of that
        of channel b, at ``length + 1`` frequencies from 0 to pi. The length is that of
        a segment.

    Examples
    --------
    >>> import numpy as np
    >>> cross_spectra(np.array([[[1.0, 2.0, -3.0]]])).real.round(9)
    array([[[ 0., 13., 21., 16.]]])
    """
    n_windows, n_channels, n_samples = windows.shape
    n_segments = -(-n_samples // LONGEST_SEGMENT)
    length = -(-n_samples // n_segments)
    n_missing = n_segments * length - n_samples
    padded = np.pad(windows, [(0, 0), (0, 0), (0, n_missing)])
    segments = padded.reshape(n_windows, n_channels, n_segments, length)
    spectra = fft.rfft(segments, 2 * length)
    return np.einsum("wasf,wbsf->abf", spectra, spectra.conj())


def fit_errors(
    spectra: Array, orders: Sequence[int], poles: Sequence[float], alpha: float
) -> Array:
    r"""Compute the least error of each model for given poles.

    With the frequency responses :math:`L_i` of all filters and the cross-spectra S, the
    sums for least squares are integrals such as :math:`\int L_i S_{ab} \bar L_j`. They
    are those of windows that are followed by as many zeros and repeated.

    Parameters
    ----------
    spectra : ndarray of shape (n_models, n_channels, n_channels, n_frequencies), complex
        Cross-spectra of each model's windows.
    orders : sequence of int, of length n_channels
        Number of filters of each channel.
    poles : sequence of float, of length n_channels
        Pole of each channel.
    alpha : float
        Ridge parameter, which is added to the sum of squares.

    Returns
    -------
    ndarray of shape (n_models,)
        Sum of squared errors plus ridge, as a share of the output's power. It is 0 for
        an output without power.

    Examples
    --------
    A signal that halves from sample to sample is predicted but for its first sample:

    >>> signal = 0.5 ** np.arange(40.0)
    >>> spectra = cross_spectra(signal[np.newaxis, np.newaxis])[np.newaxis]
    >>> error = fit_errors(spectra, [1], [0.0], 0.0)
    >>> float(round(error[0] * signal @ signal, 6))
    1.0
    """
    sums = _sums_of_products(spectra, orders, poles)
    gram = sums[:, :-1, :-1]
    cross = sums[:, :-1, -1]
    power = sums[:, -1, -1]
    size = np.einsum("mii->m", gram) / gram.shape[-1]
    ridge = alpha + 1e-12 * size + (size == 0)
    gram += ridge[:, np.newaxis, np.newaxis] * np.eye(gram.shape[-1])
    coef = np.linalg.solve(gram, cross[..., np.newaxis])[..., 0]
    error = power - np.einsum("mi,mi->m", coef, cross)
    return np.divide(error, power, out=np.zeros(len(power)), where=power > 0)


def _sums_of_products(spectra, orders, poles):
    """Return the sums of the products of all states and, last, of the output."""
    n_frequencies = spectra.shape[-1]
    z = np.exp(1j * np.linspace(0, np.pi, n_frequencies))
    weights = np.full(n_frequencies, 1 / (n_frequencies - 1))
    weights[[0, -1]] /= 2
    responses = []
    for order, pole in zip(orders, poles, strict=True):
        all_pass = (1 - pole * z) / (z - pole)
        factors = np.tile(all_pass, (order, 1))
        factors[0] = np.sqrt(1 - pole**2) / (z - pole)
        responses.append(np.multiply.accumulate(factors))
    # The output is the response of channel 0 to itself, behind all states.
    responses.append(np.ones((1, n_frequencies)))
    filters = np.concatenate(responses)
    n_filters = len(filters)
    channel = np.repeat([*range(len(orders)), 0], [*orders, 1])
    sums = np.empty((len(spectra), n_filters, n_filters))
    for b in range(len(orders)):
        crossed = filters * (weights * spectra[:, channel, b])
        of_channel = filters[channel == b]
        # Real and imaginary parts side by side: their product is the real part of the
        # sums.
        sums[..., channel == b] = crossed.view(float) @ of_channel.view(float).T
    return sums


def search_poles(
    spectra: Array,
    orders: Sequence[int],
    poles: Sequence[float | None],
    alpha: float,
) -> Array:
    """Find the poles with the smallest prediction error, summed over the models.

    Each free channel moves to the best place of a grid, the others fixed; several free
    channels do so twice. A bounded quasi-Newton search then moves all free poles
    together. The error has ripples, so another pole may be better by a fraction of a
    percent. A pole is only tried if its network settles within a segment.

    Parameters
    ----------
    spectra : ndarray of shape (n_models, n_channels, n_channels, n_frequencies), complex
        Cross-spectra of each model's windows.
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
    best = np.array([0.0 if pole is None else pole for pole in poles])
    length = spectra.shape[-1] - 1
    orders = np.asarray(orders)
    settled = (length - orders) / (length + orders)
    # The error varies evenly with artanh of the pole.
    limits = np.arctanh(np.clip(settled, 0, LARGEST_POLE))

    def error(places, channels):
        tried = best.copy()
        tried[channels] = np.tanh(places)
        return fit_errors(spectra, orders, tried, alpha).sum()

    for channel in free * min(len(free), 2):
        # There are about as many ripples as filters.
        n_places = 21 + orders[channel] // 2
        places = np.linspace(-1, 1, n_places) * limits[channel]
        errors = [error(place, channel) for place in places]
        best[channel] = np.tanh(places[np.argmin(errors)])
    start = np.arctanh(best[free])
    bounds = [(-limits[channel], limits[channel]) for channel in free]
    options = {"ftol": 1e-12, "gtol": 1e-8, "eps": 1e-6}
    refined = optimize.minimize(
        error, start, (free,), "L-BFGS-B", bounds=bounds, options=options
    )
    best[free] = np.tanh(refined.x)
    return best
