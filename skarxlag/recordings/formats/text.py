"""Text with a column for each channel."""

import gzip
import io
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ._contents import Contents
from ._layout import text_layout
from ._limits import BoundedReader

TITLE = "text, also packed by gzip"
SUFFIXES = (".csv", ".txt", ".tsv", ".csv.gz", ".txt.gz", ".tsv.gz")
LIBRARY = EXTRA = None
ISOLATED = False
IN_PARTS = True
STATES = "the rate, by a time column; units, in a second line or in brackets"

_HEAD = 2**16


def contents(path: Path) -> Contents:
    """Channels by the names in the first line, or ``0``, ``1``, ... where that holds numbers."""
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
        with gzip.open(file) as unpacked, io.BufferedReader(BoundedReader(unpacked, path)) as text:
            yield text
