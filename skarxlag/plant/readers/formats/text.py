"""Text with a column for each channel, which is read in parts."""

import gzip
import io
import warnings
from collections.abc import Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path

import numpy as np

from .arrays import NamedArrays
from .contents import (
    ContentError,
    Contents,
    DamagedError,
    Format,
    check_unpacked,
    slices,
)
from .facts import (
    MISSING,
    OVERFLOW,
    OVERFLOWS,
    is_ambiguous,
    letters,
    meanings,
    parse_number,
)
from .text_layout import UTF_16, n_sample_lines, split_rows, text_layout

FORMAT = Format(
    (".csv", ".txt", ".tsv", ".dat", ".lvm", ".csv.gz", ".txt.gz", ".tsv.gz")
)

#: Bytes from which the layout is inferred, and bytes in which their first line must
#: end.
_HEAD = 2**16
_LONGEST_LINE = 2**26
#: Lines that are parsed at a time, and lines in which a footer begins.
_LINES = 2**16
_FOOTER = 400
#: Numbers in a line from which few lines are channels rather than samples.
_FEWEST_SAMPLES = 50


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by the names in the header, ``0``, ``1``, ... if there is none.

    If dates and times of day are in two columns, both hold both together. Fewer lines
    of numbers than there are numbers in a line are the channels themselves.
    """
    is_packed = path.suffix.lower() == ".gz"
    with _Bounded(path, "rb") if is_packed else path.open("rb") as file:
        yield _contents_of(file)


class _Bounded(gzip.GzipFile):
    """A packed text that is unpacked while it is read, up to the bound for its file."""

    def read1(self, size=-1):
        check_unpacked(Path(self.name).stat().st_size, self.tell())
        return super().read1(size)


def _contents_of(file):
    head = file.read(_HEAD)
    if b"\0" in head and not head.startswith(UTF_16):
        raise ContentError("holds no text; raw samples need their dtype, such as '<i2'")
    while (
        b"\n" not in head and len(head) < _LONGEST_LINE and (part := file.read(_HEAD))
    ):
        head += part
    is_whole = not file.read(1)
    layout = text_layout(head, is_whole)
    if next(iter(layout.channels)).strip().lower() == "path":
        raise ContentError(
            "this is a table of recordings, expected samples; --table takes it"
        )
    is_wide = layout.n_rows < layout.n_fields and layout.n_fields >= _FEWEST_SAMPLES
    if is_whole and is_wide and not layout.has_header:
        samples = next(_blocks(file, layout)).frame().to_numpy(dtype=float)
        arrays = NamedArrays(lambda _: samples)
        arrays.add("", samples.shape)
        return arrays.contents()

    def read(names, n_samples):
        blocks = (block.columns(names) for block in _blocks(file, layout))
        if n_samples is None and (whole := [*zip(*blocks, strict=True)]):
            blocks = [[*map(np.concatenate, whole)]]
        for columns in blocks:
            for part in slices(len(columns[0]), n_samples):
                yield [column[part] for column in columns]

    n_channels = max((i + 1 for i, kind in enumerate(layout.kinds) if kind), default=1)
    channels = dict(islice(layout.channels.items(), n_channels))
    return Contents(channels, read, advice=layout.advice)


def _date_columns(names, row):
    """Return the columns of the date and of the time of day, or none if they are not two.

    >>> _date_columns(["Zeit", "acc", "Datum"], {"Zeit": "07:00:00", "Datum": "22.11.26"})
    ['Datum', 'Zeit']
    """
    parts = [name for name in names if letters(name) in ("date", "datum")]
    parts += [name for name in names if letters(name) in ("time", "zeit", "uhrzeit")]
    return parts if [":" in str(row[name]) for name in parts] == [False, True] else []


def _blocks(file, layout):
    """Yield the lines after the head of an open file, without its footer."""
    file.seek(0)
    # Letters of another encoding may follow, as in a comment.
    text = io.TextIOWrapper(file, layout.encoding, errors="replace")
    try:
        n_before = len([*islice(text, layout.n_head_lines)])
        lines = [*islice(text, _LINES)]
        while lines:
            following = [*islice(text, _LINES)]
            if len(following) < _FOOTER:
                lines += following
                following = []
                start = max(len(lines) - _FOOTER, 0)
                del lines[start + n_sample_lines(lines[start:], layout) :]
            yield _Block(lines, n_before, layout)
            n_before += len(lines)
            lines = following
    finally:
        # The file stays open, to be read once more, or is closed after an error.
        with suppress(ValueError):
            text.detach()


class _Block:
    """Lines of samples, and their columns. A row that lacks a field is refused."""

    def __init__(self, lines, n_before, layout):
        self._layout = layout
        self._names = list(layout.channels)
        self._lines = lines
        self._n_before = n_before

    def columns(self, names):
        """Return the values of some columns."""
        frame = self.frame()
        parts = _date_columns(self._names, frame.iloc[0]) if len(frame) else []
        if {*parts} & {*names}:
            date, clock = (frame[part].astype(str) for part in parts)
            frame = frame.assign(**dict.fromkeys(parts, date + " " + clock))
        return [self._values(frame[name]) for name in names]

    def frame(self):
        """Return the values of all columns."""
        import pandas as pd

        layout = self._layout
        options = {
            "sep": layout.separator,
            "decimal": layout.decimal,
            "names": self._names,
            "header": None,
            "index_col": False,
            # In a text of one column, a blank line is a missing value.
            "skip_blank_lines": layout.n_fields > 1,
            "low_memory": False,
        }
        with warnings.catch_warnings():
            # Surplus fields of the first row would be dropped.
            warnings.simplefilter("error", pd.errors.ParserWarning)
            try:
                frame = pd.read_csv(io.StringIO("".join(self._lines)), **options)
            except pd.errors.EmptyDataError:
                return pd.DataFrame(columns=self._names, dtype=float)
            except (pd.errors.ParserError, pd.errors.ParserWarning) as error:
                self._check_fields()
                raise DamagedError("the lines are no csv") from error
        # pandas fills a short row at its end, which may shift its values.
        if frame.iloc[:, layout.n_fields - 1].isna().any():
            self._check_fields()
        return frame

    def _rows(self):
        """Yield the number and the fields of each line of samples."""
        for n_before, fields in split_rows(self._lines, self._layout.separator):
            if fields or self._layout.n_fields == 1:
                yield self._n_before + n_before + 1, fields

    def _check_fields(self):
        """Refuse a row that lacks a field, or has more than the others."""
        n_fields = self._layout.n_fields
        for line, fields in self._rows():
            if any(fields[len(self._names) :]) or len(fields) < n_fields > 1:
                raise ContentError(
                    f"line {line} has {len(fields)} fields, expected {n_fields}; "
                    "complete or remove it"
                )

    def _values(self, column):
        """Return the values of a column, of which texts may be numbers in another form."""
        from pandas.api.types import is_numeric_dtype

        values = column.to_numpy()
        name = column.name
        is_of_numbers = self._layout.kinds[self._names.index(name)] == "number"
        if not is_numeric_dtype(column) and is_of_numbers:
            # One field that is no number makes texts of all others.
            values = self._parsed(column)
        if values.dtype.kind == "f" and not self._layout.thousands:
            # 1.234 among integers below 1000 may be 1234, if no number shows the sign.
            parts, _ = np.modf(values)
            fractions = np.flatnonzero(np.abs(parts) > 0)
            thousands = 1000 * np.abs(values[fractions])
            are_groups = np.abs(thousands - thousands.round()) < 1e-6
            is_small = np.abs(values[parts == 0]) < 1000
            is_unclear = len(fractions) and len(is_small) and is_small.all()
            if is_unclear and np.all(are_groups & (thousands >= 1000)):
                self._refuse(fractions[0], name)
        return values

    def _parsed(self, column):
        """Return the numbers in texts."""
        signs = self._layout.decimal, self._layout.thousands
        texts = column.astype(object).where(column.notna(), "").map(str).tolist()
        numbers = np.array([parse_number(text, *signs) for text in texts])
        for k in np.flatnonzero(np.isnan(numbers)):
            word = texts[k].strip().lower()
            if word in OVERFLOWS:
                numbers[k] = OVERFLOW
            elif word not in MISSING:
                self._refuse(k, column.name)
        return numbers

    def _refuse(self, row, name):
        """Raise an error that quotes a field and its line."""
        line, fields = next(islice(self._rows(), int(row), None))
        text = fields[self._names.index(name)]
        problem = f"{text!r:.80} in column {name!r} is no number"
        if is_ambiguous(text):
            problem = f"the value is {meanings(text)}"
        raise ContentError(f"line {line}: {problem}")
