"""From the bytes of a running source to samples: choice of channels, and raw samples."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..readers.formats.contents import ContentError, choose_channel, choose_channels
from ..readers.formats.facts import names_speed, names_times
from ..readers.formats.raw import frame_type

#: Names, positions or patterns of channels.
Channels = str | Sequence[str] | None


def chosen_channels(
    names: list[str],
    channel: Channels,
    speed: str | None = None,
    usual: Sequence[list[str]] = (),
) -> list[str]:
    """Return the names of the chosen channels.

    Parameters
    ----------
    names : list of str
        All channels.
    channel : str, list of str, or None
        As in `read_recording`; None takes all but those of times and of shaft speeds.
    speed : str or None
        Channel of the shaft speed or of pulses, which comes last.
    usual : sequence of list of str
        Choices, of which the first that is possible is taken if `channel` is None and
        there are more channels.

    Examples
    --------
    >>> chosen_channels(["time", "DE_time", "FE_time"], ["FE*", "1"])
    ['FE_time', 'DE_time']
    >>> chosen_channels(["time", "acc", "rpm"], None)
    ['acc']
    >>> chosen_channels(["key", "acc"], None, "k*")
    ['acc', 'key']
    """
    if channel is None:
        signals = [
            name for name in names if not names_times(name) and not names_speed(name)
        ]
        chosen = signals or names
        n_signals = len([name for name in chosen if name != speed])
        for choice in usual:
            if len(choice) < n_signals:
                try:
                    chosen = choose_channels(names, choice)
                except ContentError:
                    continue
                break
    else:
        chosen = choose_channels(names, channel)
    if speed is None:
        return chosen
    speed = choose_channel(names, speed)
    return [name for name in chosen if name != speed] + [speed]


class Samples:
    """Parser of the bytes of a source, of which the last may wait for their rest."""

    def __init__(self) -> None:
        self.unread: Counter[str] = Counter()
        self.begin()

    def begin(self, head: bytes = b"") -> None:
        """Prepare for the first bytes of a source.

        Parameters
        ----------
        head : bytes
            The beginning of the source, if parsing starts after it.
        """
        self._rest = b""

    @property
    def advice(self) -> str:
        """Advice for the user if the number of channels is wrong."""
        return "--channel chooses"

    @property
    def n_pending(self) -> int:
        """Bytes of a sample or line that has not arrived in whole."""
        return len(self._rest)


class RawSamples(Samples):
    """Parser of interleaved binary samples.

    Parameters
    ----------
    dtype : str
        Type of one sample of all channels, such as ``<i2``, or ``(4,)<f4`` for four
        channels.
    channel : str, list of str, or None
        Chosen channels, in their order; None for all.
    speed : str or None
        Channel of the shaft speed or of pulses, which becomes the last row of the
        samples.
    usual : sequence of list of str
        As in `chosen_channels`.

    Attributes
    ----------
    unread : Counter of str
        Bytes at the end that do not make a whole sample.
    """

    def __init__(
        self,
        dtype: str,
        channel: Channels = None,
        speed: str | None = None,
        usual: Sequence[list[str]] = (),
    ) -> None:
        self._frame = frame_type(dtype)
        self._names = chosen_channels(list(self._frame.names), channel, speed, usual)
        super().__init__()

    @property
    def channels(self) -> list[tuple[str, str | None]]:
        """Names of the channels, and None for their units."""
        return [(name, None) for name in self._names]

    def parts(
        self, data: bytes, *, is_end: bool = False
    ) -> Iterator[tuple[Any, float | None]]:
        """Yield samples of shape (n_channels, n_samples), and None for their time."""
        data = self._rest + data
        n_whole = len(data) // self._frame.itemsize * self._frame.itemsize
        self._rest = data[n_whole:]
        self.unread["bytes of a sample that is not whole"] = (
            len(self._rest) if is_end else 0
        )
        frames = np.frombuffer(data[:n_whole], self._frame)
        with np.errstate(invalid="ignore"):
            samples = [frames[name].astype(np.float64) for name in self._names]
        yield np.stack(samples), None
