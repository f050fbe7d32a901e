"""Shaft speeds: what users give, and what a signal tells."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Turns of the shaft below which a stretch says nothing of orders.
LEAST_TURNS = 3


def samples_a_turn(
    rpm: ArrayLike, sampling_rate: float | None, n_stretches: int, n_samples: int
) -> NDArray[Any]:
    """Samples in a turn of the shaft, from nominal speeds.

    Parameters
    ----------
    rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples)
        Revolutions per minute.
    sampling_rate : float or None
        In Hz.
    n_stretches, n_samples : int
        Shape of the stretches.

    Returns
    -------
    ndarray of shape (n_stretches,) or (n_stretches, n_samples)
        Samples that a turn takes.

    Raises
    ------
    ValueError
        If there is no sampling rate; if a speed is not above 0 or the shape is another; or if a
        stretch has less than 3 turns.
    """
    if sampling_rate is None:
        raise ValueError("rpm was given, but sampling_rate is None; expected a number in Hz.")
    speeds = check_speeds(rpm, n_stretches, n_samples)
    mean = speeds if speeds.ndim == 1 else speeds.mean(axis=1)
    turns = n_samples * mean / (60 * sampling_rate)
    if turns.min() < LEAST_TURNS:
        needed = int(np.ceil(LEAST_TURNS * 60 * sampling_rate / mean.min()))
        raise ValueError(
            f"X has stretches of {n_samples} samples, which are {turns.min():.3g} turns at "
            f"{mean.min():g} rpm and {sampling_rate:g} Hz; expected at least {LEAST_TURNS} turns, "
            f"{needed} samples."
        )
    return 60 * sampling_rate / speeds


def check_speeds(rpm: ArrayLike, n_stretches: int, n_samples: int) -> NDArray[Any]:
    """Check nominal speeds.

    Parameters
    ----------
    rpm : float, array-like of shape (n_stretches,) or (n_stretches, n_samples)
        Revolutions per minute.
    n_stretches, n_samples : int
        Shape of the stretches.

    Returns
    -------
    ndarray of shape (n_stretches,) or (n_stretches, n_samples)
        Speeds. Innovations lack the first samples of a stretch, for which a model is still
        settling; where speeds have more samples than the stretches, the last ones are taken.

    Raises
    ------
    ValueError
        If a speed is not above 0, or the shape is another.
    """
    try:
        speeds = np.asarray(rpm, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"rpm must hold numbers, got {rpm!r}.") from error
    if speeds.ndim == 0:
        speeds = np.full(n_stretches, speeds)
    fits = speeds.shape == (n_stretches,) or (
        speeds.ndim == 2
        and len(speeds) == n_stretches
        and n_samples <= speeds.shape[1] <= 2 * n_samples
    )
    if not fits:
        raise ValueError(
            f"rpm has shape {speeds.shape}, expected one speed for each of {n_stretches} stretches "
            f"or one for each of their samples, ({n_stretches}, {n_samples})."
        )
    bad = np.argwhere(~(np.isfinite(speeds) & (speeds > 0)))
    if len(bad) > 0:
        raise ValueError(
            f"rpm holds {speeds[tuple(bad[0])]:g} for stretch {bad[0][0]}, expected revolutions "
            "per minute above 0."
        )
    return speeds if speeds.ndim == 1 else speeds[:, speeds.shape[1] - n_samples :]
