"""Infer the layout of a text from its first lines: one rule for files, tables and streams."""

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Any

import numpy as np

from .contents import ContentError
from .facts import (
    MISSING,
    SECONDS,
    UNITS,
    all_letters,
    distinct,
    is_ambiguous,
    is_number,
    meanings,
    names_times,
    number,
    seconds_of_date,
    seconds_of_day,
    stated_rate,
    unit_in_name,
)

#: Lines of the head that are looked at.
_LINES = 400
#: Lines of a stream that determine its layout, at least and at most.
_STREAM_LINES = (4, 200)
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
#: Separator that spreadsheets write into the first line.
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?\s*', re.IGNORECASE)
#: Beginnings of lines that are comments, if they do not separate.
_COMMENT_SIGNS = ("#", "%", "!", "//", ";")
#: First fields of a line of names that are no name.
_NAME_TAGS = ("header", "headers", "names", "columns", "fields", "channels")
#: Number with a decimal comma, or two integers: sign, digits before the comma, digits
#: after it.
_WITH_COMMA = re.compile(r"([+-]?)(\d*),(\d+)")
_INTEGER = re.compile(r"[+-]?\d+")
#: Name and value in one field of the head, as in ``Rate: 2000 Hz``.
_NAME_AND_VALUE = re.compile(r"\s*([^:=]+?)\s*[:=]\s*(\S+)\s*(\S*)")
#: Decimals at the end of a number or of a time of day.
_DECIMALS = re.compile(r"\d(?:[.,](\d+))?(?: [AP]M|Z)?$")
#: Texts of instruments in place of a number.
_OVERFLOWS = ("ol", "over", "overflow", "overload", "err", "error", "inf", "fail")
#: Roles of the comma in lines that hold one comma each.
_SEPARATOR = "separator"
_DECIMAL = "decimal sign"
_UNCLEAR = "either"
_AMBIGUOUS = (
    "the comma may separate two columns of integers, or be the decimal sign of one column: write "
    "the names of the columns into the first line, one for each"
)


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
    n_ignored : int
        Lines of the preamble: lines before the names that are not comments.
    names : list of str
        Of the columns; their positions if there is no header.
    kinds : list of str
        Of the columns: number, date, text, or empty if they have no values.
    units : dict of str to str
        By column, if stated.
    n_fields : int
        Fields of a sample. There may be one name more, for comments.
    n_rows : int
        Samples in the head.
    skips_blank : bool
        Whether blank lines are no samples. In a text of one column, a blank line is a
        missing value, unless one follows each sample.
    last_digits : dict of str to float
        By column, the value of the last written decimal, if all samples of the head
        have equally many.
    rates : dict of str to float
        Sampling rates in Hz that lines of the head state, by their names.
    advice : str
        Sentence for the reader of a file whose columns are ambiguous, else empty.
    """

    encoding: str
    separator: str
    decimal: str
    thousands: str
    has_header: bool
    n_head_lines: int
    n_ignored: int
    names: list[str]
    kinds: list[str]
    units: dict[str, str]
    n_fields: int
    n_rows: int
    skips_blank: bool
    last_digits: dict[str, float]
    rates: dict[str, float] = field(default_factory=dict)
    advice: str = ""


def text_layout(head: bytes, is_whole: bool, *, may_be_cut: bool = False) -> TextLayout:
    r"""Infer the layout of a text from its first bytes.

    Blank lines are skipped everywhere. Lines that begin with ``#``, ``%``, ``!``,
    ``//``, or with a semicolon that does not separate, are comments. Separators are the
    semicolon, the tabulator, the comma, and white space if a line holds nothing but
    numbers. The columns of the last lines are numbers, dates or other texts; the first
    line with the same kinds of fields is the first sample. The lines of texts above it
    hold names and units; all other lines above are a preamble, which may state the
    sampling rate.

    The decimal comma is recognised if the comma does not separate. In lines with one
    comma, it does not if an integer would not be written so (``+23,9168``, ``-0,5``,
    ``7,05``), or if the names above have no comma. A comma or a point before groups of
    three digits separates thousands if the other one is the decimal sign.

    A running stream, which begins anywhere and has no end, passes its first
    `stream_head` lines with `may_be_cut`, and parses what follows `n_head_lines` with
    the layout.

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
        If there is no line of text, if names and samples differ in number, or if a sign
        may separate thousands or decimals. The message quotes the field and its line.

    Examples
    --------
    >>> layout = text_layout(b"Logger 7\ntime;acc\ns;g\n0,0;1,5\n0,1;-2\n", True)
    >>> layout.separator, layout.decimal, layout.names, layout.units, layout.n_head_lines
    (';', ',', ['time', 'acc'], {'time': 's', 'acc': 'g'}, 3)
    """
    encoding, text = decode(head)
    lines = list(islice(io.StringIO(text, newline=None), _LINES + 1))
    if not is_whole or len(lines) > _LINES:
        lines = lines[:-1]
    body, comments, separator, comma = _split_comments(lines)
    n_lines_before, rows = zip(*split_rows(body, separator), strict=True)
    kinds = [[_kind(text) for text in fields] for fields in rows]
    n_fields, usual, first = _first_sample(kinds, may_be_cut)
    n_above = n_lines_before[first] if first < len(rows) else len(body)
    samples = {
        n_before + 1: fields
        for n_before, fields in zip(n_lines_before[first:], rows[first:], strict=True)
        if any(fields)
    }
    n_blank = max(samples, default=0) - min(samples, default=1) + 1 - len(samples)
    decimal, thousands = _signs(samples, n_fields)
    above = [fields for fields in rows[:first] if fields]
    n_filled = max((i + 1 for i, kind in enumerate(usual) if kind), default=1)
    names, unit_line, n_header = _header(above, n_fields, n_filled)
    comments = [_fields(line, separator) for i, line in comments.items() if i < n_above]
    if not above and comments:
        names = _names_of(comments[-1], n_fields, n_filled, is_tagged=True)
    has_header = names is not None
    names = distinct(names) if has_header else [str(i) for i in range(n_fields)]
    unit_fields = unit_line or [unit_in_name(name) or "" for name in names]
    units = [text.strip("[]() ") for text in unit_fields]
    return TextLayout(
        encoding,
        separator,
        decimal,
        thousands,
        has_header,
        n_head_lines=n_above,
        n_ignored=len(above) - n_header,
        names=names,
        kinds=[*usual, *[""] * (len(names) - n_fields)],
        units={name: unit for name, unit in zip(names, units, strict=False) if unit},
        n_fields=n_fields,
        n_rows=len(samples),
        skips_blank=n_fields > 1 or n_blank > max(0.9 * len(samples) - 2, 3),
        last_digits={
            name: 10.0**-n
            for i, name in enumerate(names[:n_fields])
            if (n := _n_decimals([*samples.values()], i)) is not None
        },
        rates=_stated_rates([*comments, *above[: len(above) - n_header]]),
        advice=_AMBIGUOUS if comma == _UNCLEAR and not has_header else "",
    )


def stream_head(lines: Sequence[str]) -> int | None:
    """Return how many of the first lines determine the layout of a stream.

    Parameters
    ----------
    lines : sequence of str
        The whole lines that have arrived.

    Returns
    -------
    int or None
        Lines up to the second of two samples, that is, lines of as many numbers. At
        least four filled lines, because of names and units, and at most 200. None if
        more lines are needed. The result does not depend on how many lines follow.

    Examples
    --------
    >>> banner = ["boot: 1", "", "sensor found", "ax,ay"]
    >>> stream_head(banner), stream_head([*banner, "0.5,1", "1,2", "3,4"])
    (None, 6)
    """
    n_before = 0
    n_filled = 0
    for i, line in enumerate(lines):
        texts = [text for text in re.split(r"[;,\s]+", line) if text.strip('"')]
        if not texts or line[:1] in "#%":
            continue
        n_filled += 1
        are_numbers = {_kind(text.strip('"')) for text in texts} <= {"number", "date"}
        is_second = are_numbers and len(texts) == n_before
        n_before = len(texts) if are_numbers else 0
        if n_filled >= _STREAM_LINES[0] and (is_second or i + 1 >= _STREAM_LINES[1]):
            return i + 1
    return None


def footer_start(tail: str, layout: TextLayout) -> int:
    r"""Return where the lines begin that follow the last sample and are none.

    Parameters
    ----------
    tail : str
        The end of the text, from the beginning of a line.
    layout : TextLayout
        Of the text.

    Returns
    -------
    int
        Position in `tail`. It is the end if the lines after the last sample do not
        begin with a word or a comment: these are damaged samples.

    Examples
    --------
    >>> layout = text_layout(b"time,acc\n0.0,1.5\n0.1,-2\n", True)
    >>> tail = "0.1,-2\n\nMaximum,1.5\n"
    >>> tail[: footer_start(tail, layout)]
    '0.1,-2\n'
    """
    lines = tail.splitlines(keepends=True)
    n_samples = len(lines)
    while n_samples and not _is_sample(_fields(lines[n_samples - 1], layout.separator)):
        n_samples -= 1
    after = [line for line in lines[n_samples:] if line.strip()]
    if not after:
        return len("".join(lines[:n_samples]))
    is_footer = _is_comment(after[0], layout.separator) or re.match(
        r"[^\d\W]{2}|[-=*_]{2}", after[0].strip(' "' + layout.separator)
    )
    if is_footer and not _is_missing(after[0], layout.separator):
        return len("".join(lines[:n_samples]))
    return len(tail)


def _is_sample(fields):
    kinds = [_kind(text) for text in fields]
    return bool(kinds) and kinds[0] in ("number", "date") and "number" in kinds[-2:]


def _is_missing(line, separator):
    return _fields(line, separator)[0].lower() in {*MISSING, *_OVERFLOWS}


def _split_comments(lines):
    """Return the lines, with comments as blank lines; the comments; separator; and comma."""
    stated = _SEPARATOR_LINE.fullmatch(lines[0]) if lines else None
    if stated:
        lines = ["\n", *lines[1:]]
    filled = [line for line in lines if line.strip() and not _is_comment(line, ";")]
    if not filled:
        raise ContentError("No columns to parse: the file holds no line of text")
    comma = None
    separator = stated[1] if stated else _separator(filled[len(filled) // 2 :][-20:])
    if separator == "," and not stated:
        comma = _role_of_comma([line for line in filled if not _is_comment(line, ",")])
    if comma == _DECIMAL:
        # None of the lines has a semicolon: each is one field.
        separator = ";"
    comments = {i: line for i, line in enumerate(lines) if _is_comment(line, separator)}
    body = ["\n" if i in comments else line for i, line in enumerate(lines)]
    texts = {i: line.lstrip("#%!/; ") for i, line in comments.items()}
    return body, texts, separator, comma


def _is_comment(line, separator):
    signs = tuple(sign for sign in _COMMENT_SIGNS if sign != separator)
    return line.lstrip(' "').startswith(signs)


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
    """Return the number of fields of a sample, the usual kinds, and the first row."""
    tail = [row for row in kinds[len(kinds) // 2 :] if any(row)]
    n_fields = Counter(map(len, tail)).most_common(1)[0][0]
    columns = [*zip(*(row for row in tail if len(row) == n_fields), strict=True)]
    filled = [[kind for kind in column if kind] or [""] for column in columns]
    usual = [Counter(column).most_common(1)[0][0] for column in filled]
    if set(usual) <= {"text", ""}:
        # Without numbers, the first line holds the names.
        return n_fields, usual, next(i for i, row in enumerate(kinds) if row) + 1

    def is_usual(row):
        return len(row) == n_fields and all(
            kind in ("", expected) or expected in ("text", "")
            for kind, expected in zip(row, usual, strict=True)
        )

    first = next(i for i, row in enumerate(kinds) if is_usual(row) and any(row))
    above = kinds[:first]
    headers = [i for i, row in enumerate(above) if row and _is_text(row)]
    headers = headers or [i for i, row in enumerate(above) if "text" in row]
    if headers:
        first = headers[-1] + 1
        # Blank lines after the names belong to the head.
        first = next((i for i in range(first, len(kinds)) if kinds[i]), first)
    elif not may_be_cut:
        # A row of more fields is a preamble. Any other may be a damaged sample: the
        # reader refuses it.
        samples = (i for i, row in enumerate(above) if row and not any(row[n_fields:]))
        first = next(samples, first)
    return n_fields, usual, first


def _header(above, n_fields, n_filled):
    """Return names, None if there are none; units; and the number of lines with them."""
    n_texts = 0
    while n_texts < len(above) and _may_be_names(above[-1 - n_texts]):
        n_texts += 1
    header = above[len(above) - n_texts :]
    fitted = [_names_of(fields, n_fields, n_filled) for fields in header]
    if not header or fitted[-1] is None:
        last = above[-1] if above else []
        if len(last) > 1 and _is_text(map(_kind, last)):
            raise ContentError(
                f"{len(last)} names for the {n_fields} fields of a sample"
            )
        names = last and _names_of(last, n_fields, n_filled)
        has_names = names and {*map(_kind, last)} > {"number"}
        return (names, [], 1) if has_names else (None, [], 0)
    above_header = above[len(above) - n_texts - 1] if n_texts < len(above) else []
    names = _names_of(above_header, n_fields, n_filled)
    if names and _are_units(fitted[0]) and all_letters(header[0][0]) in SECONDS:
        # Names of an oscilloscope may be numbers, if the unit of the first is of time.
        return names, fitted[0], n_texts + 1
    pairs = [(i, fitted[i - 1], fitted[i]) for i in range(1, len(header))]
    for i, names, units in pairs:
        if names and units and _are_units(units):
            return names, units, len(header) - i + 1
    if pairs and pairs[-1][1] and _may_be_units(fitted[-1], len(above) == 2):
        return pairs[-1][1], fitted[-1], 2
    return fitted[-1], [], 1


def _may_be_names(fields):
    """Return whether a line above the samples holds no number, and states no value."""
    is_value = len(fields) == 1 and _NAME_AND_VALUE.fullmatch(fields[0])
    return not is_value and "number" not in map(_kind, fields)


def _are_units(fields):
    """Return whether all fields are units, or in brackets."""
    return bool(fields) and all(_is_unit(text) for text in fields if text)


def _may_be_units(fields, is_second_of_two):
    """Return whether the last line below a line of names may hold their units."""
    if any(map(names_times, fields)):
        return False
    return is_second_of_two or any(map(_is_unit, fields))


def _is_unit(text):
    return text.strip("[]() ").lower() in UNITS or text[:1] in ("[", "(")


def _names_of(fields, n_fields, n_filled, is_tagged=False):
    """Return the names of the columns in a line, None if their number does not fit.

    Lines of names and of samples may end with separators. The names may follow a tag,
    and one for comments may come last.
    """
    if len(fields) == n_fields + 1 and _is_text(map(_kind, fields)):
        if is_tagged or all_letters(fields[0]) in _NAME_TAGS:
            return fields[1:]
        return fields
    is_short = len(fields) < max(n_fields if is_tagged else n_filled, 1)
    are_numbers = {*map(_kind, fields)} <= {"number", ""}
    if is_short or any(fields[n_fields:]) or are_numbers:
        return None
    return [*fields, *[""] * n_fields][:n_fields]


def _stated_rates(rows) -> dict[str, float]:
    """Return the sampling rates that lines of the head state, by their names."""
    rates = {}
    for fields in rows:
        match = _NAME_AND_VALUE.fullmatch(" ".join(fields[:3]))
        parts = [*fields, "", ""][:3]
        if number(parts[1]) != number(parts[1]) and match:
            parts = list(match.groups())
        name, text, unit = parts
        # Values of further channels follow that of the first.
        unit = unit_in_name(name) or (unit if unit.strip(" []()").isalpha() else "")
        value = number(text)
        if np.isfinite(value) and value > 0:
            unit = unit.strip(" []()").lower() or None
            plain = all_letters(re.split(r"[(\[]", name)[0])
            if rate := stated_rate(plain, value, unit):
                rates[name.strip()] = rate
    return rates


def _signs(samples, n_fields):
    """Return the decimal sign, and the sign of thousands, empty if neither is shown."""
    columns: list[dict[int, str]] = [{} for _ in range(n_fields)]
    for line, fields in samples.items():
        for column, text in zip(columns, fields, strict=False):
            if _kind(text) == "number":
                column[line] = text
    texts = chain.from_iterable(column.values() for column in columns)
    decimals = {sign for sign in map(_decimal_sign, texts) if sign}
    if decimals:
        decimal = "," if "," in decimals else "."
        others = ",." if len(decimals) == 1 else ""
        return decimal, others.replace(decimal, "")
    decimal = "."
    for column in columns:
        like = {line: text for line, text in column.items() if is_ambiguous(text)}
        integers = [text for line, text in column.items() if line not in like]
        is_short = all(len(text.strip("+-")) < 4 for text in integers)
        if like and integers and is_short:
            line, text = next(iter(like.items()))
            raise ContentError(f"line {line}: the value is {meanings(text)}")
        if any("," in text for text in like.values()):
            decimal = ","
    return decimal, ""


def _n_decimals(rows, i):
    """Return how many decimals a column has in all rows, None if they differ."""
    texts = [fields[i] for fields in rows if len(fields) > i and fields[i]]
    matches = [_DECIMALS.search(text) for text in texts]
    counts = {len(match[1] or "") if match else None for match in matches}
    return counts.pop() if len(counts) == 1 else None


def _decimal_sign(text):
    """Return the decimal sign that a number shows, None if it shows none."""
    signs = re.findall("[.,]", text)
    if not signs or is_ambiguous(text):
        return None
    if len(signs) == 1 or signs[0] != signs[-1]:
        return signs[-1]
    # Several equal signs separate thousands.
    return "." if signs[0] == "," else ","


def _kind(text):
    if not text:
        return ""
    if (
        is_number(text, ",")
        or is_number(text, ".")
        or is_number(text.replace(",", ""), ".")
    ):
        return "number"
    seconds = seconds_of_date(text)
    return "text" if np.isnan(seconds) and np.isnan(seconds_of_day(text)) else "date"


def _is_text(kinds):
    return {*kinds} <= {"text", ""}


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


def _separator(lines):
    for separator in (";", "\t"):
        if sum(separator in line for line in lines) > 0.6 * len(lines):
            return separator
    numbers = [line.split() for line in lines if "," not in line.split()]
    last = numbers[-1] if numbers else []
    if len(last) > 1 and not np.isnan([*map(number, last)]).any():
        return r"\s+"
    return ","
