"""Text with a column for each channel, separated by commas."""

import warnings
from contextlib import contextmanager

import pandas as pd
from pandas.api.types import is_numeric_dtype

from ._channels import columns

SUFFIXES = (".csv",)


def blocks(path, n_samples):
    """Blocks of the columns."""
    first_line = read_csv_frame(path, header=None, nrows=1)
    has_header = not all(is_numeric_dtype(dtype) for dtype in first_line.dtypes)
    header = 0 if has_header else None
    if n_samples is None:
        yield columns(read_csv_frame(path, header=header)), None
        return
    with read_csv_frame(path, header=header, chunksize=n_samples) as frames:
        while True:
            with _strict_parser():
                frame = next(frames, None)
            if frame is None:
                return
            yield columns(frame), None


def read_csv_frame(path, **options):
    """Read a csv file with pandas, dropping neither blank lines nor surplus fields."""
    with _strict_parser():
        return pd.read_csv(
            path, index_col=False, skip_blank_lines=False, low_memory=False, **options
        )


@contextmanager
def _strict_parser():
    with warnings.catch_warnings():
        # By default surplus fields would turn the first column into an index.
        warnings.simplefilter("error", pd.errors.ParserWarning)
        yield
