"""Whether a window carries a signal at all."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils import check_array

from ._parallel import map_batches
from ._validation import check_real
from .kernels.scaling import ROUNDING

#: A window whose values lie on fewer levels than this is the last bit of a converter, not a signal.
_FEWEST_LEVELS = 8
#: Shorter windows may lie on few levels by chance.
_SHORTEST_COARSE = 64
#: Shorter stretches of equal samples may come from quantisation.
_SHORTEST_STUCK = 16
#: Steps of more than `_LEAP` of the range are leaps. They come from wrapping round if linear
#: prediction of this order misses some of them by `_UNFORESEEN` of the range, and if some samples
#: lie in the outer `_EDGE` of the range at either end, where a signal that was not cut has few.
_LEAP, _UNFORESEEN, _FEWEST_LEAPS, _EDGE, _FEWEST_AT_ENDS, _ORDER = 0.75, 0.4, 4, 0.02, 5, 8
#: A decade of the spectrum is missing if its density, in so many bands, is this much below that of
#: the rest.
_EMPTY, _FEWEST_BINS, _BANDS = 1e-6, 200, 8
_MAINS = (50.0, 60.0)
#: Periods of the mains frequency in a window, so that it differs from a drift; and the largest
#: deviation from it in Hz.
_FEWEST_PERIODS, _DEVIATION = 3, 0.5

#: Names in the order of the criteria.
_NAMES = ("not finite", "constant", "held", "stuck", "coarse", "clipped", "wrapped")
_NAMES += ("band missing", "hum")


def signal_quality(
    X: ArrayLike,
    *,
    sampling_rate: float | None = None,
    clipped_share: float = 0.02,
    held_share: float = 0.5,
    stuck_share: float = 0.1,
    hum_share: float = 0.99,
    return_share: bool = False,
) -> Any:
    """Return whether each window carries a signal, and if not, why.

    An estimator must answer for every row, even for the row of a sensor that was unplugged. This
    function finds such rows, so that nobody trusts their verdicts. It looks at every window by
    itself and needs no calibration. No criterion depends on the unit of the signal. In this order,
    a window is

    - ``"not finite"``: some sample is NaN or infinite, in any channel. All estimators refuse such a
      window. Its share counts these samples.
    - ``"constant"``: the output does not move by more than rounding (8 times the resolution of
      double precision) of its largest value. The sensor is dead or not connected.
    - ``"held"``: more than `held_share` of the samples of the output repeat the sample before, but
      for rounding of the largest value. Most of the window is dropouts, the logger held its last
      value, or one sample is so large that nothing else counts.
    - ``"stuck"``: the longest run of equal samples is longer than `stuck_share` of the window and
      than 16 samples. A cable was loose, or the logger lost a block.
    - ``"coarse"``: the range of the output is less than 7 times its smallest step, so that the
      samples lie on fewer than 8 levels. The signal is lost below the last bit of the converter.
      Its share is that of one step in the range.
    - ``"clipped"``: more than `clipped_share` of the samples of the output are equal to its largest
      or to its smallest value. The amplifier or the converter is saturated.
    - ``"wrapped"``: the output leaps by more than 75 % of its range. A linear prediction of order
      8 misses at least 4 leaps, and at least 5 samples lie at either end of the range. Values
      beyond the range of an integer type continued at its other end. Its share counts the leaps.
    - ``"band missing"``: in a decade of frequency, the mean power density of narrow bands is more
      than 60 dB below the
      median of all other frequencies. The signal was filtered, or was recorded at a lower rate. Its
      share is that of the decade in all frequencies.
    - ``"hum"``: a sine of 50 or 60 Hz has more than `hum_share` of the energy of the output without
      its trend. A shield is not grounded. This requires `sampling_rate` and windows of at least
      three periods.
    - ``"good"``: none of these.

    Measured inputs, the channels after the first, may well be constant: a torque that is held, or a
    speed. Only NaN and infinity count there.

    Parameters
    ----------
    X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
        Windows in any unit; NaN is allowed.
    sampling_rate : float, default=None
        In Hz, above 0. None does not look for hum.
    clipped_share : float, default=0.02
        Share of samples in (0, 1] that may lie at the two extremes of a window. The default accepts
        Gaussian noise that is clipped beyond 2.33 standard deviations.
    held_share : float, default=0.5
        Share of samples in (0, 1] that may repeat the sample before.
    stuck_share : float, default=0.1
        Share of samples in (0, 1] that may follow each other with the same value.
    hum_share : float, default=0.99
        Share of energy in (0, 1] that a sine of the mains frequency may have. The default accepts a
        sine of up to 20 dB above the rest.
    return_share : bool, default=False
        Whether to return the shares, too.

    Returns
    -------
    quality : ndarray of str of shape (n_windows,)
        One of the names above for each window. ``signal_quality(X) == "good"`` is the mask of
        windows that can be diagnosed.
    share : ndarray of float of shape (n_windows,)
        Share in [0, 1] of each window to which its quality applies, 0 if it is good. Only if
        `return_share` is true.

    Raises
    ------
    ValueError
        If X has another number of axes, or a share or the sampling rate is out of its range.

    Notes
    -----
    Estimators treat such windows as follows: `ARXLaguerre` leaves windows of constant output out of
    its sums. The diagnosers return the prior probabilities (`predict_proba`); a detector flags
    them. `predict` of a diagnoser returns one of its conditions for them, which means nothing.
    `window_verdicts` returns "no signal".

    Short windows are judged by fewer criteria. Two samples at the extremes, one at each, never
    count as clipped. A window of fewer than 64 samples is never coarse or wrapped, and one of fewer
    than 400 never has a missing band. A few samples that wrapped
    round cannot be told from impacts, nor can white noise of uniform distribution from a signal
    that wrapped round often.

    Examples
    --------
    >>> import numpy as np
    >>> noise = np.random.default_rng(0).normal(size=(5, 1000))
    >>> noise[1] = 0.3                       # a dead sensor
    >>> noise[2] = noise[2].clip(-1, 1)      # a saturated amplifier
    >>> noise[3, 200:] = 0.0                 # a cable that came off
    >>> noise[4, 200:400] = 0.0              # a lost block
    >>> quality, share = signal_quality(noise, return_share=True)
    >>> quality.tolist()
    ['good', 'constant', 'clipped', 'held', 'stuck']
    >>> share.round(2)
    array([0.  , 1.  , 0.32, 0.8 , 0.2 ])
    """
    shares = {
        "clipped_share": clipped_share,
        "held_share": held_share,
        "stuck_share": stuck_share,
        "hum_share": hum_share,
    }
    for name, share in shares.items():
        check_real(share, name, min_val=0, max_val=1, include_boundaries="right")
    if sampling_rate is not None:
        check_real(sampling_rate, "sampling_rate", min_val=0, include_boundaries="neither")
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
        lambda batch: _quality_of_batch(X[batch], sampling_rate, **shares), len(X), None
    )
    found, share = (np.concatenate(each) for each in zip(*parts, strict=True))
    quality = np.array([*_NAMES, "good"])[found]
    return (quality, share) if return_share else quality


def _quality_of_batch(windows, sampling_rate, clipped_share, held_share, stuck_share, hum_share):
    output = windows if windows.ndim == 2 else windows[:, 0]
    # NaN and infinity show in the extremes, which are needed anyway.
    highest, lowest = output.max(axis=1), output.min(axis=1)
    finite = np.isfinite(highest) & np.isfinite(lowest)
    if windows.ndim == 3 and windows.shape[1] > 1:
        finite &= np.isfinite(windows[:, 1:]).all(axis=(1, 2))
    not_finite = np.zeros(len(windows))
    if not finite.all():
        bad = ~np.isfinite(windows[~finite])
        not_finite[~finite] = bad.reshape(len(bad), -1).mean(axis=1)
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
    leaps = np.count_nonzero(steps > _LEAP * half_range[:, np.newaxis], axis=1)
    # Steps below the rounding of the largest value are lost, for instance next to one huge sample.
    stays = steps <= ROUNDING / 2 * largest[:, np.newaxis]
    held = np.count_nonzero(stays, axis=1)
    steps[stays] = np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        coarse = np.nan_to_num(steps.min(axis=1, initial=np.inf) / half_range, posinf=0.0)
    n_extreme = np.count_nonzero(output == highest[:, np.newaxis], axis=1)
    n_extreme += np.count_nonzero(output == lowest[:, np.newaxis], axis=1)
    run = _longest_runs(stays)
    criteria = [
        (~finite, not_finite),
        (half_range <= ROUNDING / 2 * largest, 1.0),
        (held > held_share * n_samples, held / n_samples),
        ((run > stuck_share * n_samples) & (run > _SHORTEST_STUCK), run / n_samples),
        ((coarse * (_FEWEST_LEVELS - 1.5) > 1) & (n_samples >= _SHORTEST_COARSE), coarse),
        ((n_extreme > clipped_share * n_samples) & (n_extreme > 2), n_extreme / n_samples),
        (np.zeros(len(output), dtype=bool), leaps / n_samples),
    ]
    failed = np.array([fails for fails, _ in criteria] + [np.zeros_like(finite)] * 2)
    share = np.array([np.broadcast_to(each, len(output)) for _, each in criteria] + [0 * held] * 2)
    # The other criteria cost more, and only make sense for a signal that moves.
    rest = np.flatnonzero(~failed.any(axis=0))
    if n_samples >= _SHORTEST_COARSE:
        for i in rest[leaps[rest] >= _FEWEST_LEAPS]:
            failed[6, i] = _is_wrapped((output[i] / largest[i]).astype(np.float64))
    scaled = (output[rest] / largest[rest, np.newaxis]).astype(np.float64)
    if len(rest) and n_samples >= 2 * _FEWEST_BINS:
        failed[7, rest], share[7, rest] = _missing_decade(scaled)
    if len(rest) and sampling_rate is not None:
        share[8, rest] = _hum(scaled, sampling_rate)
        failed[8, rest] = share[8, rest] > hum_share
    found = np.where(failed.any(axis=0), failed.argmax(axis=0), len(_NAMES))
    share = np.vstack([share, np.zeros(len(output))])
    return found, share[found, np.arange(len(output))]


def _longest_runs(stays):
    """Samples of the longest run of equal samples in each row, from whether each step is zero."""
    place = np.arange(1, stays.shape[1] + 1)
    last_move = np.maximum.accumulate(np.where(stays, 0, place), axis=1)
    return (place - last_move).max(axis=1, initial=0) + 1


def _is_wrapped(signal):
    """Whether the signal ends abruptly at both ends of its range, and leaps unforeseen."""
    signal = signal - signal.mean()
    zone = _EDGE * np.ptp(signal)
    n_at_ends = min(np.sum(signal > signal.max() - zone), np.sum(signal < signal.min() + zone))
    past = np.lib.stride_tricks.sliding_window_view(signal, _ORDER)[:-1]
    coef, *_ = np.linalg.lstsq(past, signal[_ORDER:], rcond=None)
    errors = np.abs(signal[_ORDER:] - past @ coef)
    is_leap = np.abs(np.diff(signal[_ORDER - 1 :])) > _LEAP * np.ptp(signal)
    n_unforeseen = np.count_nonzero(errors[is_leap] > _UNFORESEEN * np.ptp(signal))
    return n_at_ends >= _FEWEST_AT_ENDS and n_unforeseen >= _FEWEST_LEAPS


def _missing_decade(windows):
    """Whether a decade of the spectrum is empty, and its share of all frequencies."""
    n_bins = windows.shape[1] // 2
    spectra = np.fft.rfft(_detrended(windows) * np.hanning(windows.shape[1]), axis=1)
    power = np.abs(spectra[:, 1 : n_bins + 1]) ** 2
    edges = np.unique(np.geomspace(1, n_bins, 1 + int(_BANDS * np.log10(n_bins))).astype(int))
    density = np.add.reduceat(power, edges[:-1], axis=1) / np.diff(edges, append=n_bins)[:-1]
    missing, share = np.zeros(len(windows), dtype=bool), np.zeros(len(windows))
    for low in edges[edges <= n_bins / 10]:
        inside = (edges[:-1] >= low) & (edges[1:] <= 10 * low)
        # A line at the edge does not fill the decade.
        highest = np.sort(density[:, inside], axis=1)[:, -2]
        empty = highest < _EMPTY * np.median(density[:, ~inside], axis=1)
        missing |= empty
        share[empty] = 9 * low / n_bins
    return missing, share


def _detrended(windows):
    place = np.linspace(-1, 1, windows.shape[-1])
    basis = np.linalg.qr(np.stack([np.ones_like(place), place], axis=1))[0]
    return windows - windows @ basis @ basis.T


def _hum(windows, sampling_rate):
    """Share of energy that a sine of 50 or 60 Hz has, apart from a linear trend."""
    n_samples = windows.shape[1]
    seconds = (np.arange(n_samples) - (n_samples - 1) / 2) / sampling_rate
    duration, share = n_samples / sampling_rate, np.zeros(len(windows))
    signal = _detrended(windows)
    energy = np.sum(signal**2, axis=1)
    for mains in _MAINS:
        if duration * mains < _FEWEST_PERIODS or mains > sampling_rate / 4:
            continue
        # With its derivative, a sine fits frequencies that differ by a quarter of the resolution.
        n_steps = int(np.ceil(2 * _DEVIATION * duration))
        for frequency in mains + np.arange(-n_steps, n_steps + 1) / (2 * duration):
            phase = 2 * np.pi * frequency * seconds
            sine = np.stack([np.cos(phase), np.sin(phase)], axis=1)
            basis = _detrended(np.hstack([sine, seconds[:, np.newaxis] * sine]).T).T
            fitted = np.sum((signal @ np.linalg.qr(basis)[0]) ** 2, axis=1)
            share = np.maximum(share, fitted / energy)
    return share.clip(max=1.0)
