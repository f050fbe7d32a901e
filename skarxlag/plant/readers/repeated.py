"""Recordings that are listed twice, and conditions that look alike."""

import hashlib
import os
import unicodedata
from collections import defaultdict
from collections.abc import Hashable, Sequence
from itertools import chain

from .entries import ListedRecording
from .files import chosen_channels
from .formats.facts import number

#: Bytes at either end of a file that are compared before all of it.
_ENDS = 2**16


def check_repeated(listed: Sequence[ListedRecording]) -> None:
    """Refuse a recording that is listed twice, and two conditions that look alike.

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
        If two entries name the same channels of the same recording; or if two
        conditions or two specimens differ only in invisible characters, or are equal
        numbers, such as ``1`` and ``01``. The message names both entries.
    """
    for name in ("condition", "specimen"):
        _check_looks(listed, name)
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


def _check_looks(listed, name):
    first: dict[Hashable, ListedRecording] = {}
    for entry in listed:
        text = getattr(entry, name)
        if text is None:
            continue
        other = first.setdefault(_appearance(text), entry)
        other_text = getattr(other, name)
        if other_text != text:
            raise ValueError(
                f"{entry.where or entry.path}: {name} {text!a} looks like {other_text!a} "
                f"of {other.where or other.path}, expected one way to write it"
            )


def _appearance(text):
    """Return what a reader sees of a text: a number, or letters without their encoding."""
    letters = unicodedata.normalize("NFKC", text)
    letters = "".join(c for c in letters if unicodedata.category(c) != "Cf")
    words = " ".join(letters.split())
    value = number(words)
    return value if abs(value) < float("inf") else words


def _channels(entry, entries):
    """Return the chosen channels, by their names if they are stated in several ways."""
    if len({str(other.channel) for other in entries}) == 1:
        return ""
    return tuple(chosen_channels(entry.path, entry.channel, entry.dtype))


def _same_files(listed):
    """Yield entries of the same file, or of files with equal bytes, if there are several."""
    by_file = defaultdict(list)
    for entry in listed:
        # A missing file is reported when it is read.
        if entry.path.is_file():
            status = entry.path.stat()
            by_file[status.st_dev, status.st_ino].append(entry)
    groups = [list(by_file.values())]
    for key in (os.path.getsize, _ends, _digest):
        groups = [part for files in groups for part in _divided(files, key)]
    for files in groups:
        entries = list(chain.from_iterable(files))
        if len(entries) > 1:
            yield entries


def _divided(files, key):
    """Divide files, each a list of its entries, by a key of the path."""
    if len(files) == 1:
        return [files]
    parts = defaultdict(list)
    for entries in files:
        parts[key(entries[0].path)].append(entries)
    return parts.values()


def _ends(path):
    with path.open("rb") as file:
        first = file.read(_ENDS)
        file.seek(max(os.fstat(file.fileno()).st_size - _ENDS, 0))
        return hashlib.sha256(first + file.read()).digest()


def _digest(path):
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()
