"""Parquet and Feather files, which are read in parts by pyarrow."""

from collections.abc import Iterator
from pathlib import Path

from ._contents import Channel, Contents, Format, check_unpacked
from ._facts import names_times

FORMAT = Format(
    "Parquet, Feather",
    (".parquet", ".feather", ".arrow"),
    library="pyarrow",
    extra="io",
    isolated=True,
    states="the rate, by a time column",
)

#: Bytes of a column that are read at a time.
_BUFFER_BYTES = 2**20


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by the names of the columns."""
    import pyarrow
    from pyarrow.parquet import ParquetFile

    if path.suffix.lower() == ".parquet":
        # With the defaults, a whole row group is loaded before its first rows are returned.
        opened = ParquetFile(path, pre_buffer=False, buffer_size=_BUFFER_BYTES)
        schema, batches = opened.schema_arrow, _parquet_batches
    else:
        opened = pyarrow.ipc.open_file(str(path))
        schema, batches = opened.schema, _feather_batches
    with opened as file:
        columns = _columns(schema)

        def read(names, n_samples):
            chosen = [columns[name] for name in names]
            if n_samples is None and batches is _parquet_batches:
                # Constants take no space in a file: a small file can hold any number of samples.
                check_unpacked(path.stat().st_size, file.metadata.num_rows * 8 * len(chosen))
            for batch in batches(file, chosen, n_samples):
                yield [batch.column(name).to_numpy(zero_copy_only=False) for name in chosen]

        yield Contents({name: Channel() for name in columns}, read)


def _columns(schema):
    """Columns by channel; of the columns that are an index of pandas, those of times alone."""
    from pyarrow.types import is_timestamp

    index, columns = (schema.pandas_metadata or {}).get("index_columns", []), {}
    for field in schema:
        is_index, name = field.name in index, field.name
        if is_index and is_timestamp(field.type) and not names_times(name):
            name = "time"
        if not is_index or names_times(name):
            columns[name] = field.name
    return columns


def _parquet_batches(file, columns, n_samples):
    if n_samples is None:
        yield file.read(columns, use_threads=False)
        return
    # In one call, pyarrow would keep all row groups until the last is read.
    for group in range(file.num_row_groups):
        yield from file.iter_batches(
            n_samples, row_groups=[group], columns=columns, use_threads=False
        )


def _feather_batches(file, columns, n_samples):
    if n_samples is None:
        yield file.read_all().select(columns)
        return
    for i in range(file.num_record_batches):
        batch = file.get_batch(i).select(columns)
        for start in range(0, batch.num_rows, n_samples):
            yield batch.slice(start, n_samples)
