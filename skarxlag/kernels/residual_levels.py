"""Residual evaluation: one number for each signal (equations 21, 22 and the innovations test)."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled, inlined
from .lanes import LANES, TILE, carry
from .observer import ERROR, carry_loop, loop_histories, observe, observe_block, start_loop
from .scaling import root_mean_square
from .spectra import cepstrum

#: Rows of what the switching gain's loop keeps: the sum of squares of the surface, the gain, its
#: steps up less those down, and the sum of these once it has settled.
POWER, GAIN, STEPS, SETTLED_STEPS = range(4)
#: Share of a window over which the switching gain is averaged, at its end, once it has settled.
_SETTLED = 0.5


def sliding_surface(error: NDArray[Any], slope: float) -> NDArray[Any]:
    r"""Return the surface :math:`S(k) = \lambda e(k) + (e(k) - e(k-1))`, with e(-1) = e(0).

    Parameters
    ----------
    error : ndarray of shape (..., n_samples)
        The output error e.
    slope : float
        The slope :math:`\lambda`, at least 0.

    Returns
    -------
    ndarray of shape (..., n_samples)
        The surface, in the unit of the error.

    Examples
    --------
    >>> sliding_surface(np.array([1.0, 3.0, 2.0]), slope=0.5)
    array([0.5, 3.5, 0. ])
    """
    return slope * error + np.diff(error, axis=-1, prepend=error[..., :1])


def switching_gain(surface: NDArray[Any], step: float) -> NDArray[Any]:
    """Compute the trajectory of the adapted switching gain, which starts at the surface's RMS.

    Parameters
    ----------
    surface : ndarray of shape (n_signals, n_samples)
        The sliding surface.
    step : float
        Step of the gain's logarithm a sample, above 0.

    Returns
    -------
    ndarray of shape (n_signals, n_samples)
        The gain, in the unit of the surface.
    """
    return adapt_switching_gain(surface, root_mean_square(surface), step)


@compiled
def adapt_switching_gain(surface: NDArray[Any], start: NDArray[Any], step: float) -> NDArray[Any]:
    r"""Compute the switching gain, which follows the size of the sliding surface.

    The gain changes by :math:`\ln K_s^+ = \ln K_s + \mathrm{step}\,\mathrm{sgn}(|S| - K_s)`. It
    settles at the median of :math:`|S|`, where :math:`|S|` is above and below the gain equally
    often.

    Parameters
    ----------
    surface : ndarray of shape (n_signals, n_samples)
        The sliding surface S.
    start : ndarray of shape (n_signals,)
        Gain before the first sample, above 0. A gain that starts at 0 stays at 0.
    step : float
        Step of the logarithm, above 0.

    Returns
    -------
    ndarray of shape (n_signals, n_samples)
        The gain after each sample.
    """
    n_signals, n_samples = surface.shape
    gain = np.empty((n_signals, n_samples))
    up, down = math.exp(step), math.exp(-step)
    for signal in range(n_signals):
        k_s = start[signal]
        for k in range(n_samples):
            size = abs(surface[signal, k])
            if size > k_s:
                k_s *= up
            elif size < k_s:
                k_s *= down
            gain[signal, k] = k_s
    return gain


def settled_level(gain: NDArray[Any]) -> NDArray[Any]:
    """Return the geometric mean of a gain over the last half of the window; 0 if the gain is 0."""
    tail = gain[..., int(_SETTLED * gain.shape[-1]) :]
    silent = tail[..., 0] == 0
    level = np.exp(np.mean(np.log(np.where(silent[..., np.newaxis], 1.0, tail)), axis=-1))
    return np.where(silent, 0.0, level)


def power_levels(innovations: NDArray[Any], loop: tuple[Any, ...]) -> NDArray[Any]:
    """Compute the root mean square of the output error.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_models, n_samples)
        The innovations.
    loop : tuple of 7 floats
        Parameters of the loop, see `observer.observe`.

    Returns
    -------
    ndarray of shape (n_windows, n_models)
        Levels, in the unit of the innovations.
    """
    return _levels(innovations, loop, 0.0, 0.0)


def switching_gain_levels(
    innovations: NDArray[Any], loop: tuple[Any, ...], slope: float, step: float
) -> NDArray[Any]:
    """Compute the level at which the switching gain of the output error's sliding surface settles.

    The level is the `settled_level` of the `switching_gain` of the `sliding_surface`.

    Parameters
    ----------
    innovations : ndarray of shape (n_windows, n_models, n_samples)
        The innovations.
    loop : tuple of 7 floats
        Parameters of the loop, see `observer.observe`.
    slope : float
        Slope of the sliding surface, at least 0.
    step : float
        Step of the gain's logarithm a sample, above 0.

    Returns
    -------
    ndarray of shape (n_windows, n_models)
        Levels, in the unit of the innovations.
    """
    return _levels(innovations, loop, slope, step)


def _levels(innovations, loop, slope, step):
    """Return power levels if the step is 0, and switching-gain levels otherwise."""
    n_samples = innovations.shape[-1]
    levels = np.empty(innovations.shape[:2])
    fill_levels(
        innovations,
        loop,
        slope,
        step,
        int(_SETTLED * n_samples),
        loop_histories(),
        np.empty((-(-n_samples // TILE), TILE * LANES)),
        np.zeros((4, (TILE + 1) * LANES)),
        levels,
    )
    # Squares of extreme windows may have overflowed or underflowed.
    extreme = np.flatnonzero(np.any(~((levels > 1e-140) & (levels < 1e140)), axis=1))
    if len(extreme) > 0:
        error = observe(innovations[extreme], loop)[0]
        if step == 0:
            levels[extreme] = root_mean_square(error)
        else:
            surface = sliding_surface(error, slope)
            gain = switching_gain(surface.reshape(-1, n_samples), step).reshape(surface.shape)
            levels[extreme] = settled_level(gain)
    return levels


@compiled
def fill_levels(
    innovations: Any,
    loop: Any,
    slope: Any,
    step: Any,
    settled: Any,
    histories: Any,
    sizes: Any,
    votes: Any,
    levels: Any,
) -> None:
    """Fill `levels`, block by block.

    `settled` is the first sample of the average. `sizes` and `votes` are working memory: sizes of
    the surface, and the histories of the gain's loop.
    """
    n_windows, n_models, n_samples = innovations.shape
    up, down = math.exp(step), math.exp(-step)
    for w in range(0, n_windows, LANES):
        for c in range(n_models):
            start_loop(innovations, w, c, histories)
            for row in range(len(votes)):
                for lane in range(LANES):
                    votes[row, lane] = 0.0
            for tile in range(len(sizes)):
                start = tile * TILE
                observe_block(innovations, w, c, start, loop, histories)
                if step > 0:
                    _size_block(histories, slope, sizes, tile, votes)
                else:
                    _square_block(histories, votes)
                length = min(TILE, n_samples - start)
                carry_loop(histories, length)
                carry(votes[POWER], length)
            for lane in range(LANES):
                votes[GAIN, lane] = math.sqrt(votes[POWER, lane] / n_samples)
            # The gain starts at the root mean square of the surface, so it needs a second pass.
            for tile in range(len(sizes) if step > 0 else 0):
                start = tile * TILE
                _vote_block(sizes, tile, settled - start, up, down, votes)
                for row in range(GAIN, SETTLED_STEPS + 1):
                    carry(votes[row], min(TILE, n_samples - start))
            for lane in range(min(LANES, n_windows - w)):
                mean = votes[SETTLED_STEPS, lane] / (n_samples - settled)
                levels[w + lane, c] = math.sqrt(votes[POWER, lane] / n_samples) * math.exp(
                    step * mean
                )


@inlined
def _square_block(histories, votes):
    """Add the squares of a block of errors."""
    for i in range(TILE * LANES):
        votes[POWER, i + LANES] = votes[POWER, i] + histories[ERROR, i + LANES] ** 2


@inlined
def _size_block(histories, slope, sizes, tile, votes):
    """Compute the absolute value of the sliding surface, and the sum of its squares."""
    for i in range(TILE * LANES):
        error = histories[ERROR, i + LANES]
        surface = slope * error + (error - histories[ERROR, i])
        sizes[tile, i] = abs(surface)
        votes[POWER, i + LANES] = votes[POWER, i] + surface * surface


@inlined
def _vote_block(sizes, tile, settled, up, down, votes):
    """Change the gain by one step for each sample."""
    for i in range(TILE * LANES):
        size, gain = sizes[tile, i], votes[GAIN, i]
        steps = votes[STEPS, i] + ((1.0 if size > gain else 0.0) - (1.0 if size < gain else 0.0))
        votes[GAIN, i + LANES] = gain * (up if size > gain else (down if size < gain else 1.0))
        votes[STEPS, i + LANES] = steps
        votes[SETTLED_STEPS, i + LANES] = votes[SETTLED_STEPS, i] + (
            steps if i >= settled * LANES else 0.0
        )


def cepstral_norm(log_spectra: NDArray[Any], exponent: float) -> NDArray[Any]:
    r"""Compute the weighted cepstral norm :math:`\sum_{n \ge 1} n^p d_n^2` of log spectra.

    Here :math:`d_n` are the cosine coefficients over frequency. Coefficient 0, which is the gain,
    is excluded. With p = 1, the norm is Martin's metric between autoregressive models (Martin
    2000).

    Parameters
    ----------
    log_spectra : ndarray of shape (n_signals, n_frequencies)
        Log spectra at the midpoints of equal cells.
    exponent : float
        The exponent p, at least 0.

    Returns
    -------
    ndarray of shape (n_signals,)
        The norm; 0 for a white spectrum, whatever its power.

    Examples
    --------
    >>> cepstral_norm(np.full((1, 8), 3.0), exponent=0.5).round(12)
    array([0.])
    """
    coefficients = cepstrum(log_spectra)
    weights = np.arange(1.0, coefficients.shape[-1] + 1) ** exponent
    return np.sum(weights * coefficients**2, axis=-1)
