"""Find windows that carry no signal."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.utils import check_array

from ._parallel import map_batches
from ._state import expect
from ._validation import ABOVE_0, as_samples, check_real
from .kernels.scaling import ROUNDING, largest
from .speeds import speeds_of_rows

#: Share of samples that may repeat the sample before, and of those that may do so in one run.
_HELD, _STUCK = 0.5, 0.1
#: Share of the range of a window below which a step counts as none, as converters of many bits
#: record their own noise. On each of seven rigs, some step in each tenth of each window is larger
#: than 1.3e-4, of those of vibration than 2e-3; a twentieth of the least on the others.
_STILL = 1e-5
#: Shorter runs of equal samples may come from quantisation.
_SHORTEST_STUCK = 16
#: A window whose values lie on fewer levels than this is the last bit of a converter, not a signal.
_FEWEST_LEVELS = 8
#: Shorter windows may lie on few levels by chance.
_SHORTEST_COARSE = 64
#: Share of samples that may lie at the two extremes: Gaussian noise that is clipped beyond 2.33
#: standard deviations is accepted.
_CLIPPED = 0.02
#: Steps of more than `_LEAP` of the range are leaps. They come from wrapping round if linear
#: prediction of this order misses some of them by `_UNFORESEEN` of the range, and if some samples
#: lie in the outer `_EDGE` of the range at either end, where a signal that was not cut has few.
_LEAP, _UNFORESEEN, _FEWEST_LEAPS, _EDGE, _FEWEST_AT_ENDS, _ORDER = 0.75, 0.4, 4, 0.02, 6, 8
#: Steps by which a straight line may be rounded, or begin again.
_RAMP_STEPS = 2
#: A decade of the spectrum is missing if its density, in so many bands, is this much below that of
#: the rest.
_EMPTY, _FEWEST_BINS, _BANDS = 1e-6, 200, 8
#: Frequencies in Hz, and the share of the energy that a sine there may have: one of up to 20 dB
#: above the rest is accepted.
_MAINS, _HUM = (50.0, 60.0), 0.99
#: Highest order of the shaft that can be so strong a line: unbalance makes the first, misalignment
#: the second. On six rigs, lines of the first have up to 79 % of the energy, of the third 23 %.
_LAST_ORDER = 2
#: Periods of the mains frequency in a window, so that it differs from a drift; and the largest
#: deviation from it in Hz.
_FEWEST_PERIODS, _DEVIATION = 3, 0.5
#: Share by which stated speeds differ from true ones.
_SPEED_ERROR = 0.01


def signal_quality(
    X: ArrayLike,
    *,
    sampling_rate: float | None = None,
    rpm: ArrayLike | None = None,
    return_share: bool = False,
) -> Any:
    """Return whether each window carries a signal, and if not, why.

    An estimator returns a prediction for every row, even for that of an unplugged sensor. This
    function finds such rows. It tests each window separately and needs no calibration. No criterion
    depends on the unit of the signal. The criteria are, in this order:

    - ``"not finite"``: some sample is NaN or infinite, in any channel. All estimators refuse such a
      window. Its share counts these samples.
    - ``"constant"``: the output does not move by more than rounding (8 times the resolution of
      double precision) of its largest value. The sensor is dead or not connected.
    - ``"held"``: more than half of the samples of the output repeat the sample before, but for
      1e-5 of the range. Most of the window is dropouts, the logger held its last value, or one
      sample is so large that nothing else counts.
    - ``"stuck"``: the longest run of samples that are equal but for 1e-5 of the range is longer
      than a tenth of the window and than 16 samples. A cable was loose, or the logger lost a block.
    - ``"coarse"``: the range of the output is less than 7 times its smallest step, so that the
      samples lie on fewer than 8 levels. The signal is lost below the last bit of the converter.
      Its share is that of one step in the range.
    - ``"clipped"``: more than 2 % of the samples of the output are equal to its largest or to its
      smallest value. The amplifier or the converter is saturated.
    - ``"wrapped"``: the output leaps by more than 75 % of its range. A linear prediction of order
      8 misses at least 4 leaps, and at least 6 samples lie at either end of the range. Values
      beyond the range of an integer type continued at its other end. Its share counts the leaps.
    - ``"ramp"``: the output is a straight line, but for two of its steps. It holds times or counts
      samples.
    - ``"band missing"``: in a decade of frequency, the mean power density of narrow bands is more
      than 60 dB below the median of all other frequencies. The signal was filtered, or was recorded
      at a lower rate. Its share is that of the decade in all frequencies.
    - ``"hum"``: a sine of 50 or 60 Hz has more than 99 % of the energy of the output without its
      trend. A shield is not grounded. This requires `sampling_rate` and windows of at least three
      periods. A line at the speed of the shaft or at twice that is not called hum.
    - ``"good"``: none of these.

    Measured inputs, the channels after the first, may well be constant: a torque that is held, or a
    speed. Only NaN and infinity count there.

    Parameters
    ----------
    X : array-like of shape (n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)
        Windows in any unit; NaN is allowed, and so are masked samples, which count as NaN.
    sampling_rate : float, default=None
        In Hz, above 0. None does not look for hum.
    rpm : float, array-like of shape (n_windows,) or None, default=None
        Shaft speed of each window in rev/min, NaN where it is not known. The mains frequency is not
        looked for if it is closer to the shaft's frequency, or to twice that, than 1 %, 0.5 Hz or
        the resolution of the window.
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
        If X has another number of axes, the sampling rate is not positive, or `rpm` does not fit X.

    Notes
    -----
    Estimators treat such windows as follows: `ARXLaguerre` leaves windows of constant output out of
    its sums. `predict_proba` of the diagnosers returns equal probabilities; a detector flags them.
    `predict` of a diagnoser returns one of its conditions for them, which means nothing.
    `window_verdicts` returns "no signal".

    Short windows are judged by fewer criteria. Two samples at the extremes, one at each, never
    count as clipped. A window of fewer than 64 samples is never coarse, wrapped or a ramp, and one
    of fewer than 400 never has a missing band. A few samples that wrapped round look like impacts,
    and white noise of uniform distribution looks like a signal that wrapped round often.

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
    X = as_samples(X, "X")
    X = check_array(X, dtype=[np.float64, np.float32], allow_nd=True, ensure_all_finite=False)
    shapes = "(n_windows, n_samples) or (n_windows, 1 + n_inputs, n_samples)"
    expect(X.ndim <= 3, "X.shape", X.shape, shapes)
    frequencies = speeds_of_rows(np.nan if rpm is None else rpm, len(X)) / 60
    expect(frequencies.shape == (len(X),), "rpm", rpm, "one speed for each window")
    parts = map_batches(
        lambda batch: _quality_of_batch(X[batch], sampling_rate, frequencies[batch]), len(X), None
    )
    quality, share = (np.concatenate(each) for each in zip(*parts, strict=True))
    return (quality, share) if return_share else quality


