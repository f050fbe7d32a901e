"""Tables of Apache Arrow: Parquet and Feather files, which are read in parts."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ._contents import Contents
from ._limits import check_unpacked

TITLE = "Parquet, Feather"
SUFFIXES = (".parquet", ".feather", ".arrow")
LIBRARY, EXTRA = "pyarrow", "io"
ISOLATED = True
IN_PARTS = True
STATES = "the rate, by a time column"

#: Bytes of a column that are read at a time.
_BUFFER_BYTES = 2**20


def contents(path: Path) -> Contents:
    """Channels by the names of the columns."""
    with _open(path) as file:
        names = [str(name) for name in file.schema.empty_table().to_pandas().columns]

    def read(chosen, n_samples):
        with _open(path) as file:
            for batch in file.batches(chosen, n_samples):
                frame = batch.to_pandas()
                frame.columns = frame.columns.map(str)
                yield [frame[name] for name in chosen]

    return Contents(names, read)


@contextmanager
def _open(path):
    import pyarrow
    from pyarrow.parquet import ParquetFile

    if path.suffix.lower() == ".parquet":
        # Otherwise a group of rows is loaded whole before the first of them is given.
        with ParquetFile(path, pre_buffer=False, buffer_size=_BUFFER_BYTES) as file:
            yield _Parquet(path, file)
    else:
        with pyarrow.ipc.open_file(str(path)) as file:
            yield _Feather(file)


class _Parquet:
    def __init__(self, path: Any, file: Any) -> None:
        self._path, self._file, self.schema = path, file, file.schema_arrow

    schema: Any

    def batches(self, columns: list[str], n_samples: int | None) -> Iterator[Any]:
        if n_samples is not None:
            # Over several groups of rows pyarrow keeps all of them until the last is read.
            for group in range(self._file.num_row_groups):
                yield from self._file.iter_batches(
                    n_samples, row_groups=[group], columns=columns, use_threads=False
                )
            return
        # Blocks are bounded by themselves, but constants take no space in a file.
        check_unpacked(self._path, self._file.metadata.num_rows * 8 * len(columns))
        yield self._file.read(columns, use_threads=False)


class _Feather:
    def __init__(self, file: Any) -> None:
        self._file, self.schema = file, file.schema

    schema: Any

    def batches(self, columns: list[str], n_samples: int | None) -> Iterator[Any]:
        if n_samples is None:
            yield self._file.read_all().select(columns)
            return
        for i in range(self._file.num_record_batches):
            batch = self._file.get_batch(i).select(columns)
            for start in range(0, batch.num_rows, n_samples):
                yield batch.slice(start, n_samples)
