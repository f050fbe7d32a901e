"""Infer the layout of a text from its first lines: one rule for files, tables and streams."""

import codecs
import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from statistics import mode
from typing import Any

import numpy as np

from .contents import Channel, ContentError
from .facts import (
    MISSING,
    OVERFLOWS,
    distinct,
    is_ambiguous,
    n_decimals,
    parse_number,
    unit_in_name,
)
from .text_header import (
    are_texts,
    kind_of,
    names_and_units,
    stated_rates,
)

#: Lines of the head that are looked at.
_LINES = 400
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: Separator that spreadsheets write into the first line.
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)
#: Share of the last lines in which a sign stands that separates.
_MOST = 0.6
#: Beginnings of lines that are comments, if they do not separate.
_COMMENT_SIGNS = ("#", "%", "!", "//", ";")
#: Number with a decimal comma, or two integers.
_WITH_COMMA = re.compile(r"[+-]?\d*,\d+")
#: The same with signs or zeros that two integers would not have.
_DECIMAL_COMMA = re.compile(r"\+.*|-?,.*|-0+,.*|.*,0\d+")
_INTEGER = re.compile(r"[+-]?\d+")
_AMBIGUOUS = (
    "the comma may separate two columns of integers, or be the decimal sign of one column: write "
    "the names of the columns into the first line, one for each"
)
#: Texts of instruments in place of a number.
_NO_WORDS = {*MISSING, *OVERFLOWS, "err", "error"}


@dataclass(frozen=True)
class TextLayout:
    """Layout of a text.

    Attributes
    ----------
    encoding, separator, decimal : str
        As `pandas.read_csv` takes them.
    thousands : str
        Sign between groups of three digits, as far as the decimal sign shows it, else
        empty.
    has_header : bool
        Whether the columns have names.
    n_head_lines : int
        Lines before the first sample: comments, preamble, names, units.
    channels : dict of str to Channel
        The columns by name, or by position if there is no header.
    kinds : list of str
        Of the columns: number, date, text, or empty if they have no values.
    n_fields : int
        Fields of a sample. There may be one name more, for comments.
    n_rows : int
        Samples in the head.
    advice : str
        Sentence for the reader of a file whose columns are ambiguous, else empty.
    """

    encoding: str
    separator: str
    decimal: str
    thousands: str
    has_header: bool
    n_head_lines: int
    channels: dict[str, Channel]
    kinds: list[str]
    n_fields: int
    n_rows: int
    advice: str


