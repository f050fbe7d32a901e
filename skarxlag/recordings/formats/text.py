"""Text with a column for each channel."""

import csv
import gzip
import io
import re
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ._contents import ContentError, Contents, check_unpacked

TITLE = "text, also packed by gzip"
SUFFIXES = (".csv", ".txt", ".tsv", ".csv.gz", ".txt.gz", ".tsv.gz")
LIBRARY = EXTRA = None
ISOLATED = False
IN_PARTS = True
STATES = "the rate, by a time column; units, in a second line or in brackets"

_HEAD = 2**16
#: Lines from which the layout is inferred.
_LINES = 60
_NUMBER = r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?"
_WITH_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_UNIT_IN_NAME = re.compile(r".*[(\[]([^()\[\]]+)[)\]]\s*")


@dataclass(frozen=True)
class TextLayout:
    """Layout of a text file.

    Attributes
    ----------
    encoding, separator, decimal : str
        As `pandas.read_csv` takes them.
    has_header : bool
        Whether the columns have names.
    n_head_lines : int
        Lines before the first sample: comments, names, units.
    names : list of str
        Of the columns; their positions if there is no header.
    units : dict of str to str
        By column, if stated.
    """

    encoding: str
    separator: str
    decimal: str
    has_header: bool
    n_head_lines: int
    names: list[str]
    units: dict[str, str]


def contents(path: Path) -> Contents:
    """Return the channels by the names in the first line, ``0``, ``1``, ... if it has numbers."""
    with _open(path) as file:
        head = file.read(_HEAD)
    layout = text_layout(head, is_whole=len(head) < _HEAD)

    def read(names, n_samples):
        positions = [layout.names.index(name) for name in names]
        options = {
            "sep": layout.separator,
            "decimal": layout.decimal,
            "encoding": layout.encoding,
            "header": None,
            "names": layout.names if layout.has_header else None,
            "skiprows": layout.n_head_lines,
        }
        if n_samples is None:
            with _open(path) as file:
                yield _columns(read_csv_frame(file, **options), positions)
            return
        with _open(path) as file, read_csv_frame(file, chunksize=n_samples, **options) as frames:
            while True:
                with _strict_parser():
                    frame = next(frames, None)
                if frame is None:
                    return
                yield _columns(frame, positions)

    return Contents(layout.names, read, units=layout.units)


def read_csv_frame(source: Any, **options: Any) -> Any:
    """Read a csv file with pandas, dropping neither blank lines nor surplus fields."""
    import pandas as pd

    with _strict_parser():
        return pd.read_csv(
            source, index_col=False, skip_blank_lines=False, low_memory=False, **options
        )


@contextmanager
def _strict_parser():
    import pandas as pd

    with warnings.catch_warnings():
        # By default surplus fields would turn the first column into an index.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        yield


def _columns(frame, positions):
    return [frame.iloc[:, position] for position in positions]


@contextmanager
def _open(path):
    with path.open("rb") as file:
        if path.suffix.lower() != ".gz":
            yield file
            return
        n_packed = path.stat().st_size
        with gzip.open(file) as unpacked, io.BufferedReader(_Bounded(unpacked, n_packed)) as text:
            yield text


class _Bounded(io.RawIOBase):
    """A stream that is unpacked while it is read, up to the bound for its file."""

    def __init__(self, stream, n_packed):
        self._stream, self._n_packed, self._count = stream, n_packed, 0

    def readable(self):
        return True

    def readinto(self, buffer):
        n_bytes = self._stream.readinto(buffer)
        self._count += n_bytes
        check_unpacked(self._n_packed, self._count)
        return n_bytes