def _quality_of_batch(windows, sampling_rate, shaft_frequency):
    """Return the first criterion that each window fails, and the share of the window affected."""
    not_finite = (~np.isfinite(windows)).reshape(len(windows), -1).mean(axis=1)
    output = np.asarray(windows if windows.ndim == 2 else windows[:, 0], dtype=np.float64)
    output = np.where(not_finite[:, np.newaxis] > 0, 0.0, output)
    # In units of the largest value, so that no range overflows.
    peak = largest(output)
    scaled = output / np.where(peak == 0, 1.0, peak)
    highest, lowest = scaled.max(axis=1, keepdims=True), scaled.min(axis=1, keepdims=True)
    n_windows, n_samples = scaled.shape
    span = (highest - lowest)[:, 0]
    steps = np.abs(np.diff(scaled, axis=1))
    leaps = np.count_nonzero(steps > _LEAP * span[:, np.newaxis], axis=1)
    # Steps below the rounding of the largest value are lost, for instance next to one huge sample.
    stays = steps <= np.maximum(_STILL * span, ROUNDING)[:, np.newaxis]
    steps[stays] = np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        coarse = np.nan_to_num(steps.min(axis=1, initial=np.inf) / span, posinf=0.0)
    held, run = stays.sum(axis=1) / n_samples, _longest_runs(stays)
    n_extreme = (scaled == highest).sum(axis=1) + (scaled == lowest).sum(axis=1)
    clipped = n_extreme / n_samples
    checks = {
        "not finite": (not_finite > 0, not_finite),
        "constant": (span <= ROUNDING, np.ones(n_windows)),
        "held": (held > _HELD, held),
        "stuck": ((run > _STUCK * n_samples) & (run > _SHORTEST_STUCK), run / n_samples),
        "coarse": ((coarse * (_FEWEST_LEVELS - 1.5) > 1) & (n_samples >= _SHORTEST_COARSE), coarse),
        "clipped": ((clipped > _CLIPPED) & (n_extreme > 2), clipped),
    }
    quality, share = _first_failed(checks, n_windows)
    # The other criteria cost more, and only make sense for a signal that moves.
    rest = np.flatnonzero(quality == "good")
    if len(rest) > 0:
        scaled, leaps = scaled[rest], leaps[rest]
        checks = {"wrapped": (_wrapped(scaled, leaps), leaps / n_samples)}
        trendless = _without_trend(scaled)
        checks["ramp"] = (_ramps(scaled, trendless), np.ones(len(rest)))
        if n_samples >= 2 * _FEWEST_BINS:
            checks["band missing"] = _missing_decade(trendless)
        if sampling_rate is not None:
            hum = _hum(trendless, sampling_rate, shaft_frequency[rest])
            checks["hum"] = (hum > _HUM, hum)
        quality[rest], share[rest] = _first_failed(checks, len(rest))
    return quality, share