def text_layout(head: bytes, is_whole: bool, *, may_be_cut: bool = False) -> TextLayout:
    r"""Infer the layout of a text from its first bytes.

    Blank lines are skipped everywhere. Lines that begin with ``#``, ``%``, ``!``,
    ``//``, or with a semicolon that does not separate, are comments. Separators are the
    semicolon, the tabulator, the comma, and white space if lines hold nothing but
    numbers. The columns of the last lines are numbers, dates or other texts; the first
    line with the same kinds of fields is the first sample. The lines of texts above it
    hold names and units; all other lines above are a preamble, which may state the
    sampling rate.

    The decimal comma is recognised if the comma does not separate. In lines with one
    comma, it does not if an integer would not be written so (``+23,9168``, ``-0,5``,
    ``7,05``), or if the names above have no comma. A comma or a point before groups of
    three digits separates thousands if the other one is the decimal sign.

    A running stream, which begins anywhere and has no end, passes its first lines with
    `may_be_cut`, and parses what follows `n_head_lines` with the layout.

    Parameters
    ----------
    head : bytes
        The beginning of the text.
    is_whole : bool
        Whether that is the whole text; if not, its last line is ignored.
    may_be_cut : bool, default=False
        Whether the first line may be the end of a line of numbers.

    Returns
    -------
    TextLayout

    Raises
    ------
    ContentError
        If there is no line of text, or if names and samples differ in number.

    Examples
    --------
    >>> layout = text_layout(b"Logger 7\ntime;acc\ns;g\n0,0;1,5\n0,1;-2\n", True)
    >>> layout.separator, layout.decimal, layout.n_head_lines
    (';', ',', 3)
    >>> [(name, channel.unit) for name, channel in layout.channels.items()]
    [('time', 's'), ('acc', 'g')]
    """
    encoding, text = decode(head)
    lines = list(islice(io.StringIO(text, newline=None), _LINES + 1))
    if not is_whole or len(lines) > _LINES:
        lines = lines[:-1]
    separator, advice = _separator(lines)
    if _SEPARATOR_LINE.fullmatch(lines[0]):
        lines[0] = "\n"
    # Comments may hold names and rates.
    texts = [
        line.lstrip("#%!/; ") if _is_comment(line, separator) else line
        for line in lines
    ]
    n_before, rows = zip(*split_rows(texts, separator), strict=True)
    kinds = [[kind_of(text) for text in fields] for fields in rows]
    usual = _usual_kinds(kinds)
    n_fields = len(usual)
    first = _first_sample(rows, kinds, usual, may_be_cut)
    n_above = n_before[first] if first < len(rows) else len(lines)
    samples = [fields for fields in rows[first:] if any(fields)]
    numbers = [
        text
        for fields, of_fields in zip(rows[first:], kinds[first:], strict=True)
        for text, kind in zip(fields, of_fields, strict=True)
        if kind == "number"
    ]
    decimal, thousands = _signs(numbers)
    n_filled = max((i + 1 for i, kind in enumerate(usual) if kind), default=1)
    above = [fields for fields in rows[:first] if fields]
    names, unit_fields = names_and_units(above, n_fields, n_filled)
    has_header = names is not None
    names = distinct(names or [str(i) for i in range(n_fields)])
    # Some instruments state facts in columns next to the samples.
    rates = stated_rates([*above, *samples])
    channels = {}
    units = unit_fields or [unit_in_name(name) or "" for name in names]
    for i, (name, unit) in enumerate(zip_longest(names, units, fillvalue="")):
        n = n_decimals(fields[i] for fields in samples if len(fields) > i)
        last_digit = None if n is None else 10.0**-n
        unit = unit.strip("[]() ") or None
        channels[name] = Channel(rates=rates, unit=unit, last_digit=last_digit)
    return TextLayout(
        encoding,
        separator,
        decimal,
        thousands,
        has_header,
        n_head_lines=n_above,
        channels=channels,
        kinds=[*usual, *[""] * (len(names) - n_fields)],
        n_fields=n_fields,
        n_rows=len(samples),
        advice="" if has_header else advice,
    )


def n_sample_lines(lines: Sequence[str], layout: TextLayout) -> int:
    r"""Return how many of the last lines of a text come before its footer.

    Lines after the last sample are a footer if they begin with a word or a comment.
    Others are damaged samples.

    Examples
    --------
    >>> layout = text_layout(b"time,acc\n0.0,1.5\n0.1,-2\n", True)
    >>> n_sample_lines(["0.1,-2\n", "\n", "Maximum,1.5\n"], layout)
    1
    """
    rows = [_fields(line, layout.separator) for line in lines]
    usual = layout.kinds[: layout.n_fields]
    end = len(rows)
    while end and not _is_sample([*map(kind_of, rows[end - 1])], usual):
        end -= 1
    first = next((i for i in range(end, len(rows)) if any(rows[i])), None)
    if first is None:
        return end
    is_footer = _is_word(rows[first][0]) or _is_comment(lines[first], layout.separator)
    return end if is_footer else len(lines)


def _is_word(text):
    """Return whether a field begins a remark or a line of signs, and is no missing number."""
    is_one = re.match(r"[^\d\W]{2}|[-=*_]{2}", text)
    return bool(is_one) and text.lower() not in _NO_WORDS


def _is_sample(kinds, usual):
    """Return whether the fields of a line have the usual kinds, and one is a number."""
    is_usual = [
        kind in ("", expected) or expected == "text"
        for kind, expected in zip(kinds, usual, strict=False)
    ]
    return len(kinds) >= len(usual) and all(is_usual) and not are_texts(kinds)


def _is_comment(line, separator):
    signs = tuple(sign for sign in _COMMENT_SIGNS if sign != separator)
    return line.lstrip(' "').startswith(signs)