def text_layout(head: bytes, is_whole: bool) -> TextLayout:
    r"""Infer the layout of a text file from its first bytes.

    Lines at the top that begin with ``#`` or ``%`` are comments. Separators are the semicolon, the
    tabulator, the comma, and white space where a line holds nothing but numbers. Decimal commas
    are recognised wherever the comma does not separate. A first line with a field that is no
    number holds names, and a second one without any number then holds units.

    Parameters
    ----------
    head : bytes
        The beginning of the file.
    is_whole : bool
        Whether that is the whole file; if not, its last line is not looked at.

    Returns
    -------
    TextLayout

    Examples
    --------
    >>> layout = text_layout(b"time;acc\ns;g\n0,0;1,5\n0,1;-2\n", True)
    >>> layout.separator, layout.decimal, layout.names, layout.units, layout.n_head_lines
    (';', ',', ['time', 'acc'], {'time': 's', 'acc': 'g'}, 2)
    """
    encoding, text = _decode(head)
    lines = text.splitlines()
    if not is_whole:
        lines = lines[:-1]
    n_comments = next(
        (i for i, each in enumerate(lines) if not each.startswith(("#", "%"))), len(lines)
    )
    body = lines[n_comments : n_comments + _LINES]
    if not any(line.strip() for line in body):
        raise ContentError("No columns to parse: the file holds no line of text")
    separator = _separator([line for line in body if line.strip()][-20:])
    decimal = "."
    if separator != ",":
        fields = [field for line in body for field in _fields(line, separator)]
        decimal = "," if any(_WITH_COMMA.fullmatch(field) for field in fields) else "."
    first = _fields(body[0], separator)
    names, units, n_head = None, {}, n_comments
    if not all(is_number(field, decimal) for field in first):
        names, n_head = first, n_head + 1
        second, third = (_fields(line, separator) for line in [*body, "", ""][1:3])
        if _is_unit_line(second, decimal) and any(is_number(f, decimal) and f for f in third):
            units, n_head = dict(zip(_distinct(names), second, strict=False)), n_head + 1
    elif n_comments:
        last = _fields(lines[n_comments - 1].lstrip("#% "), separator)
        if len(last) == len(first) and not all(is_number(field, decimal) for field in last):
            names = last
    has_header = names is not None
    names = _distinct(names) if has_header else [str(i) for i in range(len(first))]
    for name in names:
        if name not in units and (match := _UNIT_IN_NAME.fullmatch(name)):
            units[name] = match[1]
    units = {name: unit.strip("[]() ") for name, unit in units.items() if unit.strip("[]() ")}
    return TextLayout(encoding, separator, decimal, has_header, n_head, names, units)


def _decode(head):
    for mark, encoding in ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if head.startswith(mark):
            return encoding, head[: len(head) // 2 * 2].decode(encoding, errors="replace")
    try:
        # The last character may have been cut.
        return "utf-8-sig", head.decode("utf-8-sig", errors="strict")
    except UnicodeDecodeError as error:
        if error.start >= len(head) - 4:
            return "utf-8-sig", head[: error.start].decode("utf-8-sig")
        return "latin-1", head.decode("latin-1")


def _separator(lines):
    for separator in (";", "\t"):
        if all(separator in line for line in lines):
            return separator
    numbers = [line.split() for line in lines if "," not in line.split()]
    last = numbers[-1] if numbers else []
    if len(last) > 1 and all(re.fullmatch(_NUMBER, field) for field in last):
        return r"\s+"
    return ","


def _fields(line, separator):
    if separator == r"\s+":
        return line.split()
    return [field.strip() for field in next(csv.reader([line], delimiter=separator), [])]


def is_number(field: str, decimal: str) -> bool:
    """Whether a field holds a number, or nothing."""
    try:
        float(field.replace(decimal, ".") if field else "nan")
    except ValueError:
        return False
    return True


def _is_unit_line(fields, decimal):
    return any(fields) and not any(field and is_number(field, decimal) for field in fields)


def _distinct(names):
    """Names with a number behind those that stand a second time, as pandas gives it."""
    seen, distinct = {}, []
    for i, name in enumerate(names):
        name = name or f"Unnamed: {i}"
        seen[name] = seen.get(name, -1) + 1
        distinct.append(f"{name}.{seen[name]}" if seen[name] else name)
    return distinct
