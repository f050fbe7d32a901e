"""Find windows that carry no signal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft
from sklearn.utils import check_array

from ..core.parallel import map_batches
from ..core.speeds import speeds_of_rows
from ..core.state import expect
from ..core.validation import ABOVE_0, as_samples, check_real
from ..kernels.sample_statistics import sample_statistics
from ..kernels.scaling import ROUNDING, largest
from ..kernels.short_time import windowed_segments
from . import mains_hum

#: Sizes that instruments write for an overflow or a missing value. They count if all
#: other samples are smaller by this ratio, because counts of a converter are signals.
_SENTINELS = np.array([[999.25, 9999.0, 99999.0, 9.9e37, 9.91e37]])
_OUTSTANDING = 3.0
#: Share of samples that may repeat the sample before, and of those that may do so in
#: one run.
_HELD = 0.5
_STUCK = 0.1
#: Share of the root-mean-square step of a window below which a step counts as none, as
#: converters of many bits record their own noise. The range would be no measure: it
#: grows with the length of a window, and steps are small compared with it if the signal is
#: slow.
_STILL = 1e-4
#: Shorter runs of equal samples may come from quantisation.
_SHORTEST_STUCK = 16
#: A window whose values lie on fewer levels than this is the last bit of a converter,
#: not a signal.
_FEWEST_LEVELS = 8
#: Shorter windows may lie on few levels by chance.
_SHORTEST_COARSE = 64
#: Share of samples that may lie at the two extremes: Gaussian noise that is clipped
#: beyond 2.33 standard deviations is accepted. A clipped signal has this many times as
#: many samples there as within `_NEAR` of its range, or one step, of them. A quantised
#: sine has about as many near them.
_CLIPPED = 0.02
_PILED_UP = 3
_NEAR = 0.01
#: Steps of more than this share of the range are leaps. They come from wrapping round
#: if linear prediction of `_ORDER` misses at least `_FEWEST_LEAPS` of them by
#: `_UNFORESEEN` of the range, and if at least `_FEWEST_AT_ENDS` samples lie in the
#: outer `_EDGE` of the range at either end, where a signal that was not cut has few.
_LEAP = 0.75
_ORDER = 8
_FEWEST_LEAPS = 4
_UNFORESEEN = 0.4
_FEWEST_AT_ENDS = 6
_EDGE = 0.02
#: Steps by which a straight line may be rounded, or begin again.
_RAMP_STEPS = 2
#: Shares of a long window that both must have at least: a few impacts in a minute are
#: no wrapping.
_LEAST_LEAPS = 5e-4
_LEAST_AT_ENDS = 1e-3
#: Samples in a segment of the spectrum whose bands are judged. Every window has
#: segments of this length, so that its bands do not depend on how long it is.
_SEGMENT = 512
#: Samples whose segments are transformed at a time, or those of one window.
_SAMPLES_AT_A_TIME = 2**16
#: Kaiser window of a segment. Its side lobes are 130 dB below a line.
_TAPER = np.kaiser(_SEGMENT, 18)
#: A band is empty if its density is this much below the mean of all bands: the model of
#: a window that `LogSpectra` identifies has a ridge of this size, and does not see such
#: bands.
_EMPTY = 1e-9
#: Share of the bands that may be empty. Signals at four times the rate that they need,
#: and those of sensors behind low-pass filters, are accepted. A sine without noise
#: fills 6 %.
_MOST_EMPTY = 0.8


def signal_quality(
    X: ArrayLike,
    *,
    sampling_rate: float | None = None,
    rpm: ArrayLike | None = None,
    return_share: bool = False,
) -> Any:
    """Return whether each window carries a signal, and if not, why.

    An estimator returns a prediction for every row, even for that of an unplugged
    sensor. This function finds such rows. It tests each window separately and needs no
    calibration. No criterion depends on the unit of the signal. The criteria are, in
    this order:

    - ``"not finite"``: some sample is NaN or infinite, in any channel. All estimators
      refuse such a window. Its share counts these samples.
    - ``"overflow"``: some samples of the output are of a size that instruments write for
      an overflow or a missing value, such as -9999 or 9.9e37, and more than three times
      as large as all others. Its share counts these samples.
    - ``"constant"``: the output does not move by more than rounding (8 times the
      resolution of double precision) of its largest value. The sensor is dead or not
      connected.
    - ``"held"``: more than half of the samples of the output repeat the sample before,
      but for 1e-4 of the root-mean-square step. Most of the window is dropouts, the
      logger held its last value, or one sample is so large that nothing else counts.
    - ``"stuck"``: the longest run of samples that are equal but for 1e-4 of the
      root-mean-square step is longer than a tenth of the window and than 16 samples. A
      cable was loose, or the logger lost a block.
    - ``"coarse"``: the range of the output is less than 7 times its smallest step, so
      that the samples lie on fewer than 8 levels. The signal is lost below the last bit
      of the converter. Its share is that of one step in the range.
    - ``"clipped"``: more than 2 % of the samples of the output are equal to its largest
      or to its smallest value, and these are more than three times as many as lie
      within 1 % of the range, or one step, of them. The amplifier or the converter is
      saturated.
    - ``"wrapped"``: the output leaps by more than 75 % of its range. A linear
      prediction of order 8 misses at least 4 leaps and 0.05 % of the samples, and at
      least 6 samples and 0.1 % lie at either end of the range. Values beyond the range
      of an integer type continued at its other end. Its share counts the leaps.
    - ``"ramp"``: the output is a straight line, but for two of its steps. It holds
      times or counts samples.
    - ``"band missing"``: more than 80 % of the frequency bands are empty. Bands are
      equally wide, from 0 to half the sampling rate. A band is empty if its power
      density is more than 90 dB below the mean of all bands. The signal is lines
      without noise, or was recorded at less than a fifth of its rate. Its share is that
      of the empty bands. Filters of ordinary sensors, such as the high-pass filter of
      an AC-coupled one, leave enough bands.
    - ``"hum"``: a sine of 50 or 60 Hz has more than 99 % of the energy of the output
      without its trend. A shield is not grounded. This requires `sampling_rate` and
      windows of at least three periods. A line at the speed of the shaft or at twice
      that is not called hum.
    - ``"good"``: none of these.

    Measured inputs, the channels after the first, may well be constant: a torque that
    is held, or a speed. Only NaN and infinity count there.

    Parameters
    ----------
    X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
        Windows in any unit; NaN is allowed, and so are masked samples, which count as
        NaN.
    sampling_rate : float, default=None
        In Hz, above 0. None does not look for hum.
    rpm : float, array-like of shape (n_windows,) or None, default=None
        Shaft speed of each window in rev/min, NaN where it is not known. The mains
        frequency is not looked for if it is closer to the shaft's frequency, or to
        twice that, than 1 %, 0.5 Hz or the resolution of the window, which is 1 Hz for
        windows of a second and more.
    return_share : bool, default=False
        Whether to return the shares, too.

    Returns
    -------
    quality : ndarray of str of shape (n_windows,)
        One of the names above for each window. ``signal_quality(X) == "good"`` is the
        mask of windows that can be diagnosed.
    share : ndarray of float of shape (n_windows,)
        Share in [0, 1] of each window to which its quality applies, 0 if it is good.
        Only if `return_share` is true.

    Raises
    ------
    ValueError
        If X has another number of axes, the sampling rate is not positive, or `rpm`
        does not fit X.

    Notes
    -----
    Estimators treat such windows as follows: `ARXLaguerre` leaves windows of constant
    output out of its sums. `predict_proba` of the diagnosers returns equal
    probabilities; a detector flags them. `predict` of a diagnoser returns one of its
    conditions for them, which means nothing. `window_verdicts` returns "no signal".

    Short windows are judged by fewer criteria. Two samples at the extremes, one at
    each, never count as clipped. A window of fewer than 64 samples is never coarse,
    wrapped or a ramp, and one of fewer than 512 never has a missing band. Otherwise,
    the criteria do not depend on the length of a window. A few samples that wrapped
    round look like impacts, and white noise of uniform distribution looks like a signal
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
    if sampling_rate is not None:
        check_real(sampling_rate, "sampling_rate", **ABOVE_0)
    X = check_array(
        as_samples(X, "X"),
        dtype=[np.float64, np.float32],
        allow_nd=True,
        ensure_all_finite=False,
    )
    shapes = "(n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)"
    expect(X.ndim <= 3, "X.shape", X.shape, shapes)
    frequencies = speeds_of_rows(np.nan if rpm is None else rpm, len(X)) / 60
    expect(frequencies.shape == (len(X),), "rpm", rpm, "one speed for each window")

    def of_batch(batch):
        return _quality_of_batch(X[batch], sampling_rate, frequencies[batch])

    parts = map_batches(of_batch, len(X), None)
    quality, share = map(np.concatenate, zip(*parts, strict=True))
    return (quality, share) if return_share else quality