def _separator(lines):
    """Return the separator, and advice if it is a comma that may be the decimal sign."""
    if lines and (stated := _SEPARATOR_LINE.fullmatch(lines[0])):
        return stated[1], ""
    filled = [line for line in lines if line.strip() and not _is_comment(line, ";")]
    if not filled:
        raise ContentError("No columns to parse: the file holds no line of text")
    last = filled[len(filled) // 2 :][-20:]
    for separator in (";", "\t"):
        if sum(separator in line for line in last) > _MOST * len(last):
            return separator, ""
    words = [line.split() for line in last]
    are_numbers = [
        len(w) > 1 and not np.isnan([*map(parse_number, w)]).any() for w in words
    ]
    if sum(are_numbers) > _MOST * len(last):
        return r"\s+", ""
    texts = [line.strip().strip('"') for line in filled if not _is_comment(line, ",")]
    with_comma = [bool(_WITH_COMMA.fullmatch(text)) for text in texts]
    first = with_comma.index(True) if any(with_comma) else len(texts)
    others = [text for text in texts[first:] if not _WITH_COMMA.fullmatch(text)]
    if first == len(texts) or not all(map(_INTEGER.fullmatch, others)):
        return ",", ""
    is_decimal = any(map(_DECIMAL_COMMA.fullmatch, texts[first:]))
    if first > 0:
        is_decimal = "," not in texts[first - 1]
    # None of the lines has a semicolon: each is one field.
    return (";", "") if is_decimal else (",", _AMBIGUOUS)


def _usual_kinds(kinds):
    """Return the most frequent kinds of the fields of a sample."""
    tail = [row for row in kinds[len(kinds) // 2 :] if any(row)]
    n_fields = mode(map(len, tail))
    columns = zip(*(row for row in tail if len(row) == n_fields), strict=True)
    return [mode([kind for kind in column if kind] or [""]) for column in columns]


def _first_sample(rows, kinds, usual, may_be_cut):
    """Return the number of rows above the first sample."""
    filled = [i for i, fields in enumerate(rows) if any(fields)]
    if are_texts(usual):
        # Without numbers, the first line holds the names.
        return filled[0] + 1
    is_sample = [len(row) == len(usual) and _is_sample(row, usual) for row in kinds]
    first = is_sample.index(True)
    # Comments may stand in a column that is empty otherwise.
    lenient = [kind or "text" for kind in usual]
    above = [i for i in filled if i < first]
    others = [i for i in above if not _is_sample(kinds[i], lenient)]
    heads = [i for i in others if are_texts(kinds[i]) or _is_word(rows[i][0])]
    heads = heads or [i for i in others if "text" in kinds[i]]
    if heads:
        # Blank lines after the names belong to the head.
        return next(i for i in filled if i > heads[-1])
    if may_be_cut:
        return first
    # A row of more fields is a preamble. Any other may be a damaged sample: the reader
    # refuses it.
    return next((i for i in above if not any(rows[i][len(usual) :])), first)


def _signs(numbers):
    """Return the decimal sign, and the sign of thousands, empty if neither is shown."""
    shown = {*map(_decimal_sign, numbers)} - {None}
    if len(shown) == 1:
        (decimal,) = shown
        return decimal, ",.".replace(decimal, "")
    return "," if any("," in text for text in numbers) else ".", ""


def _decimal_sign(text):
    """Return the decimal sign that a number shows, None if it shows none."""
    signs = re.findall("[.,]", text)
    if not signs or is_ambiguous(text):
        return None
    if len(signs) == 1 or signs[0] != signs[-1]:
        return signs[-1]
    # Several equal signs separate thousands.
    return "." if signs[0] == "," else ","


def _fields(line, separator):
    ((_, fields),) = split_rows([line], separator)
    return fields or [""]


def split_rows(lines: Any, separator: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number of lines before each row, and its fields; quoted fields may hold lines."""
    if separator == r"\s+":
        yield from ((i, line.split()) for i, line in enumerate(lines))
        return
    reader = csv.reader(lines, delimiter=separator)
    n_before = 0
    try:
        for fields in reader:
            texts = [" ".join(text.split("\n")).strip() for text in fields]
            yield n_before, texts if any(texts) or len(texts) > 1 else []
            n_before = reader.line_num
    except csv.Error as error:
        raise ContentError(
            f"a field has more than {csv.field_size_limit()} characters; is a quote "
            "or a separator missing?"
        ) from error


def decode(head: bytes) -> tuple[str, str]:
    """Return the encoding of a text, and the text; its last character may be cut."""
    encodings = ["utf-16" if head.startswith(UTF_16) else "utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            return encoding, codecs.getincrementaldecoder(encoding)().decode(head)
        except UnicodeDecodeError:
            continue
    return "latin-1", head.decode("latin-1")
