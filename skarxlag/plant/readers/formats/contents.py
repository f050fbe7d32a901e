"""The channels of one file: their names, how they are read, and what the file states."""

import unicodedata
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from .rates import rates_agree, unit_advice

#: A compressed file may unpack to so many bytes, or to so many times its size. Text,
#: sensor noise and pauses compress by less than 100; deflate reaches 1000.
_ALWAYS_ALLOWED = 2**28
_RATIO = 100


class ContentError(ValueError):
    """Error of an intact file that does not hold the requested data."""


class DamagedError(ContentError):
    """Error of a file that is damaged, or of another format than its name states."""


class Format(NamedTuple):
    """Description of a file format.

    Attributes
    ----------
    suffixes : tuple of str
        Endings of file names, in lower case.
    library, extra : str or None
        Library that reads the format, and the extra of this package that installs it.
        None: no further library is needed, or no extra installs it.
    isolated : bool
        Whether files are read in another process. It must be true if the reader may
        crash or hang on a damaged file.
    """

    suffixes: tuple[str, ...]
    library: str | None = None
    extra: str | None = "formats"
    isolated: bool = False


@dataclass
class Channel:
    """Facts that a file states about a channel. Facts that it does not state are None.

    Attributes
    ----------
    length : int or None
        Samples. None if all channels of the file are equally long.
    rates : dict of str to float
        Sampling rates in Hz, by the names in the file that state them.
    unit : str or None
        Of the samples.
    rpm : float or None
        Shaft speed in rev/min.
    start : float or None
        Seconds since 1970 at the first sample.
    last_digit : float or None
        Value of the last written decimal, in a text in which it is always the same.
    """

    length: int | None = None
    rates: dict[str, float] = field(default_factory=dict)
    unit: str | None = None
    rpm: float | None = None
    start: float | None = None
    last_digit: float | None = None


@dataclass
class Contents:
    """Channels of an open file.

    Attributes
    ----------
    channels : dict of str to Channel
        By name, in the order of the file.
    read : callable
        ``read(names, n_samples)`` yields one list of equally long arrays for each
        block, in the order of `names`, with at most `n_samples` values in each array.
        None requests one block of everything. Formats that are only read whole ignore
        `n_samples`. The channels that are asked for are equally long.
    refused : dict of str to str
        Arrays that are not channels, such as square matrices, and the reason.
    advice : str
        Advice for a user who has to choose a channel, else empty.
    """

    channels: dict[str, Channel]
    read: Callable[[list[str], int | None], Iterator[list[Any]]]
    refused: dict[str, str] = field(default_factory=dict)
    advice: str = ""

    def printable(self) -> "Contents":
        """Return the contents with names and units that can be printed."""
        originals = {printable(name): name for name in self.channels}
        channels = {
            shown: replace(channel, unit=channel.unit and printable(channel.unit))
            for shown, channel in zip(originals, self.channels.values(), strict=False)
        }

        def read(names, n_samples):
            return self.read([originals[name] for name in names], n_samples)

        return Contents(channels, read, self.refused, self.advice)


def one_rate(rates: dict[str, float], stated: float | None = None) -> float | None:
    """Return the sampling rate that several names state, None if there is none.

    Parameters
    ----------
    rates : dict of str to float
        In Hz, by the names in a file.
    stated : float or None
        Rate that the user states. It decides if there are several.

    Raises
    ------
    ContentError
        If the rates disagree, or the user states another one.

    Examples
    --------
    >>> one_rate({"fs": 2000.0, "times": 1999.99}), one_rate({"fs": 2.0, "Fs": 9.0}, 9)
    (2000.0, 9)
    >>> one_rate({"fs": 120_000.0}, 2000)
    Traceback (most recent call last):
        ...
    skarxlag...ContentError: sampling_rate is 2000 Hz but the file states 120000 Hz; times in min
    need the unit in their name: 'time (min)'
    """
    values = list(rates.values())
    if not values:
        return None
    if stated is not None and any(rates_agree(stated, value) for value in values):
        return stated
    if not rates_agree(max(values), min(values)):
        shown = ", ".join(f"{name} {rate:g} Hz" for name, rate in rates.items())
        raise ContentError(
            f"states several sampling rates: {shown}; expected one, or "
            "--sampling-rate to state which is right"
        )
    if stated is not None:
        raise ContentError(
            f"sampling_rate is {stated:g} Hz but the file states {values[0]:g} Hz"
            f"{unit_advice(values[0], stated)}"
        )
    return values[0]


