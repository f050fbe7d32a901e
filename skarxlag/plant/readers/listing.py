"""List recordings from tables, folders and globs, without reading them."""

import os
import re
from collections import Counter
from dataclasses import replace
from glob import glob
from pathlib import Path
from typing import Any

from .entries import ListedRecording
from .formats import suffixes
from .recording_tables import parsed_facts, read_recordings
from .speeds import TACHO

#: Unit of a speed in the name of a file.
_HERTZ = re.compile("[ _-]*hz", re.IGNORECASE)
#: Facts of the shaft speed, of which a line states all or none.
_OF_SPEED = ("rpm", "speed_source", "pulses_per_revolution")


def is_file_source(source: str | os.PathLike[str]) -> bool:
    """Return whether a path is a folder or a glob, not one file such as a table."""
    path = Path(source)
    return path.is_dir() or (
        not path.exists() and any(sign in str(source) for sign in "*?[")
    )


def list_files(
    source: str | os.PathLike[str], *, pattern: str | None = None, **stated: Any
) -> list[ListedRecording]:
    r"""List the recordings of a folder, a glob, or one file.

    Parameters
    ----------
    source : path-like
        A folder, of which all files with a known suffix are taken, also in folders
        below, but not behind links; or a glob such as ``runs/*/acc_*.tdms``, in which
        ``**`` stands for folders of any depth; or a file.
    pattern : str, default=None
        Regular expression that is searched for in the path of each file, below the
        folder or as the glob gives it, written with ``/``. Its named groups are facts
        of the recording: ``condition``, ``specimen``, ``load``, ``rpm``,
        ``sampling_rate``, ``channel``; groups of other names are kept. An example is
        ``(?P<condition>[A-Z]+)_(?P<rpm>\d+)``.
    **stated : channel, sampling_rate, dtype
        Of all recordings, unless the pattern states it.

    Returns
    -------
    list of ListedRecording
        In the order of their paths.

    Raises
    ------
    FileNotFoundError
        If there is no such file, or none in the folder.
    ValueError
        If the pattern is no regular expression, has no named group, does not fit a
        file, or takes ``rpm`` from a number in Hz.
    """
    try:
        expression = re.compile(pattern or "")
        if pattern is not None and not expression.groupindex:
            raise re.error("expected named groups such as (?P<condition>..)")
    except re.error as error:
        raise ValueError(f"pattern is {pattern!r}: {error}") from error
    listed = []
    for name, path in _files(source):
        match = expression.search(name)
        if match is None:
            raise ValueError(f"{name}: does not fit the pattern {pattern!r}")
        facts = parsed_facts(name, match.groupdict(""))
        if "rpm" in facts and _HERTZ.match(name, match.end("rpm")):
            raise ValueError(
                f"{name}: the pattern takes rpm {facts['rpm']:g} from a number in Hz; "
                "write a table with the column rpm, 60 times as large"
            )
        listed.append(ListedRecording(None, name, path, **stated | facts))
    return listed


def _files(source):
    """Return the names and paths of the files of a folder, a glob, or one file."""
    root = Path(source)
    if root.is_dir():
        ends = suffixes()
        paths = (p for p in root.rglob("*") if p.name.lower().endswith(ends))
        files = [(path.relative_to(root).as_posix(), path) for path in paths]
    else:
        names = [str(source)] if root.exists() else glob(str(source), recursive=True)
        files = [(Path(name).as_posix(), Path(name)) for name in names]
    files = sorted((name, path) for name, path in files if path.is_file())
    if not files:
        raise FileNotFoundError(
            f"{source}: no such file, expected a recording, folder or glob"
        )
    return files


def list_recordings(
    path: str | os.PathLike[str], **stated: Any
) -> list[ListedRecording]:
    """List the lines of a table or the files of a folder or glob.

    Parameters
    ----------
    path : str or path-like
        As in `read_recording_table`.
    **stated : pattern, channel, sampling_rate, rpm, dtype
        As in `list_files`. With a table, they hold for the lines that do not state the
        fact, and a pattern is an error.

    Returns
    -------
    list of ListedRecording
        In the order of the table or of the paths.

    Raises
    ------
    FileNotFoundError, ValueError
        As in `read_recording_table`, if the list itself is wrong; and if each line of a
        table states a fact itself.
    """
    if is_file_source(path):
        return list_files(path, **stated)
    stated = {name: value for name, value in stated.items() if value is not None}
    if "pattern" in stated:
        raise ValueError(f"pattern is for a folder or a glob; {path} is a table")
    path = Path(path)
    table = read_recordings(path, has_speed="rpm" in stated or "speed_source" in stated)
    n_listed = Counter(row["path"] for row in table.values())
    listed = []
    for line, row in table.items():
        where = f"{path}, line {line}"
        facts = parsed_facts(where, row)
        source = facts.get("speed_source", TACHO)
        if not source.startswith(TACHO):
            facts["speed_source"] = str(path.parent / source)
        name = row["path"]
        file = path.parent / name
        if n_listed[name] > 1:
            name += f":{row.get('channel', '')}"
        listed.append(ListedRecording(where, name, file, **facts))
    return _filled(path, listed, stated)


def _filled(source, listed, stated):
    """Return the recordings with the facts that their lines do not state."""
    filled = []
    used = set()
    for entry in listed:
        facts = {
            name: value
            for name, value in stated.items()
            if not (entry.states_speed if name in _OF_SPEED else getattr(entry, name))
        }
        used |= facts.keys()
        filled.append(replace(entry, **facts))
    for name, value in stated.items():
        if name not in used:
            shown = name.replace("speed_source", "rpm")
            raise ValueError(
                f"{shown} {value!r} has no effect, because each line of {source} states it"
            )
    return filled
