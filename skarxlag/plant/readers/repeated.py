"""Recordings that are listed twice."""

import filecmp
import os
from collections import defaultdict
from collections.abc import Sequence
from itertools import combinations

from .entries import ListedRecording
from .files import names_of_channels

#: Bytes at the beginning of a file that are compared before all of it.
_N_BYTES = 2**12


def check_repeated(listed: Sequence[ListedRecording]) -> None:
    """Refuse a recording that is listed twice.

    The same recording in training and test, or under two conditions, makes every result
    wrong. Two files hold the same recording if one is a link to the other, or if their
    bytes are equal.

    Parameters
    ----------
    listed : sequence of ListedRecording
        The recordings.

    Raises
    ------
    ValueError
        If two entries name the same channels of the same recording. The message names
        both entries.
    """
    similar = defaultdict(list)
    for entry in listed:
        # A missing file is reported when it is read.
        if entry.path.is_file():
            similar[_beginning(entry.path)].append(entry)
    for entries in similar.values():
        channels = [""] * len(entries)
        if len({str(entry.channel) for entry in entries}) > 1:
            # One channel may be stated in several ways.
            channels = map(_channels, entries)
        pairs = combinations(zip(channels, entries, strict=True), 2)
        for (of_other, other), (of_entry, entry) in pairs:
            is_same = of_entry == of_other
            if is_same and filecmp.cmp(entry.path, other.path, shallow=False):
                where = f"{entry.where}: " if entry.where else ""
                place = f" of {other.where}" if other.where else ""
                raise ValueError(
                    f"{where}{entry.path} is the same recording as {other.path}{place}"
                )


def _channels(entry):
    """Return the names of the chosen channels."""
    return names_of_channels(entry.path, entry.channel, entry.dtype)


def _beginning(path):
    """Return the size of a file, and its first bytes."""
    with path.open("rb") as file:
        return os.fstat(file.fileno()).st_size, file.read(_N_BYTES)
