"""Whether a window carries a signal at all."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import check_array

from ._parallel import map_batches
from ._validation import check_real
from .kernels.scaling import ROUNDING

#: A window whose values lie on fewer levels than this is the last bit of a converter, not a signal.
_FEWEST_LEVELS = 8
#: Shorter windows may lie on few levels by chance.
_SHORTEST_COARSE = 64


def signal_quality(
    X: ArrayLike, *, clipped_share: float = 0.02, held_share: float = 0.5
) -> NDArray[Any]:
    """Whether each window carries a signal, and if not, why.

    An estimator must answer for every row that it is given, also for the row of a sensor that was
    unplugged. This function tells such rows apart, so that nobody reads a verdict out of them. It
    looks at every window by itself and needs no calibration. No criterion depends on the unit of
    the signal. A window is, in this order,

    - ``"not finite"``: some sample is NaN or infinite, in any channel. All estimators refuse such a
      window.
    - ``"constant"``: the output does not move by more than rounding (8 times the resolution of
      double precision) of its largest value. The sensor is dead or not connected.
    - ``"held"``: more than `held_share` of the samples of the output repeat the sample before, but
      for rounding of the largest value. Most of the window is dropouts, the logger held its last
      value, or one sample is so large that nothing else counts.
    - ``"coarse"``: the range of the output is less than 7 times its smallest step, so that the
      samples lie on fewer than 8 levels. The signal is lost below the last bit of the converter.
    - ``"clipped"``: more than `clipped_share` of the samples of the output are equal to its largest
      or to its smallest value. The amplifier or the converter is saturated.
    - ``"good"``: none of these.

    Measured inputs, the channels after the first, may well be constant: a torque that is held, or a
    speed. Only NaN and infinity count there.

    Parameters
    ----------
    X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
        Windows in any unit; NaN is allowed.
    clipped_share : float, default=0.02
        Share of samples in (0, 1] that may lie at the two extremes of a window. The default lets
        Gaussian noise pass that is clipped beyond 2.33 standard deviations.
    held_share : float, default=0.5
        Share of samples in (0, 1] that may repeat the sample before.

    Returns
    -------
    ndarray of str of shape (n_windows,)
        One of the names above for each window. ``signal_quality(X) == "good"`` is the mask of
        windows that can be diagnosed.

    Raises
    ------
    ValueError
        If X has another number of axes, or a share is out of its range.

    Notes
    -----
    `ARXLaguerre` leaves windows of constant output out of its sums. `window_verdicts`,
    `recording_verdicts` and `ConditionMonitor` give windows without a signal no verdict. All other
    estimators diagnose them like any window, and the result means nothing.

    Short windows say little. Two samples at the extremes, one at each, never count as clipped, and
    a window of fewer than 64 samples never counts as coarse.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(0).normal(size=(4, 1000))
    >>> noise[1] = 0.3                       # a dead sensor
    >>> noise[2] = noise[2].clip(-1, 1)      # a saturated amplifier
    >>> noise[3, 200:] = 0.0                 # a cable that came off
    >>> signal_quality(noise).tolist()
    ['good', 'constant', 'clipped', 'held']
    """
    for name, share in (("clipped_share", clipped_share), ("held_share", held_share)):
        check_real(share, name, min_val=0, max_val=1, include_boundaries="right")
    X = check_array(
        X,
        dtype=[np.float64, np.float32],
        allow_nd=True,
        ensure_all_finite=False,
        input_name="X",
    )
    if X.ndim > 3:
        raise ValueError(
            f"X has shape {X.shape}, expected (n_windows, n_samples) or "
            "(n_windows, 1 + n_inputs, n_samples)."
        )
    parts = map_batches(
        lambda batch: _quality_of_batch(X[batch], clipped_share, held_share), len(X), None
    )
    return np.concatenate(parts)


def _quality_of_batch(windows, clipped_share, held_share):
    output = windows if windows.ndim == 2 else windows[:, 0]
    # NaN and infinity show in the extremes, which are needed anyway.
    highest, lowest = output.max(axis=1), output.min(axis=1)
    finite = np.isfinite(highest) & np.isfinite(lowest)
    if windows.ndim == 3 and windows.shape[1] > 1:
        finite &= np.isfinite(windows[:, 1:]).all(axis=(1, 2))
    if not finite.all():
        output = np.where(finite[:, np.newaxis], output, 0)
        highest, lowest = np.where(finite, highest, 0), np.where(finite, lowest, 0)
    n_samples = output.shape[1]
    largest = np.maximum(highest, -lowest)
    # Halved, so that the range of values near the largest number does not overflow.
    half_range = highest / 2 - lowest / 2
    if largest.max() > np.finfo(output.dtype).max / 4:
        steps = np.diff(output / 2, axis=1)
    else:
        steps = np.diff(output, axis=1)
        steps /= 2
    np.abs(steps, out=steps)
    # What lies below the rounding of the largest value is lost where that is one huge sample.
    stays = steps <= ROUNDING / 2 * largest[:, np.newaxis]
    held = np.count_nonzero(stays, axis=1)
    steps[stays] = np.inf
    smallest_step = steps.min(axis=1, initial=np.inf)
    n_extreme = np.count_nonzero(output == highest[:, np.newaxis], axis=1)
    n_extreme += np.count_nonzero(output == lowest[:, np.newaxis], axis=1)
    names = ["not finite", "constant", "held", "coarse", "clipped"]
    found = [
        ~finite,
        half_range <= ROUNDING / 2 * largest,
        held > held_share * n_samples,
        (half_range / (_FEWEST_LEVELS - 1.5) < smallest_step) & (n_samples >= _SHORTEST_COARSE),
        (n_extreme > clipped_share * n_samples) & (n_extreme > 2),
    ]
    return np.select(found, names, default="good")
