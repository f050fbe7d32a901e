"""Tables of recordings: their columns, checks, and the facts in their lines."""

import difflib
import os
import re
import unicodedata
from pathlib import Path
from typing import Any

import numpy as np

from .formats.facts import HERTZ, check_unambiguous, distinct, parse_number
from .formats.text_layout import decode, split_rows
from .speeds import HIGHEST_RPM, is_speed_source

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


def parsed_facts(where: str, facts: dict[str, str]) -> dict[str, Any]:
    """Convert texts, by the name of the fact, to the fields of `ListedRecording`."""
    fields: dict[str, Any] = {name: facts[name] for name in FACTS if facts.get(name)}
    unit = facts.get(_RATE_UNIT) or "Hz"
    if unit.lower() not in HERTZ:
        raise ValueError(f"{where}: {_RATE_UNIT} is {unit!r}, expected Hz or kHz")
    scale = HERTZ[unit.lower()]
    if "sampling_rate" in fields:
        text = fields["sampling_rate"]
        # No rate has thousands of kHz.
        highest = np.inf if scale == 1 else 0
        fields["sampling_rate"] = scale * _positive(
            where, "sampling_rate", text, highest
        )
    if text := fields.get("pulses_per_revolution"):
        name = "pulses_per_revolution"
        fields[name] = _positive(where, name, text)
    if "rpm" in fields:
        fields |= speed_facts(where, fields.pop("rpm"))
    if "channel" in fields:
        fields["channel"] = channel_names(fields["channel"])
    for name in fields.keys() & {"condition", "specimen"}:
        # Texts that look alike are equal: letters of one or two characters, as in the
        # names of files of macOS, blanks of a spreadsheet, and invisible characters.
        characters = unicodedata.normalize("NFC", fields[name])
        visible = (c for c in characters if unicodedata.category(c) != "Cf")
        fields[name] = " ".join("".join(visible).split())
    fields["further"] = {
        name: text for name, text in facts.items() if name not in _COLUMNS
    }
    return fields


def channel_names(text: str) -> str | list[str]:
    """Parse the name of a channel, or several, separated by semicolons."""
    return [name.strip() for name in text.split(";")] if ";" in text else text


def speed_facts(where: str, text: str) -> dict[str, Any]:
    """Parse a shaft speed, or a source of speeds, to fields of `ListedRecording`."""
    if is_speed_source(text):
        return {"speed_source": text}
    return {"rpm": _positive(where, "rpm", text, HIGHEST_RPM)}


def _positive(where, name, text, highest=np.inf):
    """Return a positive number from a text, or raise an error that names the place."""
    check_unambiguous(f"{where}: {name}", text, highest)
    value = parse_number(text)
    if not 0 < value < np.inf:
        raise ValueError(f"{where}: {name} is {text!r}, expected a positive number")
    return value


def read_recordings(path: Path, has_speed: bool = False) -> dict[int, dict[str, str]]:
    """Return the cells of each recording by the names of their columns, and these by line."""
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    header, rows = read_cells(path, "path")
    names = [_column_name(name) for name in header]
    _check_columns(path, names)
    table = {
        line: dict(zip(distinct(names), cells, strict=True))
        for line, cells in rows.items()
    }
    if not table:
        raise ValueError(f"{path}: lists no recording")
    filled = ["path", "condition", "specimen"] + ([] if has_speed else ["rpm"])
    for line, row in table.items():
        for name in filled:
            if row.get(name) == "":
                raise ValueError(f"{path}, line {line}: {name} is empty")
    return table


def _column_name(name):
    """Return the name of a known column in any spelling, and any other name as it is."""
    spelling = re.sub(r"[\s_-]+", "_", name.strip().lower())
    return spelling if spelling in (*_COLUMNS, _RATE_UNIT) else name.strip()


def _check_columns(path, names):
    missing = [name for name in _COLUMNS if name not in names]
    problems = [f"the column {c} is missing." for c in missing if c == "path"]
    problems += [
        f"the column {c} is there twice." for c in _COLUMNS if names.count(c) > 1
    ]
    for name in names:
        for close in difflib.get_close_matches(name.lower(), missing, n=1, cutoff=0.8):
            problems.append(f"is the column {name!r} meant to be {close}?")
    if problems:
        raise ValueError(
            f"{path}: {problems[0]} The columns are {', '.join(names)}; expected path, "
            f"and any of {', '.join(FACTS)}"
        )


def read_cells(
    path: str | os.PathLike[str], key: str
) -> tuple[list[str], dict[int, list[str]]]:
    r"""Read the cells of a csv table. The sign that its header holds most of separates.

    Parameters
    ----------
    path : str or path-like
        Text as spreadsheets write it, separated by commas, semicolons or tabulators.
    key : str
        A column. The first line with its name, in any case, is the header; without
        such a line, the first one that has text.

    Returns
    -------
    header : list of str
        The names of the columns.
    rows : dict of int to list of str
        Cells without blanks around them, by the number of the line. All rows have as
        many cells as the header; those that are missing are empty. Rows without any
        text, and comments, are left out.

    Raises
    ------
    ValueError
        If the file is empty or no such table, or a row has more cells than the header.
        The message names the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "table.csv")
    ...     _ = path.write_text("sep=;\npath;rpm\n;\nrun.wav; 900\nb.wav\n")
    ...     read_cells(path, "path")
    (['path', 'rpm'], {4: ['run.wav', '900'], 5: ['b.wav', '']})
    """
    try:
        _, text = decode(Path(path).read_bytes())
        if "\0" in text:
            raise ValueError("it holds no text")
        lines = text.splitlines()
        pattern = re.compile(rf'(^|[,;\t"])\s*{key}\s*([,;\t"]|$)', re.IGNORECASE)
        first = next((i for i, line in enumerate(lines) if pattern.search(line)), 0)
        separator = max(",;\t", key="".join(lines[first : first + 1]).count)
        header: list[str] = []
        rows = {}
        for n_before, cells in split_rows(lines[first:], separator):
            line = first + n_before + 1
            if len(cells) > len(header) > 0:
                raise ValueError(
                    f"line {line} has {len(cells)} cells, expected {len(header)}"
                )
            if header and any(cells) and not cells[0].startswith("#"):
                rows[line] = cells + [""] * (len(header) - len(cells))
            header = header or cells
        if not any(header):
            raise ValueError("it holds no line of text")
        return header, rows
    except ValueError as error:
        raise ValueError(f"{path}: cannot be read as a csv table ({error})") from error
