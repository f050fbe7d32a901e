"""Infer the layout of a text file from its first bytes."""

import codecs
import csv
import io
import re
from collections import Counter
from dataclasses import dataclass
from itertools import chain

import numpy as np

from .contents import ContentError
from .facts import (
    SECONDS,
    distinct,
    is_number,
    names_times,
    number,
    seconds_of_date,
    unit_in_name,
)

_LINES = 200
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: Number with a decimal comma, or two integers: sign, digits before the comma, digits
#: after it.
_WITH_COMMA = re.compile(r"([+-]?)(\d*),(\d+)")
_INTEGER = re.compile(r"[+-]?\d+")
#: Roles of the comma in lines that hold one comma each.
_SEPARATOR = "separator"
_DECIMAL = "decimal sign"
_UNCLEAR = "either"
_AMBIGUOUS = (
    "the comma may separate two columns of integers, or be the decimal sign of one column: write "
    "the names of the columns into the first line, one for each"
)
#: Units that are no names of columns, as "min" and "h" are.
_UNITS = SECONDS.keys() - {"min", "h"} | {
    *("g", "m/s2", "m/s^2", "m/s²", "mm/s", "v", "mv", "nm", "n", "rpm", "1/min", "%"),
}


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
        Lines before the first sample: comments, preamble, names, units.
    n_ignored : int
        Lines of the preamble: lines before the names that are not comments.
    names : list of str
        Of the columns; their positions if there is no header.
    units : dict of str to str
        By column, if stated.
    advice : str
        Sentence for the reader of a file whose columns are ambiguous, else empty.
    """

    encoding: str
    separator: str
    decimal: str
    has_header: bool
    n_head_lines: int
    n_ignored: int
    names: list[str]
    units: dict[str, str]
    advice: str = ""


def text_layout(head: bytes, is_whole: bool, *, may_be_cut: bool = False) -> TextLayout:
    r"""Infer the layout of a text file from its first bytes.

    Lines at the top that begin with ``#`` or ``%`` are comments. Separators are the
    semicolon, the tabulator, the comma, and white space if a line holds nothing but
    numbers. The decimal comma is recognised if the comma does not separate. In lines
    with one comma, it does not if an integer would not be written so (``+23,9168``,
    ``-0,5``, ``7,05``), or if the names above have no comma. The columns of the last
    lines are numbers, dates or other texts; the first line with the same kinds of
    fields is the first sample. The line before it holds the names, or the units if that
    line holds no number and the one before it does not either. All other lines above
    are a preamble.

    Parameters
    ----------
    head : bytes
        The beginning of the file.
    is_whole : bool
        Whether that is the whole file; if not, its last line is ignored.
    may_be_cut : bool, default=False
        Whether the first line may be the end of a line of numbers.

    Returns
    -------
    TextLayout

    Examples
    --------
    >>> layout = text_layout(b"Logger 7\ntime;acc\ns;g\n0,0;1,5\n0,1;-2\n", True)
    >>> layout.separator, layout.decimal, layout.names, layout.units, layout.n_head_lines
    (';', ',', ['time', 'acc'], {'time': 's', 'acc': 'g'}, 3)
    """
    encoding, text = _decode(head)
    lines = list(io.StringIO(text, newline=None))
    if not is_whole:
        lines = lines[:-1]
    n_comments = next(
        (i for i, line in enumerate(lines) if line[0] not in "#%"), len(lines)
    )
    body = lines[n_comments : n_comments + _LINES]
    filled = [line for line in body if line.strip()]
    if not filled:
        raise ContentError("No columns to parse: the file holds no line of text")
    separator = _separator(filled[len(filled) // 2 :][-20:])
    comma = _role_of_comma(filled) if separator == "," else None
    if comma == _DECIMAL:
        # None of the lines has a semicolon: each is one field.
        separator = ";"
    n_lines_before, rows = zip(*split_rows(body, separator), strict=True)
    with_comma = [field for field in chain.from_iterable(rows) if "," in field]
    is_comma = separator != "," and any(is_number(field, ",") for field in with_comma)
    decimal = "," if is_comma else "."
    kinds = [[_kind(field, decimal) for field in fields] for fields in rows]
    n_fields, n_filled, first = _first_sample(kinds, may_be_cut)
    above = [fields for fields in rows[:first] if fields]
    names = None
    unit_line = []
    if above:
        names, unit_line = _names_and_units(above, n_fields, n_filled, decimal)
    elif n_comments:
        names = _names_in_comment(lines[n_comments - 1], separator, n_fields, decimal)
    has_header = names is not None
    names = distinct(names) if has_header else [str(i) for i in range(n_fields)]
    fields = unit_line or [unit_in_name(name) or "" for name in names]
    units = [field.strip("[]() ") for field in fields]
    n_above = n_lines_before[first] if first < len(rows) else len(body)
    return TextLayout(
        encoding,
        separator,
        decimal,
        has_header,
        n_head_lines=n_comments + n_above,
        n_ignored=max(len(above) - has_header - bool(unit_line), 0),
        names=names,
        units={name: unit for name, unit in zip(names, units, strict=True) if unit},
        advice=_AMBIGUOUS if comma == _UNCLEAR and not has_header else "",
    )


def _role_of_comma(lines):
    """Return whether the comma separates, is the decimal sign of one column, or is unclear."""
    texts = [line.strip().strip('"') for line in lines]
    matches = [_WITH_COMMA.fullmatch(text) for text in texts]
    first = next((i for i, match in enumerate(matches) if match), len(matches))
    samples = [match for match in matches[first:] if match]
    others = [text for text in texts[first:] if not _WITH_COMMA.fullmatch(text)]
    if not samples or not all(map(_INTEGER.fullmatch, others)):
        return _SEPARATOR
    if first > 0:
        return _SEPARATOR if "," in texts[first - 1] else _DECIMAL
    return _DECIMAL if any(map(_is_no_pair_of_integers, samples)) else _UNCLEAR


def _is_no_pair_of_integers(match):
    """Return whether a number has signs or zeros that integers at its comma would not have."""
    sign, before, after = match.groups()
    is_signed = sign == "+" or (sign == "-" and not before.strip("0"))
    return is_signed or not before or (after[0] == "0" and len(after) > 1)


def _first_sample(kinds, may_be_cut):
    """Return the number of fields of a sample, that of the fields in use, and the first row.

    Fields that are empty in all samples, at the end of the lines, are not in use.
    """
    tail = [row for row in kinds[len(kinds) // 2 :] if row]
    n_fields = Counter(map(len, tail)).most_common(1)[0][0]
    columns = [*zip(*(row for row in tail if len(row) == n_fields), strict=True)]
    usual = [
        Counter(kind or "text" for kind in column).most_common(1)[0][0]
        for column in columns
    ]
    n_filled = max(
        (i + 1 for i, column in enumerate(columns) if any(column)), default=1
    )
    if set(usual) == {"text"}:
        # Without numbers, the first line holds the names.
        return n_fields, n_filled, next(i for i, row in enumerate(kinds) if row) + 1

    def is_usual(row):
        return len(row) == n_fields and all(
            kind in ("", expected) or expected == "text"
            for kind, expected in zip(row, usual, strict=True)
        )

    first = next(i for i, row in enumerate(kinds) if is_usual(row))
    above = kinds[:first]
    headers = [i for i, row in enumerate(above) if row and _is_text(row)]
    headers = headers or [i for i, row in enumerate(above) if "text" in row]
    if headers:
        first = headers[-1] + 1
    elif not may_be_cut:
        # A row of more fields is a preamble. Any other may be a damaged sample: the
        # reader refuses it.
        samples = (i for i, row in enumerate(above) if row and not any(row[n_fields:]))
        first = next(samples, first)
    return n_fields, n_filled, first


def _names_and_units(above, n_fields, n_filled, decimal):
    """Return names, None if there are none, and units, from the rows above the samples."""

    def fitted(fields):
        """Lines of names or of samples may end with separators."""
        if len(fields) < n_filled or any(fields[n_fields:]):
            return None
        return [*fields, *[""] * n_fields][:n_fields]

    names = fitted(above[-1])
    kinds = {_kind(field, decimal) for field in above[-1]}
    if names is None or kinds <= {"number", ""}:
        if len(above[-1]) > 1 and _is_text(kinds):
            raise ContentError(
                f"{len(above[-1])} names for the {n_fields} fields of a sample"
            )
        return None, []
    names_above = fitted(above[-2]) if len(above) > 1 else None
    is_unit = [
        name.strip("[]() ").lower() in _UNITS or name[:1] in ("[", "(")
        for name in names
    ]
    may_be_units = "number" not in kinds and not any(map(names_times, names))
    if names_above is not None and may_be_units and (len(above) == 2 or any(is_unit)):
        return names_above, names
    return names, []


def _names_in_comment(line, separator, n_fields, decimal):
    """Return the names in the last comment, None if it holds something else."""
    ((_, fields),) = split_rows([line.lstrip("#% ")], separator)
    are_numbers = all(is_number(field, decimal) for field in fields)
    return None if are_numbers or len(fields) != n_fields else fields


def _kind(field, decimal):
    if not field:
        return ""
    if is_number(field, decimal):
        return "number"
    return "text" if np.isnan(seconds_of_date(field)) else "date"


def _is_text(kinds):
    return set(kinds) <= {"text", ""}


def split_rows(lines, separator):
    """Yield the number of lines before each row, and its fields; quoted fields may hold lines."""
    if separator == r"\s+":
        yield from ((i, line.split()) for i, line in enumerate(lines))
        return
    reader = csv.reader(lines, delimiter=separator)
    n_before = 0
    for fields in reader:
        yield n_before, [" ".join(field.split("\n")).strip() for field in fields]
        n_before = reader.line_num


def _decode(head):
    encoding = "utf-16" if head.startswith(UTF_16) else "utf-8-sig"
    try:
        # An incremental decoder accepts that the last character was cut.
        return encoding, codecs.getincrementaldecoder(encoding)().decode(head)
    except UnicodeDecodeError:
        return "latin-1", head.decode("latin-1")


def _separator(lines):
    for separator in (";", "\t"):
        if all(separator in line for line in lines):
            return separator
    numbers = [line.split() for line in lines if "," not in line.split()]
    last = numbers[-1] if numbers else []
    if len(last) > 1 and not np.isnan([*map(number, last)]).any():
        return r"\s+"
    return ","
