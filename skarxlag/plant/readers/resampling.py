"""Bring recordings to another sampling rate."""

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...measures.quality import is_overflow
from .formats.rates import rates_agree

#: Largest factor by which a signal is interpolated on the way to its new rate.
_MAX_FACTOR = 10_000


def resampled_blocks(
    signals: Iterable[NDArray[Any]], old_rate: float | None, sampling_rate: float
) -> Iterator[NDArray[Any]]:
    r"""Resample a recording.

    The ratio of the rates is written as :math:`p / q`. The signal is interpolated by
    :math:`p`, filtered, and every :math:`q`-th value kept, by the polyphase filter of
    :func:`scipy.signal.resample_poly`: a low-pass filter with linear phase at half the
    lower of the two rates, designed with a Kaiser window. Before that, the first sample
    is subtracted, and it is added again afterwards, so that an offset of the sensor
    does not ring at the start. An overflow becomes NaN, because a filter would spread
    it unseen.

    If the new rate is higher, the band above half the old rate stays empty. A diagnoser
    that was fitted at the higher rate has never seen such a band: record at the rate of
    the diagnoser if possible.

    Parameters
    ----------
    signals : iterable of ndarray of shape (n_samples,) or (n_channels, n_samples)
        Consecutive parts of one recording.
    old_rate : float or None
        Their sampling rate, in Hz. If the rates agree, see :func:`rates_agree`, signals
        are not changed.
    sampling_rate : float
        The new rate, in Hz.

    Returns
    -------
    iterator of ndarray of float64
        The samples. If they are resampled, they are one block: memory holds the whole
        recording.

    Raises
    ------
    ValueError
        If the old rate is None, or if no ratio of integers up to 10 000 gives the new
        rate.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.plant.readers.resampling import resampled_blocks
    >>> sine = np.sin(2 * np.pi * 50 * np.arange(1000) / 10_000)
    >>> (resampled,) = resampled_blocks([sine[:300], sine[300:]], 10_000, 5000)
    >>> len(resampled)
    500
    """
    if old_rate is None:
        raise ValueError(
            f"a recording of unknown rate cannot be resampled to {sampling_rate:g} Hz"
        )
    if rates_agree(old_rate, sampling_rate):
        return iter(signals)
    return _resampled(signals, _ratio(old_rate, sampling_rate))


def _resampled(signals, ratio):
    # This import takes longer than a verdict.
    from scipy.signal import resample_poly

    samples = np.concatenate([*signals], axis=-1)
    samples[is_overflow(np.atleast_2d(samples)).reshape(samples.shape)] = np.nan
    offset = np.nan_to_num(samples[..., :1])
    samples -= offset
    yield resample_poly(samples, ratio.numerator, ratio.denominator, axis=-1) + offset


def _ratio(old, new):
    exact = Fraction(new) / Fraction(old)
    for largest in (10, 100, 1000, _MAX_FACTOR):
        ratio = exact.limit_denominator(largest)
        # Rates are not known better than this.
        is_near = abs(ratio / exact - 1) <= 1e-5
        if is_near and 0 < ratio.numerator <= _MAX_FACTOR:
            return ratio
    raise ValueError(
        f"cannot resample from {old:g} to {new:g} Hz: expected a ratio of integers up to "
        f"{_MAX_FACTOR}"
    )
