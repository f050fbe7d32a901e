"""Tables of a user's own recordings."""

import difflib
import os
import re
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from .formats.text import read_csv_frame
from .listing import FACTS, ListedRecording, is_file_source, list_files, positive

COLUMNS = ("path", *FACTS)


def list_recordings(
    path: str | os.PathLike[str],
    *,
    pattern: str | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    sampling_rate: float | None = None,
    dtype: str | None = None,
) -> list[ListedRecording]:
    """Lines of a table or files of a folder, without reading the recordings.

    Parameters
    ----------
    path, pattern, channel, sampling_rate, dtype
        As in `read_recording_table`.

    Returns
    -------
    list of ListedRecording
        In the order of the table or of the paths.

    Raises
    ------
    FileNotFoundError, ValueError
        As in `read_recording_table`, as far as the list itself is at fault.
    """
    options = {
        "pattern": pattern,
        "channel": channel,
        "sampling_rate": sampling_rate,
        "dtype": dtype,
    }
    if is_file_source(path):
        return list_files(path, **options)
    for name, value in options.items():
        if value is not None:
            raise ValueError(
                f"{name}={value!r} is for a folder or a glob; {path} is a table, which has a "
                f"column for it"
            )
    path = Path(path)
    table = _read_table(path)
    known = table.columns.intersection(COLUMNS)
    repeated = table["path"].duplicated(keep=False)
    listed = []
    for line, row in table.iterrows():
        where = f"{path}, line {line}"
        channels = [name.strip() for name in row["channel"].split(";")] if row["channel"] else []
        rate, rpm = row["sampling_rate"], row.get("rpm")
        listed.append(
            ListedRecording(
                where=where,
                name=f"{row['path']}:{row['channel']}" if repeated[line] else row["path"],
                path=path.parent / row["path"],
                channel=channels if len(channels) > 1 else next(iter(channels), None),
                sampling_rate=positive(where, "sampling_rate", rate) if rate else None,
                condition=row.get("condition"),
                rpm=None if rpm is None else positive(where, "rpm", rpm),
                dtype=row["dtype"] or None,
                further=row.drop(known).to_dict(),
            )
        )
    return listed


def _read_table(path):
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with path.open(encoding="utf-8-sig") as file:
            head = file.readline()
        separator = max(",;\t", key=head.count)
        table = read_csv_frame(
            path, dtype=str, keep_default_na=False, encoding="utf-8-sig", sep=separator
        )
    except (ValueError, pd.errors.ParserWarning) as error:
        raise ValueError(f"{path}: cannot be read as a csv table ({error})") from error
    table = table.rename(columns=_column_name).apply(lambda column: column.str.strip())
    _check_columns(path, list(table.columns))
    # Rows bear the number of their line, the header being the first, for error messages.
    table.index += 2
    table = table[(table != "").any(axis=1)]
    if table.empty:
        raise ValueError(f"{path}: lists no recording")
    for name in table.columns.intersection(["path", "condition", "rpm"]):
        empty = table.index[table[name] == ""]
        if len(empty):
            raise ValueError(f"{path}, line {empty[0]}: {name} is empty")
    optional = ("sampling_rate", "channel", "dtype")
    table = table.assign(**{name: "" for name in optional if name not in table.columns})
    twice = table.index[table.duplicated(["path", "channel"])]
    if len(twice):
        row = table.loc[twice[0]]
        raise ValueError(f"{path}, line {twice[0]}: {row['path']} is listed a second time")
    return table


def _column_name(name):
    """A known column however it is spelt; any other as it is."""
    plain = re.sub(r"[\s_-]+", "_", name.strip().lower())
    return plain if plain in COLUMNS else name.strip()


def _check_columns(path, names):
    listed = f"{path}: columns {names}, expected 'path' and any of {COLUMNS[1:]}"
    if "path" not in names:
        raise ValueError(listed)
    for name in names:
        # pandas numbers a name that stands a second time.
        first = _column_name(name.rpartition(".")[0] if name[-1:].isdigit() else name)
        if first in COLUMNS and (name != first or names.count(name) > 1):
            raise ValueError(f"{listed}; {first!r} stands there twice")
        missing = [each for each in COLUMNS if each not in names]
        close = difflib.get_close_matches(name.lower(), missing, n=1, cutoff=0.8)
        if close:
            raise ValueError(f"{listed}; is {name!r} meant to be {close[0]!r}?")