def _first_failed(checks, n_windows):
    quality, share = np.full(n_windows, "good", dtype="<U12"), np.zeros(n_windows)
    for name, (fails, share_of_check) in reversed(checks.items()):
        quality[fails], share[fails] = name, share_of_check[fails]
    return quality, share


def _ramps(windows, trendless):
    """Whether signals are straight lines, but for two of their steps."""
    step = np.ptp(windows, axis=1) / (windows.shape[1] - 1)
    is_straight = np.abs(trendless).max(axis=1) <= _RAMP_STEPS * step
    return is_straight & (windows.shape[1] >= _SHORTEST_COARSE)


def _longest_runs(stays):
    """Samples of the longest run of equal samples in each row, from whether each step is zero."""
    place = np.arange(1, stays.shape[1] + 1, dtype=np.int32)
    last_move = np.maximum.accumulate(np.where(stays, 0, place), axis=1)
    return (place - last_move).max(axis=1, initial=0) + 1


def _wrapped(windows, leaps):
    """Whether signals stop abruptly at both ends of their range and jump without a trend."""
    found = np.zeros(len(windows), dtype=bool)
    for i in np.flatnonzero((leaps >= _FEWEST_LEAPS) & (windows.shape[1] >= _SHORTEST_COARSE)):
        signal = windows[i] - windows[i].mean()
        span, highest, lowest = np.ptp(signal), signal.max(), signal.min()
        at_ends = signal > highest - _EDGE * span, signal < lowest + _EDGE * span
        past = np.lib.stride_tricks.sliding_window_view(signal, _ORDER)[:-1]
        coef, *_ = np.linalg.lstsq(past, signal[_ORDER:], rcond=None)
        errors = np.abs(signal[_ORDER:] - past @ coef)
        is_leap = np.abs(np.diff(signal[_ORDER - 1 :])) > _LEAP * span
        n_unforeseen = np.count_nonzero(errors[is_leap] > _UNFORESEEN * span)
        n_at_ends = min(map(np.count_nonzero, at_ends))
        found[i] = n_at_ends >= _FEWEST_AT_ENDS and n_unforeseen >= _FEWEST_LEAPS
    return found


