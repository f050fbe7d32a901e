"""Recordings that are listed, of which nothing has been read: folders, globs, lines of a table."""

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from glob import glob
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from .files import recording_blocks
from .formats import FORMATS
from .rates import rates_agree

#: What a table or a file name can tell of a recording; anything else is kept as it is.
FACTS = ("condition", "rpm", "sampling_rate", "channel", "dtype")


@dataclass(frozen=True)
class ListedRecording:
    """One recording that can be read.

    Parameters
    ----------
    where : str or None
        What an error calls its entry, such as the line of a table. None: the path says enough.
    name : str
        What results call it.
    path : Path
        The file.
    channel : str, list of str or None
        As in :func:`read_recording`.
    sampling_rate : float or None
        In Hz, if it was stated beside the file.
    condition : str or None
        State of the machine, if known.
    rpm : float or None
        Shaft speed, rev/min, if known.
    dtype : str or None
        As in :func:`read_recording`.
    further : dict of str to str
        What else the table or the file name says, by the name of the column or the group.
    """

    where: str | None
    name: str
    path: Path
    channel: str | list[Any] | None = None
    sampling_rate: float | None = None
    condition: str | None = None
    rpm: float | None = None
    dtype: str | None = None
    further: dict[str, Any] = field(default_factory=dict)

    def blocks(self, n_samples: int | None = None) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Blocks of the recording and its sampling rate, as `recording_blocks` yields them.

        Parameters
        ----------
        n_samples : int or None, default=None
            Samples in a block, at most. None: one block of all.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As there; if the stated rate differs from the rate in the file; and, for an entry of a
            table, if neither is stated. The message names the entry.
        """
        try:
            yield from self._agreed_blocks(n_samples)
        except (FileNotFoundError, ImportError, ValueError) as error:
            if self.where is None:
                raise
            raise type(error)(f"{self.where}: {error}") from error

    def _agreed_blocks(self, n_samples):
        read = recording_blocks(self.path, n_samples, channel=self.channel, dtype=self.dtype)
        for signal, known in read:
            stated = self.sampling_rate
            if stated is None and known is None and self.where is not None:
                raise ValueError(f"sampling_rate is missing and {self.path} does not state it")
            if not rates_agree(stated, known):
                raise ValueError(
                    f"{self.path}: sampling_rate is {stated:g} Hz but the file states {known:g} Hz"
                )
            yield signal, known if stated is None else stated


def is_file_source(source: str | os.PathLike[str]) -> bool:
    """Whether a path is a folder or a glob, and not one file such as a table."""
    path = Path(source)
    return path.is_dir() or (not path.exists() and any(sign in str(source) for sign in "*?["))


def list_files(
    source: str | os.PathLike[str],
    *,
    pattern: str | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    sampling_rate: float | None = None,
    dtype: str | None = None,
) -> list[ListedRecording]:
    r"""List the recordings of a folder, a glob, or one file.

    Parameters
    ----------
    source : str or path-like
        A folder, of which all files with a known suffix are taken, also in folders below; or a
        glob such as ``runs/*/acc_*.tdms``, in which ``**`` stands for folders of any depth; or a
        file.
    pattern : str, default=None
        Regular expression that is searched for in the path of each file, below the folder or as
        the glob gives it, written with ``/``. Its named groups are facts of the recording:
        ``condition``, ``rpm``, ``sampling_rate``, ``channel``; groups of other names are kept. An
        example is ``(?P<condition>[A-Z]+)_(?P<rpm>\d+)``.
    channel, sampling_rate, dtype
        Of all recordings, unless the pattern tells.

    Returns
    -------
    list of ListedRecording
        In the order of their paths.

    Raises
    ------
    FileNotFoundError
        If there is no such file, or none in the folder.
    ValueError
        If the pattern is no regular expression, has no named group, or does not fit a file.
    """
    expression = None if pattern is None else _compiled(pattern)
    listed = []
    for name, path in _found(source):
        facts = {} if expression is None else _facts_in_name(name, expression)
        known = {key: facts.pop(key) for key in FACTS if key in facts}
        for key in ("rpm", "sampling_rate"):
            if key in known:
                known[key] = positive(name, key, known[key])
        defaults = {"channel": channel, "sampling_rate": sampling_rate, "dtype": dtype}
        listed.append(ListedRecording(None, name, path, **(defaults | known), further=facts))
    return listed


def positive(where: str, name: str, text: str) -> float:
    """A number above zero from a text, or an error that names the place."""
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise ValueError(f"{where}: {name} is {text!r}, expected a positive number")
    return value


def _found(source):
    folder = Path(source)
    if folder.is_dir():
        suffixes = tuple(suffix for module in FORMATS for suffix in module.SUFFIXES)
        paths = [
            path
            for path in folder.rglob("*")
            if path.is_file() and path.name.lower().endswith(suffixes)
        ]
        found = [(path.relative_to(folder).as_posix(), path) for path in paths]
        expected = f"a recording with a known suffix in {source}"
    elif folder.exists():
        return [(str(source), folder)]
    else:
        paths = [Path(path) for path in glob(str(source), recursive=True)]
        found = [(path.as_posix(), path) for path in paths if path.is_file()]
        expected = "a file" if not is_file_source(source) else "files that fit the glob"
    if not found:
        raise FileNotFoundError(f"{source}: no such file, expected {expected}")
    return sorted(found)


def _compiled(pattern):
    try:
        expression = re.compile(pattern)
    except re.error as error:
        raise ValueError(f"pattern is {pattern!r}, no regular expression ({error})") from error
    if not expression.groupindex:
        raise ValueError(f"pattern is {pattern!r}, expected named groups such as (?P<condition>..)")
    return expression


def _facts_in_name(name, expression):
    match = expression.search(name)
    if match is None:
        raise ValueError(f"{name}: does not fit the pattern {expression.pattern!r}")
    return {key: text for key, text in match.groupdict().items() if text is not None}
