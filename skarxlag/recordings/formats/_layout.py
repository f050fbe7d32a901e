"""Layout of a text file: its separator, decimal sign, names and units, told from its head."""

import csv
import re
from dataclasses import dataclass
from typing import Any

from ._contents import ContentError

#: Lines from which the layout is told.
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
        Of the columns; their positions where there is no header.
    units : dict of str to str
        By column, where stated.
    """

    encoding: str
    separator: str
    decimal: str
    has_header: bool
    n_head_lines: int
    names: list[Any]
    units: dict[str, Any]


def text_layout(head: bytes, is_whole: bool) -> TextLayout:
    r"""Tell the layout of a text file from its first bytes.

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
