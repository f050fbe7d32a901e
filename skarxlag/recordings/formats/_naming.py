"""Channels by name, position or pattern."""

import re
from collections.abc import Iterable
from numbers import Integral

from ._contents import ContentError


def choose_channel(names: list[str], channel: str | int) -> str:
    """Name of the channel that is asked for.

    Parameters
    ----------
    names : list of str
        The channels of the file, in its order.
    channel : str or int
        The whole name; the position, counted from 0, also as a text of digits; or a pattern, in
        which ``*`` stands for any characters and ``?`` for one.

    Examples
    --------
    >>> choose_channel(["X097_DE_time", "X097_FE_time"], "*_DE_time")
    'X097_DE_time'
    """
    if isinstance(channel, str) and channel in names:
        return channel
    is_position = isinstance(channel, Integral) or (
        isinstance(channel, str) and channel.isdecimal()
    )
    if is_position and 0 <= int(channel) < len(names):
        return names[int(channel)]
    if isinstance(channel, str) and ("*" in channel or "?" in channel):
        pattern = re.escape(channel).replace(r"\*", ".*").replace(r"\?", ".")
        matching = [name for name in names if re.fullmatch(pattern, name)]
        if len(matching) == 1:
            return matching[0]
        if matching:
            raise ContentError(f"channel {channel!r} fits several channels: {listed(matching)}")
    raise ContentError(f"no channel {channel!r}; available: {listed(names)}")


def listed(names: Iterable[str]) -> str:
    """Names for an error, not too many of them."""
    texts = [repr(name) for name in names]
    return ", ".join(texts[:20]) + (f" and {len(texts) - 20} more" if len(texts) > 20 else "")
