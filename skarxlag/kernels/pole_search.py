"""The Laguerre pole of each channel, by separable least squares on spectra.

Given the poles the fit is linear. The sums it needs are integrals of the cross-spectra of the
channels, which are accumulated once, so the cost of one evaluation does not grow with the data.
The spectra are those of zero-padded windows: the autocorrelation method of linear prediction.
"""

import numpy as np
from scipy import linalg, optimize

from .laguerre import laguerre_response
from .spectra import frequency_grid

#: Frequencies on (0, pi); a Laguerre network of order N resolves no more than N details there.
N_FREQUENCIES = 1024
#: Poles beyond this settle more slowly than any window lasts.
LARGEST_POLE = 0.98
_GRID = np.linspace(-0.9, 0.9, 13)
_N_TAPS = 64


def cross_spectra(windows):
    """Sum over the windows of the cross-spectra of their channels.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs, centred.

    Returns
    -------
    ndarray of shape (n_channels, n_channels, N_FREQUENCIES)
        Entry (a, b) is the sum of S_a conj(S_b), a mean over each cell; its mean over the
        frequencies is the sum over time of s_a s_b.
    """
    n_channels, n_samples = windows.shape[1:]
    # Enough points within each cell that no lag of the window is aliased on another.
    times = -(-n_samples // N_FREQUENCIES)
    spectra = np.zeros((n_channels, n_channels, N_FREQUENCIES), dtype=complex)
    for window in windows:
        # Midpoints of n cells are the odd frequencies of a transform of 4 n points.
        transform = np.fft.rfft(window, 4 * N_FREQUENCIES * times)[:, 1::2]
        products = transform[:, np.newaxis] * transform.conj()
        spectra += products.reshape(n_channels, n_channels, N_FREQUENCIES, times).mean(axis=-1)
    return spectra


def fit_spectrum(spectrum, orders, poles, alpha):
    """Best model with these poles, from the cross-spectra of its windows.

    Parameters
    ----------
    spectrum : ndarray of shape (n_channels, n_channels, n_frequencies)
        Sum of cross-spectra.
    orders, poles : sequence of length n_channels
        The networks.
    alpha : float
        Ridge, added to the sum of squares.

    Returns
    -------
    coef : ndarray of shape (n_states,)
        Coefficients.
    share : float
        Share of the output's power that the model cannot predict, between 0 and 1.
    """
    return _fit(spectrum, _filters(orders, poles, spectrum.shape[-1]), orders, alpha)


def _filters(orders, poles, n_frequencies):
    frequency = frequency_grid(n_frequencies)
    return np.concatenate(
        [laguerre_response(n, p, frequency) for n, p in zip(orders, poles, strict=True)]
    )


def _fit(spectrum, filters, orders, alpha):
    power = spectrum[0, 0].real.sum()
    n_states = len(filters)
    if power == 0:
        return np.zeros(n_states), 0.0
    channel = np.repeat(np.arange(len(orders)), orders)
    gram = np.empty((n_states, n_states))
    for other in range(len(orders)):
        states = filters * spectrum[channel, other] / power
        gram[:, channel == other] = (states @ filters[channel == other].conj().T).real
        if other == 0:
            cross = states.sum(axis=1).real
    ridge = alpha * spectrum.shape[-1] / power * np.eye(n_states)
    coef = linalg.lstsq(gram + ridge, cross)[0]
    return coef, float(1 - 2 * coef @ cross + coef @ gram @ coef)


def closed_form_pole(taps):
    r"""The pole in which an impulse response is most compact.

    Minimises :math:`\sum_n n g_n^2` over the Laguerre coefficients g of the response (Fu and Dumont
    1993): :math:`\zeta = (s - \sqrt{s^2 - 4c^2})/(2c)` with :math:`s = \sum_k (2k-1) h_k^2` and
    :math:`c = \sum_k k h_k h_{k+1}`.

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


def search_poles(spectra, orders, poles, alpha):
    """Poles of least prediction error, one channel after another.

    For every free channel the closed form of the unrestricted impulse response and a coarse grid
    start a bounded scalar search; with several free channels the round is made twice, and a simplex
    search moves all of them together at the end.

    Parameters
    ----------
    spectra : ndarray of shape (n_models, n_channels, n_channels, n_frequencies)
        Cross-spectra of each model's windows.
    orders : sequence of int, of length n_channels
        The networks' orders.
    poles : sequence of float or None, of length n_channels
        Given poles, None where one is to be found.
    alpha : float
        Ridge, added to the sum of squares.

    Returns
    -------
    ndarray of shape (n_channels,)
        The poles.
    """
    free = [channel for channel, pole in enumerate(poles) if pole is None]
    n_channels = len(orders)
    taps = np.array(
        [fit_spectrum(s, [_N_TAPS] * n_channels, [0.0] * n_channels, alpha)[0] for s in spectra]
    ).reshape(len(spectra), n_channels, _N_TAPS)
    found = np.array(
        [closed_form_pole(taps[:, c]) if p is None else p for c, p in enumerate(poles)]
    )

    def error(pole, channel):
        tried = found.copy()
        tried[channel] = pole
        filters = _filters(orders, tried, spectra.shape[-1])
        return sum(_fit(s, filters, orders, alpha)[1] for s in spectra)

    for channel in free * (2 if len(free) > 1 else 1):
        starts = np.sort(np.append(_GRID, np.clip(found[channel], -LARGEST_POLE, LARGEST_POLE)))
        errors = [error(pole, channel) for pole in starts]
        best = int(np.argmin(errors))
        around = np.concatenate(([-LARGEST_POLE], starts, [LARGEST_POLE]))[[best, best + 2]]
        refined = optimize.minimize_scalar(
            error, bounds=around, args=(channel,), method="bounded", options={"xatol": 1e-4}
        )
        found[channel] = refined.x if refined.fun < errors[best] else starts[best]
    if len(free) > 1:
        # Channels of like colour leave a narrow valley, along which one at a time moves slowly.
        found[free] = optimize.minimize(
            error,
            found[free],
            args=(free,),
            method="Nelder-Mead",
            bounds=[(-LARGEST_POLE, LARGEST_POLE)] * len(free),
            options={"xatol": 1e-4, "fatol": 1e-9},
        ).x
    return found
