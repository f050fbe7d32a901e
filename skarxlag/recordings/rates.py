"""Sampling rates: when two agree, and signals brought from one to another."""

from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import resample_poly

from .formats._facts import RATE_TOLERANCE

#: Largest factor by which a signal is interpolated on the way to its new rate.
_MAX_FACTOR = 10_000


def rates_agree(first: float | None, second: float | None) -> bool:
    """Whether two sampling rates are the same but for the precision with which they are stated.

    Parameters
    ----------
    first, second : float or None
        In Hz. None, a rate that is not stated, agrees with every rate.

    Returns
    -------
    bool
        True up to a difference of 0.1 %.

    Examples
    --------
    >>> from skarxlag.recordings.rates import rates_agree
    >>> rates_agree(51_199.87, 51_200), rates_agree(48_000, 51_200), rates_agree(None, 51_200)
    (True, False, True)
    """
    if first is None or second is None:
        return True
    return abs(first - second) <= RATE_TOLERANCE * max(first, second)


def resampled_blocks(
    blocks: Iterable[Any], sampling_rate: float, *, note: Callable[..., Any] | None = None
) -> Iterator[tuple[NDArray[Any], float]]:
    r"""Bring a recording to another sampling rate, block after block.

    The ratio of the rates is written as :math:`p / q`. The signal is interpolated by :math:`p`,
    filtered, and every :math:`q`-th value kept, by the polyphase filter of
    :func:`scipy.signal.resample_poly`: a low-pass filter with linear phase at half the lower of
    the two rates, designed with a Kaiser window. Before that, the first sample is subtracted, and
    it is added again afterwards, so that an offset of the sensor does not ring at the start. The
    result does not depend on how the recording is cut into blocks.

    Above half the old rate, a signal at a higher rate stays empty. A diagnoser that was fitted at
    the higher rate then sees a band without noise, which it has never seen: record at the rate of
    the diagnoser if possible.

    Parameters
    ----------
    blocks : iterable of tuple (signal, rate)
        Consecutive parts of one recording as ndarrays of shape (n_samples,) or
        (n_channels, n_samples), and their sampling rate in Hz. Where the rates agree, see
        :func:`rates_agree`, signals pass as they are.
    sampling_rate : float
        The new rate, in Hz.
    note : callable, default=None
        Called once with the old rate, if it differs from the new one, so that the user can be told.

    Yields
    ------
    signal : ndarray of float64
        The next samples, about as many seconds as a block holds.
    sampling_rate : float
        The new rate.

    Raises
    ------
    ValueError
        If the old rate is None, or if no ratio of integers up to 10 000 gives the new rate.

    Examples
    --------
    >>> import numpy as np
    >>> from skarxlag.recordings.rates import resampled_blocks
    >>> sine = np.sin(2 * np.pi * 50 * np.arange(1000) / 10_000)
    >>> parts = [signal for signal, _ in resampled_blocks([(sine, 10_000)], 5000)]
    >>> len(np.concatenate(parts))
    500
    """
    resampler = None
    for signal, rate in blocks:
        if resampler is None:
            if rate is None:
                raise ValueError(
                    f"a recording of unknown rate cannot be resampled to {sampling_rate:g} Hz"
                )
            if rates_agree(rate, sampling_rate):
                resampler = _Unchanged()
            else:
                if note is not None:
                    note(rate)
                resampler = _Polyphase(signal[..., :1], rate, sampling_rate)
        part = resampler.take(signal)
        if part.shape[-1]:
            yield part, sampling_rate
    if resampler is not None:
        part = resampler.finish()
        if part.shape[-1]:
            yield part, sampling_rate


class _Unchanged:
    def take(self, signal: NDArray[Any]) -> NDArray[Any]:
        return signal

    def finish(self) -> NDArray[Any]:
        return np.empty(0)


class _Polyphase:
    """`resample_poly` on a stream: every part is filtered together with its surroundings."""

    def __init__(self, offset: Any, old: Any, new: Any) -> None:
        self._ratio = _ratio(old, new)
        p, q = self._ratio.numerator, self._ratio.denominator
        # The filter of resample_poly reaches 10 max(p, q) interpolated samples to either side.
        # Cuts lie at multiples of q, where old and new samples coincide.
        self._reach = q * (10 * max(p, q) // (p * q) + 1)
        self._offset, self._waiting, self._n_before = offset, [], 0

    def take(self, signal: NDArray[Any]) -> NDArray[Any]:
        self._waiting.append(signal - self._offset)
        held = sum(part.shape[-1] for part in self._waiting)
        q = self._ratio.denominator
        n_new = (held - self._n_before - self._reach) // q * q
        if n_new < max(self._reach, q):
            return signal[..., :0]
        return self._filtered(n_new)

    def finish(self) -> NDArray[Any]:
        return self._filtered(None)

    def _filtered(self, n_new):
        held = np.concatenate(self._waiting, axis=-1)
        p, q = self._ratio.numerator, self._ratio.denominator
        filtered = resample_poly(held, p, q, axis=-1) + self._offset
        first = self._n_before // q * p
        if n_new is None:
            return filtered[..., first:]
        stop = self._n_before + n_new
        kept = max(stop - self._reach, 0)
        self._waiting, self._n_before = [held[..., kept:].copy()], stop - kept
        return filtered[..., first : stop // q * p]


def _ratio(old, new):
    exact = Fraction(new) / Fraction(old)
    for largest in (10, 100, 1000, _MAX_FACTOR):
        ratio = exact.limit_denominator(largest)
        # Rates are not known better than this.
        if ratio.numerator and abs(ratio / exact - 1) <= 1e-5 and ratio.numerator <= _MAX_FACTOR:
            return ratio
    raise ValueError(
        f"cannot resample from {old:g} to {new:g} Hz: expected a ratio of integers up to "
        f"{_MAX_FACTOR}"
    )
