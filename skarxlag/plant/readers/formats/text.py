"""Text with a column for each channel."""

import gzip
import io
import re
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from .contents import Channel, ContentError, Contents, Format, check_unpacked
from .facts import letters
from .text_layout import UTF_16, split_rows, text_layout

FORMAT = Format((".csv", ".txt", ".tsv", ".dat", ".csv.gz", ".txt.gz", ".tsv.gz"))

#: Bytes and lines from which the layout is inferred.
_HEAD = 2**16


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by the names in the header, ``0``, ``1``, ... if there is none.

    If dates and times of day are in two columns, both hold both together.
    """
    with _open(path) as file:
        yield _contents_of(file, path)


def _contents_of(file, path):
    head = file.read(_HEAD)
    if b"\0" in head and not head.startswith(UTF_16):
        raise ContentError("holds no text; raw samples need their dtype, such as '<i2'")
    layout = text_layout(head, is_whole=len(head) < _HEAD)
    if layout.names[0].strip().lower() == "path":
        raise ContentError(
            "this is a table of recordings, expected samples; --table takes it"
        )

    def read(names, n_samples):
        for frame in _frames(file, path, layout, n_samples or sys.maxsize):
            parts = date_columns(layout.names, frame.iloc[0]) if len(frame) else []
            if {*parts} & {*names}:
                date, clock = (frame[part].astype(str) for part in parts)
                frame = frame.assign(**dict.fromkeys(parts, date + " " + clock))
            yield [_values(frame[name], layout.decimal) for name in names]

    channels = {name: Channel(unit=layout.units.get(name)) for name in layout.names}
    return Contents(channels, read, advice=layout.advice)


def _values(column, decimal):
    """Return the values of a column, in which texts have the decimal point.

    One field that is no number makes texts of all others.
    """
    from pandas.api.types import is_numeric_dtype

    if decimal != "." and not is_numeric_dtype(column):
        column = column.str.replace(decimal, ".")
    return column.to_numpy()


def date_columns(names: list[str], row: Mapping[str, object]) -> list[str]:
    """Return the columns of the date and of the time of day, or none if they are not two.

    >>> date_columns(["Zeit", "acc", "Datum"], {"Zeit": "07:00:00", "Datum": "22.11.26"})
    ['Datum', 'Zeit']
    """
    parts = [name for name in names if letters(name) in ("date", "datum")]
    parts += [name for name in names if letters(name) in ("time", "zeit", "uhrzeit")]
    return parts if [":" in str(row[name]) for name in parts] == [False, True] else []


def _frames(file, path, layout, n_rows):
    """Tables of at most `n_rows` samples; a row that lacks a field is refused."""
    import pandas as pd

    options = {
        "sep": layout.separator,
        "decimal": layout.decimal,
        "names": layout.names,
        "header": None,
        "index_col": False,
        "skip_blank_lines": False,
    }
    is_complete = len(layout.names) == 1
    with _samples(file, layout) as text, warnings.catch_warnings():
        # Surplus fields of the first row would be dropped.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:
            for frame in pd.read_csv(
                text, chunksize=n_rows, low_memory=False, **options
            ):
                # pandas fills a short row at its end, which may shift its values.
                if not is_complete and frame.iloc[:, -1].isna().any():
                    _check_complete(path, layout)
                    is_complete = True
                yield frame
        except pd.errors.EmptyDataError:
            return
        except pd.errors.ParserError as error:
            message = re.sub(
                r"(?<=line )\d+",
                lambda match: str(int(match[0]) + layout.n_head_lines),
                str(error),
            )
            raise ValueError(message) from error


@contextmanager
def _samples(file, layout):
    """The text after the header of an open file."""
    file.seek(0)
    text = io.TextIOWrapper(file, layout.encoding)
    try:
        for _ in range(layout.n_head_lines):
            text.readline()
        yield text
    finally:
        # The file stays open, to be read once more.
        text.detach()


def _check_complete(path, layout):
    """Refuse a row that lacks a field."""
    with _open(path) as file, _samples(file, layout) as text:
        for sample, (_, fields) in enumerate(split_rows(text, layout.separator)):
            if 0 < len(fields) < len(layout.names):
                raise ContentError(
                    f"sample {sample} has {len(fields)} of {len(layout.names)} fields: a "
                    "value is missing"
                )


def _open(path):
    return _Bounded(path, "rb") if path.suffix.lower() == ".gz" else path.open("rb")


class _Bounded(gzip.GzipFile):
    """A packed text that is unpacked while it is read, up to the bound for its file."""

    def read1(self, size=-1):
        check_unpacked(Path(self.name).stat().st_size, self.tell())
        return super().read1(size)