def _missing_decade(windows):
    """Whether a decade of the spectrum is empty, and its share of all frequencies."""
    n_bins = windows.shape[1] // 2
    spectra = np.fft.rfft(windows * np.hanning(windows.shape[1]), axis=1)
    power = np.abs(spectra[:, 1 : n_bins + 1]) ** 2
    edges = np.unique(np.geomspace(1, n_bins, 1 + int(_BANDS * np.log10(n_bins))).astype(int))
    density = np.add.reduceat(power, edges[:-1], axis=1) / np.diff(edges, append=n_bins)[:-1]
    share = np.zeros(len(windows))
    # Of similar bands, as they usually are, no decade needs a closer look.
    differ = np.any(density.min(axis=1) < _EMPTY * density.max(axis=1))
    for low in edges[(edges <= n_bins / 10) & differ]:
        inside = (edges[:-1] >= low) & (edges[1:] <= 10 * low)
        # A line at the edge does not fill the decade.
        highest = np.sort(density[:, inside], axis=1)[:, -2]
        empty = highest < _EMPTY * np.median(density[:, ~inside], axis=1)
        share[empty] = 9 * low / n_bins
    return share > 0, share


def _without_trend(windows):
    place = np.linspace(-1, 1, windows.shape[-1])
    basis = np.linalg.qr(np.stack([np.ones_like(place), place], axis=1))[0]
    return windows - windows @ basis @ basis.T


def _hum(windows, sampling_rate, shaft_frequency):
    """Return the share of energy that a sine of 50 or 60 Hz has in windows without a trend.

    It is 0 if the shaft has its first or second order there.
    """
    n_samples, share = windows.shape[1], np.zeros(len(windows))
    seconds = (np.arange(n_samples) - (n_samples - 1) / 2) / sampling_rate
    duration = n_samples / sampling_rate
    energy = np.sum(windows**2, axis=1)
    # The steps of a sine have at most the power of its angular frequency, and those of the rest at
    # most twice its amplitude. Windows with larger steps need no closer look.
    steps = np.sum(np.diff(windows, axis=1) ** 2, axis=1)
    most = 2 * np.pi * (max(_MAINS) + _DEVIATION) / sampling_rate + 2 * np.sqrt(1 - _HUM)
    slow = np.flatnonzero(steps <= 1.2 * most**2 * energy)
    for mains in _MAINS:
        if duration * mains < _FEWEST_PERIODS or mains > sampling_rate / 4 or len(slow) == 0:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.round(mains / shaft_frequency[slow]).clip(1, _LAST_ORDER)
            distance = np.abs(order * shaft_frequency[slow] - mains)
        # The window does not resolve closer lines.
        is_of_shaft = distance <= max(_DEVIATION, _SPEED_ERROR * mains, 1 / duration)
        candidates = slow[~is_of_shaft]
        # With its derivative, a sine fits frequencies that differ by a quarter of the resolution.
        n_steps = int(np.ceil(2 * _DEVIATION * duration))
        for frequency in mains + np.arange(-n_steps, n_steps + 1) / (2 * duration):
            phase = 2 * np.pi * frequency * seconds
            sine = np.stack([np.cos(phase), np.sin(phase)])
            basis = np.linalg.qr(_without_trend(np.concatenate([sine, seconds * sine])).T)[0]
            fitted = np.sum((windows[candidates] @ basis) ** 2, axis=1) / energy[candidates]
            share[candidates] = np.maximum(share[candidates], fitted)
    return share.clip(max=1.0)
