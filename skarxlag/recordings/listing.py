"""List recordings from tables, folders and globs, without reading them."""

import difflib
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from glob import glob
from pathlib import Path
from typing import Any, Self

from numpy.typing import NDArray

from .files import recording_blocks, recording_speed, recording_start
from .formats import SUFFIXES
from .formats._facts import HERTZ
from .formats.text import distinct, number
from .monotonic import Direction
from .rates import NO_RATE, rates_agree, unit_advice
from .speeds import (
    TACHO,
    SpeedProfile,
    check_stated_speed,
    is_speed_source,
    logged_speed,
)
from .tables import read_rows

#: Facts of a recording in a table or a file name; anything else is kept as it is.
FACTS = (
    "condition",
    "specimen",
    "load",
    "rpm",
    "pulses_per_revolution",
    "sampling_rate",
    "channel",
    "dtype",
)
_COLUMNS = ("path", *FACTS)
_RATE_UNIT = "sampling_rate_unit"


@dataclass(frozen=True)
class ListedRecording:
    """Recording in a list: its file, and the facts that are stated outside the file.

    Parameters
    ----------
    where : str or None
        Entry that error messages name, such as the line of a table. None: they name the
        path.
    name : str
        Its name in results.
    path : Path
        The file.
    channel : str, list of str or None
        As in :func:`read_recording`.
    sampling_rate : float or None
        In Hz, if it was stated outside the file.
    condition : str or None
        State of the machine, if known.
    specimen : str or None
        The bearing, if stated.
    load : str or None
        Load of the machine, a number or a text, if stated.
    rpm : float or None
        Mean shaft speed, rev/min, if known.
    dtype : str or None
        As in :func:`read_recording`.
    speed_source : str or None
        Where the speed is stated if `rpm` is None: ``tacho:CHANNEL``, or a csv file.
        None: in the file of the recording.
    pulses_per_revolution : float
        Pulses of the tachometer in a turn of the shaft.
    further : dict of str to str
        Other facts in the table or the file name, by the name of the column or the
        group.
    profile : SpeedProfile or None
        Speed over time, if a source states it.
    """

    where: str | None
    name: str
    path: Path
    channel: str | list[Any] | None = None
    sampling_rate: float | None = None
    condition: str | None = None
    specimen: str | None = None
    load: str | None = None
    rpm: float | None = None
    dtype: str | None = None
    speed_source: str | None = None
    pulses_per_revolution: float = 1
    further: dict[str, Any] = field(default_factory=dict)
    profile: SpeedProfile | None = None

    def with_speed(self) -> Self:
        """Return the recording with its shaft speed, if a file states it.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As `recording_speed` and `logged_speed` do; and if a tachometer has fewer
            than two pulses, no sampling rate, or no integer number of pulses in a turn.
            The message names the entry.
        """
        if self.rpm is not None:
            return self
        source, options = (
            self.speed_source,
            {"channel": self.channel, "dtype": self.dtype},
        )
        with self.named():
            if source is None:
                found = recording_speed(
                    self.path, sampling_rate=self.sampling_rate, **options
                )
            elif source.startswith(TACHO):
                from ..core.speeds import pulse_speeds

                if self.pulses_per_revolution % 1:
                    raise ValueError(
                        f"pulses_per_revolution is {self.pulses_per_revolution}, not an integer"
                    )
                ((signal, rate),) = replace(
                    self, channel=source.removeprefix(TACHO)
                ).blocks()
                if rate is None:
                    raise ValueError(NO_RATE)
                found = SpeedProfile(
                    *pulse_speeds(signal, rate, int(self.pulses_per_revolution))
                )
            else:
                names = {self.name, str(self.path), self.path.name, self.path.stem}
                found = logged_speed(source, names, self._span)
        if isinstance(found, SpeedProfile):
            return replace(self, rpm=found.mean(), profile=found)
        return replace(self, rpm=found)

    def speeds(self, start: Any, n_samples: int, sampling_rate: float) -> Any:
        """Return the speeds of rows, see `SpeedProfile.rows`; `rpm` if there is no profile."""
        if self.profile is None:
            return self.rpm
        return self.profile.rows(start, n_samples, sampling_rate)

    def _span(self, is_date):
        """Times of the first and the last sample, since 1970 or since the start."""
        start = 0.0
        if is_date:
            start = recording_start(self.path, channel=self.channel, dtype=self.dtype)
        blocks = [(signal.shape[-1], rate) for signal, rate in self.blocks(2**20)]
        lengths, rates = zip(*blocks, strict=True)
        if start is None or rates[0] is None:
            what = (
                "the date of its first sample" if start is None else "its sampling rate"
            )
            raise ValueError(
                f"the recording does not state {what}, which a log of speeds needs"
            )
        return start, start + sum(lengths) / rates[0]

    def blocks(
        self, n_samples: int | None = None
    ) -> Iterator[tuple[NDArray[Any], float | None]]:
        """Yield blocks of the recording and its sampling rate, like `recording_blocks`.

        Parameters
        ----------
        n_samples : int or None, default=None
            Samples in a block, at most. None: one block of all.

        Raises
        ------
        FileNotFoundError, ImportError, ValueError
            As there; if the stated rate differs from the rate in the file; and, after
            the last block, if the first channel only rises or only falls. The message
            names the entry.
        """
        stated, direction = self.sampling_rate, Direction()
        with self.named():
            options = {
                "channel": self.channel,
                "dtype": self.dtype,
                "stated_rate": stated,
            }
            for signal, known in recording_blocks(self.path, n_samples, **options):
                if not rates_agree(stated, known):
                    found = f"sampling_rate is {stated:g} Hz but the file states {known:g} Hz"
                    raise ValueError(
                        f"{self.path}: {found}{unit_advice(known, stated)}"
                    )
                direction.add(signal if signal.ndim == 1 else signal[0])
                yield signal, known if stated is None else stated
            if direction.is_monotonic:
                chosen = self.channel if isinstance(self.channel, str) else None
                found = "the channel" if chosen is None else f"channel {chosen!r}"
                expected = "it holds times or a count, and is no signal; choose another channel"
                raise ValueError(
                    f"{self.path}: {found} only rises or only falls: {expected}"
                )

    @contextmanager
    def named(self) -> Iterator[None]:
        """Put the entry at the beginning of error messages."""
        where = self.where or str(self.path)
        try:
            yield
        except (FileNotFoundError, ImportError, ValueError) as error:
            if str(error).startswith(where):
                raise
            raise type(error)(f"{where}: {error}") from error


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
        below; or a glob such as ``runs/*/acc_*.tdms``, in which ``**`` stands for
        folders of any depth; or a file.
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
        If the pattern is no regular expression, has no named group, or does not fit a
        file.
    """
    try:
        expression = re.compile(pattern or "")
        if pattern is not None and not expression.groupindex:
            raise re.error("expected named groups such as (?P<condition>..)")
    except re.error as error:
        raise ValueError(f"pattern is {pattern!r}: {error}") from error
    listed = []
    for name, path in _found(source):
        match = expression.search(name)
        if match is None:
            raise ValueError(f"{name}: does not fit the pattern {pattern!r}")
        facts = _parsed(name, match.groupdict(""))
        listed.append(ListedRecording(None, name, path, **stated | facts))
    return listed


def _parsed(where, facts):
    """Convert texts, by the name of the fact, to the fields of `ListedRecording`."""
    known = {name: text for name, text in facts.items() if name in FACTS and text}
    for name in known.keys() & {"pulses_per_revolution", "sampling_rate"}:
        known[name] = _positive(where, name, known[name])
    if "sampling_rate" in known and (unit := facts.get(_RATE_UNIT)):
        if (scale := HERTZ.get(unit.lower())) is None:
            raise ValueError(f"{where}: {_RATE_UNIT} is {unit!r}, expected Hz or kHz")
        known["sampling_rate"] *= scale
    if "rpm" in known:
        known |= speed_facts(where, known.pop("rpm"))
    if "channel" in known:
        known["channel"] = channel_names(known["channel"])
    for name in known.keys() & {"condition", "specimen"}:
        # The same letters may be one character or two, as in the names of files of
        # macOS.
        known[name] = unicodedata.normalize("NFC", known[name])
    return known | {
        "further": {name: text for name, text in facts.items() if name not in _COLUMNS}
    }


def channel_names(text: str) -> str | list[str]:
    """Parse the name of a channel, or several, separated by semicolons."""
    return [name.strip() for name in text.split(";")] if ";" in text else text


def speed_facts(where: str, text: str) -> dict[str, Any]:
    """Parse a shaft speed, or a source of speeds, to fields of `ListedRecording`."""
    if is_speed_source(text):
        return {"speed_source": text}
    try:
        check_stated_speed(text)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
    return {"rpm": _positive(where, "rpm", text)}


def _positive(where, name, text):
    """Return a positive number from a text, or raise an error that names the place."""
    value = number(text)
    if not 0 < value < float("inf"):
        raise ValueError(f"{where}: {name} is {text!r}, expected a positive number")
    return value


def _found(source):
    root = Path(source)
    if root.is_dir():
        found = [
            (path.relative_to(root).as_posix(), path) for path in _files_below(root)
        ]
    else:
        paths = (
            [root] if root.exists() else map(Path, glob(str(source), recursive=True))
        )
        found = [(path.as_posix(), path) for path in paths if path.is_file()]
    if not found:
        raise FileNotFoundError(
            f"{source}: no such file, expected a recording, folder or glob"
        )
    return sorted(found)


def _files_below(folder):
    """Yield the files with a known suffix. Links are followed; each folder is visited once."""
    seen = set()
    for parent, folders, names in os.walk(folder, followlinks=True):
        # A link may lead to a folder that is listed anyway, or back to one above it.
        is_new = (real := os.path.realpath(parent)) not in seen
        seen.add(real)
        folders[:] = (
            sorted(folders, key=lambda name: Path(parent, name).is_symlink()) * is_new
        )
        paths = (
            Path(parent, name) for name in names if name.lower().endswith(SUFFIXES)
        )
        yield from (path for path in paths if is_new and path.is_file())


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
        As in `read_recording_table`, if the list itself is wrong. `UnusedFactError` if
        each line of a table states a fact itself.
    """
    if is_file_source(path):
        return list_files(path, **stated)
    stated = {name: value for name, value in stated.items() if value is not None}
    if "pattern" in stated:
        pattern = stated["pattern"]
        raise ValueError(
            f"pattern={pattern!r} is for a folder or a glob; {path} is a table"
        )
    path = Path(path)
    table = _read_table(path, has_speed="rpm" in stated or "speed_source" in stated)
    n_listed = Counter(row["path"] for row in table.values())
    listed = []
    for line, row in table.items():
        where = f"{path}, line {line}"
        facts = _parsed(where, row)
        source = facts.get("speed_source", TACHO)
        if not source.startswith(TACHO):
            facts["speed_source"] = str(path.parent / source)
        name = (
            f"{row['path']}:{row['channel']}"
            if n_listed[row["path"]] > 1
            else row["path"]
        )
        listed.append(ListedRecording(where, name, path.parent / row["path"], **facts))
    return _filled(path, listed, stated)


class UnusedFactError(ValueError):
    """Error on a fact that holds for no recording, because each states it itself.

    Parameters
    ----------
    source : Path
        The table.
    name : str
        Name of the fact.
    value : object
        Its value.
    """

    def __init__(self, source: Path, name: str, value: Any) -> None:
        self.source: Path = source
        self.name: str = name
        super().__init__(
            f"{name}={value!r} has no effect: each line of {source} states it"
        )


def _filled(source, listed, stated):
    """Return the recordings with the facts that their lines do not state."""
    needs = [_unstated(entry, stated) for entry in listed]
    for name, value in stated.items():
        if not any(name in own for own in needs):
            shown = name.replace("speed_source", "rpm")
            raise UnusedFactError(source, shown, value)
    return [replace(entry, **own) for entry, own in zip(listed, needs, strict=True)]


def _unstated(entry, stated):
    """Return the facts that a recording does not state."""
    unknown = {
        name
        for name in ("channel", "sampling_rate", "dtype")
        if vars(entry)[name] is None
    }
    if entry.rpm is None and entry.speed_source is None:
        unknown |= {"rpm", "speed_source", "pulses_per_revolution"}
    return {name: value for name, value in stated.items() if name in unknown}


def _read_table(path, has_speed=False):
    """Return the cells of each recording by the names of their columns, and these by line."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    rows = read_rows(path)
    names = [_column_name(name) for name in rows.pop(1)]
    _check_columns(path, names)
    table = {
        line: dict(zip(distinct(names), cells, strict=True))
        for line, cells in rows.items()
    }
    if not table:
        raise ValueError(f"{path}: lists no recording")
    needed = ["path", "condition", "specimen"] + ([] if has_speed else ["rpm"])
    for name in (each for each in needed if each in names):
        for line, row in table.items():
            if row[name] == "":
                raise ValueError(f"{path}, line {line}: {name} is empty")
    listed = set()
    for line, row in table.items():
        recording = row["path"], row.setdefault("channel", "")
        if recording in listed:
            raise ValueError(
                f"{path}, line {line}: {row['path']} is listed a second time"
            )
        listed.add(recording)
    return table


def _column_name(name):
    """Return the name of a known column in any spelling, and any other name as it is."""
    plain = re.sub(r"[\s_-]+", "_", name.strip().lower())
    return plain if plain in (*_COLUMNS, _RATE_UNIT) else name.strip()


def _check_columns(path, names):
    missing = [each for each in _COLUMNS if each not in names]
    wrong = ["'path' is missing"] if "path" in missing else []
    wrong += [f"{name!r} is there twice" for name in _COLUMNS if names.count(name) > 1]
    for name in names:
        for close in difflib.get_close_matches(name.lower(), missing, n=1, cutoff=0.8):
            wrong.append(f"is {name!r} meant to be {close!r}?")
    if wrong:
        expected = f"expected 'path' and any of {FACTS}"
        raise ValueError(f"{path}: columns {names}, {expected}; {wrong[0]}")