def printable(text: str) -> str:
    r"""Return a text from a file so that it can be printed: escapes of control characters.

    >>> printable("acc\x1b[2J"), printable("Größe (µm)")
    ('acc\\x1b[2J', 'Größe (µm)')
    """
    hidden = ("Cc", "Cf", "Co", "Cs", "Zl", "Zp")
    return "".join(
        character.encode("unicode_escape").decode()
        if unicodedata.category(character) in hidden
        else character
        for character in text
    )


def choose_channel(names: list[str], channel: str | int) -> str:
    """Return the name of a channel.

    Parameters
    ----------
    names : list of str
        The channels of the file, in its order.
    channel : str or int
        The whole name; the position, counted from 0, also as a text of digits; or a
        pattern, in which ``*`` stands for any characters and ``?`` for one.

    Examples
    --------
    >>> choose_channel(["X097_DE_time", "X097_FE_time"], "*_DE_time")
    'X097_DE_time'
    """
    text = str(channel)
    if channel in names:
        return text
    is_position = isinstance(channel, Integral) or text.isdecimal()
    if is_position and 0 <= int(channel) < len(names):
        return names[int(channel)]
    # A bracket is part of a name such as x[0].
    pattern = text.replace("[", "[[]")
    matching = [name for name in names if fnmatchcase(name, pattern)]
    if len(matching) > 1:
        raise ContentError(
            f"channel {_shown(channel)} fits several channels: {quoted_names(matching)}"
        )
    if not matching:
        raise ContentError(
            f"no channel {_shown(channel)}; available: {quoted_names(names)}"
        )
    return matching[0]


def choose_channels(names: list[str], channels: Any) -> list[str]:
    """Return the names of one or several channels, each as in `choose_channel`, chosen once."""
    channels = [channels] if isinstance(channels, str | Integral) else channels
    chosen = [choose_channel(names, channel) for channel in channels]
    if repeated := [name for name in names if chosen.count(name) > 1]:
        raise ContentError(f"channel {repeated[0]!r} is chosen more than once")
    return chosen


def _shown(channel):
    # NumPy's integers have another representation.
    return int(channel) if isinstance(channel, Integral) else repr(channel)


def quoted_names(names: Iterable[str]) -> str:
    """Format names for an error message, at most 20 of them."""
    texts = [repr(name) for name in names]
    further = f" and {len(texts) - 20} more" if len(texts) > 20 else ""
    return ", ".join(texts[:20]) + further


def slices(n_total: int, n_samples: int | None) -> Iterator[slice]:
    """Yield slices that cover all samples; one empty slice if there is no sample."""
    step = max(n_total if n_samples is None else n_samples, 1)
    for start in range(0, max(n_total, 1), step):
        yield slice(start, min(start + step, n_total))


def is_numeric(dtype: DTypeLike) -> bool:
    """Return whether an array of this type can be a channel."""
    return np.dtype(dtype).kind in "fiuc"


def check_unpacked(n_packed: int, n_unpacked: int) -> None:
    """Refuse a compressed file that holds more bytes than a recording of its size can.

    Parameters
    ----------
    n_packed, n_unpacked : int
        Bytes of the file, and bytes that it holds.

    Raises
    ------
    ContentError
        If it holds more than 256 MiB and more than 100 times the size of the file.
    """
    if n_unpacked > max(_ALWAYS_ALLOWED, _RATIO * n_packed):
        raise ContentError(
            f"{n_packed} bytes would unpack to {n_unpacked}, expected at most "
            f"{_ALWAYS_ALLOWED} bytes or {_RATIO} times its size"
        )
