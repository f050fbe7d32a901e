"""Hum of the mains in windows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Frequencies of the mains in Hz.
MAINS = (50.0, 60.0)
#: Share of the energy that a sine of the mains may have: one of up to 20 dB above the
#: rest is accepted.
LARGEST_SHARE = 0.99
#: Highest order of the shaft that can be so strong a line: unbalance makes the first,
#: misalignment the second. On six rigs, lines of the first have up to 79 % of the
#: energy, of the third 23 %.
_LAST_ORDER = 2
#: Seconds of the pieces in which hum is looked for: the mains frequency wanders in
#: longer ones.
_HUM_SECONDS = 1.0
#: Periods of the mains frequency in a window, so that it differs from a drift; and the
#: largest deviation from it in Hz.
_FEWEST_PERIODS = 3
_DEVIATION = 0.5
#: Share by which stated speeds differ from true ones.
_SPEED_ERROR = 0.01


def without_trend(windows: NDArray[Any]) -> NDArray[Any]:
    """Return windows less the straight line of least squares through each of them."""
    centred = windows - windows.mean(axis=-1, keepdims=True)
    time = np.linspace(-1, 1, windows.shape[-1])
    # A product of matrices rounds a row by the number of rows.
    slopes = np.einsum("wk,k->w", centred, time) / (time @ time)
    return centred - slopes[:, np.newaxis] * time


def share_of_hum(
    windows: NDArray[Any], sampling_rate: float, shaft_frequency: NDArray[Any]
) -> NDArray[Any]:
    """Return the share of energy that a sine of 50 or 60 Hz has in windows without a trend.

    It is 0 if the shaft has its first or second order there.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_samples)
        Windows without a trend.
    sampling_rate : float
        In Hz.
    shaft_frequency : ndarray of shape (n_windows,)
        In Hz, NaN if it is not known.

    Returns
    -------
    ndarray of shape (n_windows,)
        Shares in [0, 1].
    """
    n_rows, n_samples = windows.shape
    n_pieces = max(int(n_samples / (_HUM_SECONDS * sampling_rate)), 1)
    if n_pieces > 1:
        n_samples //= n_pieces
        windows = windows[:, : n_pieces * n_samples].reshape(-1, n_samples)
        windows = without_trend(windows)
        shaft_frequency = np.repeat(shaft_frequency, n_pieces)
    seconds = (np.arange(n_samples) - (n_samples - 1) / 2) / sampling_rate
    duration = n_samples / sampling_rate
    energy = np.einsum("wk,wk->w", windows, windows)
    fitted = np.zeros(len(windows))
    # The steps of a sine have at most the power of its angular frequency, and those of
    # the rest at most twice its amplitude. Windows with larger steps need no closer
    # look.
    steps = np.diff(windows, axis=1)
    steps = np.einsum("wk,wk->w", steps, steps)
    of_sine = 2 * np.pi * (max(MAINS) + _DEVIATION) / sampling_rate
    most = of_sine + 2 * np.sqrt(1 - LARGEST_SHARE)
    slow = np.flatnonzero(steps <= 1.2 * most**2 * energy)
    for mains in MAINS:
        if duration * mains < _FEWEST_PERIODS or mains > sampling_rate / 4:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.round(mains / shaft_frequency[slow]).clip(1, _LAST_ORDER)
            distance = np.abs(order * shaft_frequency[slow] - mains)
        # The window does not resolve closer lines.
        is_of_shaft = distance <= max(_DEVIATION, _SPEED_ERROR * mains, 1 / duration)
        candidates = slow[~is_of_shaft]
        if len(candidates) > 0:
            of_sine = _energy_of_sine(windows[candidates], seconds, mains, duration)
            fitted[candidates] = np.maximum(fitted[candidates], of_sine)
    fitted = fitted.reshape(n_rows, n_pieces).sum(axis=1)
    energy = energy.reshape(n_rows, n_pieces).sum(axis=1)
    share = np.divide(fitted, energy, out=np.zeros(n_rows), where=energy > 0)
    return share.clip(max=1.0)


def _energy_of_sine(pieces, seconds, mains, duration):
    """Return the largest energy of a sine near a mains frequency in each piece."""
    # With its derivative, a sine fits frequencies that differ by a quarter of the
    # resolution.
    n_steps = int(np.ceil(2 * _DEVIATION * duration))
    largest_energy = np.zeros(len(pieces))
    for frequency in mains + np.arange(-n_steps, n_steps + 1) / (2 * duration):
        phase = 2 * np.pi * frequency * seconds
        sine = np.stack([np.cos(phase), np.sin(phase)])
        terms = without_trend(np.concatenate([sine, seconds * sine]))
        basis = np.linalg.qr(terms.T)[0]
        energy = np.sum((pieces @ basis) ** 2, axis=1)
        largest_energy = np.maximum(largest_energy, energy)
    return largest_energy