def is_overflow(signals: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which samples are written by instruments for an overflow or a missing value.

    Parameters
    ----------
    signals : ndarray of shape (n_signals, n_samples)
        Signals.

    Returns
    -------
    ndarray of bool of shape (n_signals, n_samples)
        True for samples of such a size, if all other samples of the signal are less than
        a third of it.

    Examples
    --------
    >>> is_overflow(np.array([[1.0, -9999.0, 2.0], [9998.0, -9999.0, 2.0]]))
    array([[False,  True, False],
           [False, False, False]])
    """
    peak = largest(signals)
    overflow = np.zeros(signals.shape, dtype=bool)
    # Seven digits are left in single precision.
    has_size = (np.abs(peak / _SENTINELS - 1) <= 1e-6).any(axis=1)
    for row in np.flatnonzero(has_size):
        share = np.abs(signals[row]) / peak[row]
        is_written = share > 1 - 1e-6
        others = share[~is_written]
        overflow[row] = is_written & (others.max(initial=0) * _OUTSTANDING < 1)
        overflow[row] &= others.size > 0
    return overflow


def quality_of_outputs(
    X: NDArray[Any], outputs: Sequence[str], **options: Any
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return quality and share of rows with several outputs: of the first output that is bad.

    Parameters
    ----------
    X : ndarray of shape (n_windows, n_samples) or (n_windows, n_channels, n_samples)
        The first channels are the outputs.
    outputs : sequence of str
        Names of the outputs. The quality of several names the one that is bad.
    **options
        As `signal_quality` takes them.

    Returns
    -------
    quality, share : ndarray of shape (n_windows,)
        As `signal_quality` returns them.

    Examples
    --------
    >>> X = np.random.default_rng(0).normal(size=(1, 2, 1000))
    >>> X[:, 1] = 0.0
    >>> quality_of_outputs(X, ["left", "right"])
    (array(['constant in right'], dtype='<U17'), array([1.]))
    """
    if len(outputs) == 1:
        return signal_quality(X, return_share=True, **options)
    quality = np.full(len(X), "good", dtype=object)
    share = np.zeros(len(X))
    for s, name in reversed([*enumerate(outputs)]):
        found, shares = signal_quality(X[:, s:], return_share=True, **options)
        is_bad = found != "good"
        quality[is_bad] = [f"{criterion} in {name}" for criterion in found[is_bad]]
        share[is_bad] = shares[is_bad]
    return quality.astype(str), share


def _quality_of_batch(windows, sampling_rate, shaft_frequency):
    """Return the first criterion that each window fails, and the share of the window affected."""
    not_finite = (~np.isfinite(windows)).reshape(len(windows), -1).mean(axis=1)
    output = np.asarray(
        windows if windows.ndim == 2 else windows[:, 0], dtype=np.float64
    )
    if not_finite.any():
        output = np.where(not_finite[:, np.newaxis] > 0, 0.0, output)
    # In units of the largest value, so that no range overflows.
    peak = largest(output)
    scaled = output / np.where(peak == 0, 1.0, peak)
    n_windows, n_samples = scaled.shape
    # Steps below the rounding of the largest value are lost, for instance next to one
    # huge sample.
    found = sample_statistics(scaled, _LEAP, _STILL, ROUNDING)
    is_step = found.smallest_step < np.inf
    coarse = np.zeros(n_windows)
    np.divide(found.smallest_step, found.span, out=coarse, where=is_step)
    held = found.n_held / n_samples
    run = found.longest_run
    overflow = is_overflow(output).mean(axis=1)
    trendless = mains_hum.without_trend(scaled)
    # Shorter windows have no such bands, and without a rate there is no hum.
    empty = hum = np.zeros(n_windows)
    if n_samples >= _SEGMENT:
        empty = _empty_bands(trendless)
    if sampling_rate is not None:
        hum = mains_hum.share_of_hum(trendless, sampling_rate, shaft_frequency)
    checks = {
        "not finite": (not_finite > 0, not_finite),
        "overflow": (overflow > 0, overflow),
        "constant": (found.span <= ROUNDING, np.ones(n_windows)),
        "held": (held > _HELD, held),
        "stuck": (
            (run > _STUCK * n_samples) & (run > _SHORTEST_STUCK),
            run / n_samples,
        ),
        "coarse": (
            (coarse * (_FEWEST_LEVELS - 1.5) > 1) & (n_samples >= _SHORTEST_COARSE),
            coarse,
        ),
        "clipped": (_are_clipped(scaled, found, coarse), found.n_extreme / n_samples),
        "wrapped": (_wrapped(scaled, found.n_leaps), found.n_leaps / n_samples),
        "ramp": (_are_ramps(trendless, found.span), np.ones(n_windows)),
        "band missing": (empty > _MOST_EMPTY, empty),
        "hum": (hum > mains_hum.LARGEST_SHARE, hum),
    }
    quality = np.full(n_windows, "good", dtype="<U12")
    share = np.zeros(n_windows)
    # The first criterion that fails is written last.
    for name, (fails, of_window) in reversed(checks.items()):
        quality[fails] = name
        share[fails] = of_window[fails]
    return quality, share


def _are_ramps(trendless, span):
    """Return whether signals are straight lines, but for two of their steps."""
    n_samples = trendless.shape[1]
    steps = _RAMP_STEPS * span / (n_samples - 1)
    is_straight = largest(trendless)[:, 0] <= steps
    return is_straight & (n_samples >= _SHORTEST_COARSE)


def _are_clipped(windows, found, step):
    """Return whether windows are clipped. The steps are shares of the range."""
    least = np.maximum(_CLIPPED * windows.shape[1], 2)
    is_clipped = found.n_extreme > least
    for i in np.flatnonzero(is_clipped):
        n_near = _near_extremes(windows[i], step[i]) - found.n_extreme[i]
        is_clipped[i] = found.n_extreme[i] > _PILED_UP * n_near
    return is_clipped


def _near_extremes(window, step):
    """Count the samples at and near the extremes of a window, whose steps are a share of its range.

    A step of half of the range, as in a square wave, is not near.
    """
    highest = window.max()
    lowest = window.min()
    width = max(_NEAR, min(1.5 * step, 0.25)) * (highest - lowest)
    return np.sum((window >= highest - width) | (window <= lowest + width))


def _wrapped(windows, leaps):
    """Return whether signals stop abruptly at the ends of their range and jump there."""
    is_wrapped = np.zeros(len(windows), dtype=bool)
    n_samples = windows.shape[1]
    if n_samples < _SHORTEST_COARSE:
        return is_wrapped
    fewest_leaps = max(_FEWEST_LEAPS, _LEAST_LEAPS * n_samples)
    fewest_at_ends = max(_FEWEST_AT_ENDS, _LEAST_AT_ENDS * n_samples)
    for i in np.flatnonzero(leaps >= fewest_leaps):
        signal = windows[i] - windows[i].mean()
        span = np.ptp(signal)
        n_at_top = np.count_nonzero(signal > signal.max() - _EDGE * span)
        n_at_bottom = np.count_nonzero(signal < signal.min() + _EDGE * span)
        if min(n_at_top, n_at_bottom) < fewest_at_ends:
            continue
        past = np.lib.stride_tricks.sliding_window_view(signal, _ORDER)[:-1]
        coef, *_ = np.linalg.lstsq(past, signal[_ORDER:], rcond=None)
        errors = np.abs(signal[_ORDER:] - past @ coef)
        is_leap = np.abs(np.diff(signal[_ORDER - 1 :])) > _LEAP * span
        n_unforeseen = np.count_nonzero(errors[is_leap] > _UNFORESEEN * span)
        is_wrapped[i] = n_unforeseen >= fewest_leaps
    return is_wrapped


def _empty_bands(windows):
    """Return the share of the bands of each window that hold no power."""
    empty = np.zeros(len(windows))
    n_rows = max(_SAMPLES_AT_A_TIME // windows.shape[1], 1)
    for first in range(0, len(windows), n_rows):
        rows = slice(first, first + n_rows)
        spectra = fft.rfft(windowed_segments(windows[rows], _TAPER, _SEGMENT))[..., 1:]
        density = np.mean(spectra.real**2 + spectra.imag**2, axis=1)
        is_empty = density < _EMPTY * density.mean(axis=1, keepdims=True)
        empty[rows] = is_empty.mean(axis=1)
    return empty
