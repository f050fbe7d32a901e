"""Text with a column for each channel."""

import gzip
import io
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from .arrays import NamedArrays
from .contents import (
    Channel,
    ContentError,
    Contents,
    DamagedError,
    Format,
    agreed_rate,
    check_unpacked,
)
from .facts import MISSING, is_ambiguous, letters, meanings, number
from .text_layout import UTF_16, TextLayout, footer_start, split_rows, text_layout

FORMAT = Format(
    (".csv", ".txt", ".tsv", ".dat", ".lvm", ".csv.gz", ".txt.gz", ".tsv.gz")
)

#: Bytes from which the layout is inferred, and bytes in which their first line must
#: end.
_HEAD = 2**16
_LONGEST_LINE = 2**26
#: Characters that are read at a time, and characters in which a footer begins.
_PART = 2**20
_FOOTER = 2**14
#: Numbers in a line from which few lines are channels rather than samples.
_FEWEST_SAMPLES = 50


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by the names in the header, ``0``, ``1``, ... if there is none.

    If dates and times of day are in two columns, both hold both together. Fewer lines
    of numbers than there are numbers in a line are the channels themselves.
    """
    with _open(path) as file:
        yield _contents_of(file, path)


def _contents_of(file, path):
    head = file.read(_HEAD)
    if b"\0" in head and not head.startswith(UTF_16):
        raise ContentError("holds no text; raw samples need their dtype, such as '<i2'")
    while (
        b"\n" not in head and len(head) < _LONGEST_LINE and (part := file.read(_PART))
    ):
        head += part
    is_whole = not file.read(1)
    layout = text_layout(head, is_whole)
    if layout.names[0].strip().lower() == "path":
        raise ContentError(
            "this is a table of recordings, expected samples; --table takes it"
        )
    text = _Text(file, path, layout)
    is_wide = layout.n_rows < layout.n_fields and layout.n_fields >= _FEWEST_SAMPLES
    if is_whole and is_wide and not layout.has_header:
        return _rows_as_channels(text)

    def read(names, n_samples):
        start = 0
        for frame in text.frames(n_samples or sys.maxsize):
            parts = date_columns(layout.names, frame.iloc[0]) if len(frame) else []
            if {*parts} & {*names}:
                date, clock = (frame[part].astype(str) for part in parts)
                frame = frame.assign(**dict.fromkeys(parts, date + " " + clock))
            yield [text.values(frame[name], start) for name in names]
            start += len(frame)

    n_channels = max((i + 1 for i, kind in enumerate(layout.kinds) if kind), default=1)
    rate, contradiction = agreed_rate(layout.rates)
    channels = {
        name: Channel(
            sampling_rate=rate,
            unit=layout.units.get(name),
            contradiction=contradiction,
            last_digit=layout.last_digits.get(name),
        )
        for name in layout.names[:n_channels]
    }
    return Contents(channels, read, advice=layout.advice)


def _rows_as_channels(text):
    """Return the channels of a text that has a line for each of them."""
    frame = next(text.frames(sys.maxsize))
    columns = [text.values(frame[name], 0) for name in text.layout.names]
    arrays = NamedArrays(lambda _: np.stack(columns))
    arrays.add("", (len(columns), len(frame)))
    return arrays.contents()


def date_columns(names: list[str], row: Mapping[str, object]) -> list[str]:
    """Return the columns of the date and of the time of day, or none if they are not two.

    >>> date_columns(["Zeit", "acc", "Datum"], {"Zeit": "07:00:00", "Datum": "22.11.26"})
    ['Datum', 'Zeit']
    """
    parts = [name for name in names if letters(name) in ("date", "datum")]
    parts += [name for name in names if letters(name) in ("time", "zeit", "uhrzeit")]
    return parts if [":" in str(row[name]) for name in parts] == [False, True] else []


class _Text:
    """Samples of a text: the lines after its head and before a footer.

    Parameters
    ----------
    file : binary file
        It stays open, to be read once more.
    path : Path
        Its path, to find the line of an error.
    layout : TextLayout
        Its layout.
    """

    def __init__(self, file: Any, path: Path, layout: TextLayout) -> None:
        self.layout = layout
        self._file = file
        self._path = path

    def frames(self, n_rows: int) -> Iterator[Any]:
        """Yield tables of at most `n_rows` samples; a row that lacks a field is refused."""
        import pandas as pd

        layout = self.layout
        options = {
            "sep": layout.separator,
            "decimal": layout.decimal,
            "names": layout.names,
            "header": None,
            "index_col": False,
            "skip_blank_lines": layout.skips_blank,
        }
        last = layout.names[layout.n_fields - 1]
        is_complete = layout.n_fields == 1
        with _samples(self._file, layout) as text, warnings.catch_warnings():
            # Surplus fields of the first row would be dropped.
            warnings.simplefilter("error", pd.errors.ParserWarning)
            try:
                for frame in pd.read_csv(
                    _WithoutFooter(text, layout),
                    chunksize=n_rows,
                    low_memory=False,
                    **options,
                ):
                    # pandas fills a short row at its end, which may shift its values.
                    if not is_complete and frame[last].isna().any():
                        self._check_fields()
                        is_complete = True
                    yield frame
            except pd.errors.EmptyDataError:
                return
            except (pd.errors.ParserError, pd.errors.ParserWarning) as error:
                self._check_fields()
                raise DamagedError("the lines are no csv") from error

    def _check_fields(self):
        """Refuse a row that lacks a field, or has more than the others."""
        names = self.layout.names
        for line, fields in self._rows():
            is_longer = any(fields[len(names) :])
            if is_longer or len(fields) < self.layout.n_fields:
                raise ContentError(
                    f"line {line} has {len(fields)} fields, expected "
                    f"{self.layout.n_fields}; complete or remove it"
                )

    def _rows(self):
        """Yield the number and the fields of each line of samples."""
        with _open(self._path) as file, _samples(file, self.layout) as text:
            lines = _WithoutFooter(text, self.layout)
            for n_before, fields in split_rows(lines, self.layout.separator):
                if fields:
                    yield self.layout.n_head_lines + n_before + 1, fields

    def values(self, column: Any, start: int) -> Any:
        """Return the values of a column, of which texts may be numbers in another form.

        Parameters
        ----------
        column : Series
            As pandas reads it. One field that is no number makes texts of all others.
        start : int
            Position of its first value in the file.
        """
        from pandas.api.types import is_numeric_dtype

        values = column.to_numpy()
        i = self.layout.names.index(column.name)
        if is_numeric_dtype(column):
            self._check_thousands(values, start, i)
            return values
        if self.layout.kinds[i] != "number":
            return values
        signs = self.layout.decimal, self.layout.thousands
        texts = column.astype(object).where(column.notna(), "").map(str).tolist()
        numbers = np.array([number(text, *signs) for text in texts])
        for k in np.flatnonzero(np.isnan(numbers)):
            if texts[k].strip().lower() not in MISSING:
                self._refuse(start + k, i, texts[k])
        return numbers

    def _check_thousands(self, values, start, i):
        """Refuse fractions of three digits among integers below 1000, if no sign is proven."""
        if self.layout.thousands or values.dtype.kind != "f":
            return
        fractions = np.flatnonzero(values % 1 > 0)
        integers = values[(values % 1 == 0)]
        thousands = values[fractions] * 1000
        if len(fractions) and len(integers) and np.all(np.abs(integers) < 1000):
            is_like = (np.abs(values[fractions]) >= 1) & (
                np.abs(thousands - thousands.round()) < 1e-6
            )
            if is_like.all():
                self._refuse(start + fractions[0], i)

    def _refuse(self, sample, i, text=None):
        """Raise an error that quotes a field and its line."""
        line, fields = next(islice(self._rows(), int(sample), None))
        text = fields[i] if text is None else text
        problem = f"{text!r:.80} in column {self.layout.names[i]!r} is no number"
        if is_ambiguous(text):
            problem = f"the value is {meanings(text)}"
        raise ContentError(f"line {line}: {problem} (sample {sample})")


class _WithoutFooter(io.TextIOBase):
    """Text that ends with its last sample.

    Parameters
    ----------
    text : text file
        From its first sample on.
    layout : TextLayout
        Its layout.
    """

    def __init__(self, text: Any, layout: TextLayout) -> None:
        super().__init__()
        self._text = text
        self._layout = layout
        self._held = ""
        self._is_at_end = False

    def readable(self) -> bool:
        """Return that the text can be read."""
        return True

    def _hold(self, size):
        """Read on until the text that is held, without its last part, has a size."""
        while not self._is_at_end and len(self._held) < size + _FOOTER:
            part = self._text.read(_PART)
            self._held += part
            if not part:
                self._is_at_end = True
                cut = max(len(self._held) - _FOOTER, 0)
                cut = self._held.find("\n", cut) + 1 if cut else 0
                tail = self._held[cut:]
                end = cut + footer_start(tail, self._layout)
                self._held = self._held[:end]

    def read(self, size: int | None = -1, /) -> str:
        """Return the next characters, all if there is no size."""
        size = sys.maxsize - _FOOTER if size is None or size < 0 else size
        self._hold(size)
        part = self._held[:size]
        self._held = self._held[size:]
        return part

    def readline(self, size: int | None = -1, /) -> str:
        """Return the next line."""
        while "\n" not in self._held and not self._is_at_end:
            self._hold(len(self._held) + 1)
        end = self._held.find("\n") + 1 or len(self._held)
        return self.read(end)


@contextmanager
def _samples(file, layout):
    """The text after the header of an open file."""
    file.seek(0)
    # Letters of another encoding may follow, as in a comment.
    text = io.TextIOWrapper(file, layout.encoding, errors="replace")
    try:
        for _ in range(layout.n_head_lines):
            text.readline()
        yield text
    finally:
        # The file stays open, to be read once more.
        text.detach()


def _open(path):
    return _Bounded(path, "rb") if path.suffix.lower() == ".gz" else path.open("rb")


class _Bounded(gzip.GzipFile):
    """A packed text that is unpacked while it is read, up to the bound for its file."""

    def read1(self, size=-1):
        check_unpacked(Path(self.name).stat().st_size, self.tell())
        return super().read1(size)
