"""Recordings that are listed twice."""

import hashlib
import os
from collections import defaultdict
from collections.abc import Hashable, Sequence

from .entries import ListedRecording
from .files import names_of_channels

#: Bytes at either end of a file that are compared before all of it.
_ENDS = 2**16


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
    for entries in _same_files(listed):
        first: dict[Hashable, ListedRecording] = {}
        for entry in entries:
            other = first.setdefault(_channels(entry, entries), entry)
            if other is not entry:
                where = f"{entry.where}: " if entry.where else ""
                of_other = f" of {other.where}" if other.where else ""
                raise ValueError(
                    f"{where}{entry.path} is the same recording as "
                    f"{other.path}{of_other}"
                )


def _channels(entry, entries):
    """Return the chosen channels, by their names if they are stated in several ways."""
    if len({str(other.channel) for other in entries}) == 1:
        return ""
    return tuple(names_of_channels(entry.path, entry.channel, entry.dtype))


def _same_files(listed):
    """Yield entries of the same file, or of files with equal bytes, if there are several."""
    # A missing file is reported when it is read.
    groups = [[entry for entry in listed if entry.path.is_file()]]
    for key in (os.path.getsize, _ends, _digest):
        groups = [part for entries in groups for part in _divided(entries, key)]
    return groups


def _divided(entries, key):
    """Divide entries by a key of the path, and leave out those that are alone."""
    paths = {os.path.realpath(entry.path) for entry in entries}
    keys = dict(zip(paths, map(key, paths), strict=True)) if len(paths) > 1 else {}
    parts = defaultdict(list)
    for entry in entries:
        parts[keys.get(os.path.realpath(entry.path))].append(entry)
    return [part for part in parts.values() if len(part) > 1]


def _ends(path):
    with open(path, "rb") as file:
        first = file.read(_ENDS)
        file.seek(max(os.fstat(file.fileno()).st_size - _ENDS, 0))
        return hashlib.sha256(first + file.read()).digest()


def _digest(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").digest()
