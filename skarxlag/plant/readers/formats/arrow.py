"""Parquet and Feather files, which are read in parts by pyarrow."""

from collections.abc import Iterator
from pathlib import Path

from .contents import Channel, Contents, Format, check_unpacked
from .facts import names_times

FORMAT = Format(
    (".parquet", ".feather", ".arrow"), library="pyarrow", extra="io", isolated=True
)

#: Bytes of a column that are read at a time.
_BUFFER_BYTES = 2**20


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by the names of the columns."""
    from pyarrow.dataset import dataset
    from pyarrow.parquet import ParquetFile
    from pyarrow.types import is_timestamp

    is_parquet = path.suffix.lower() == ".parquet"
    file = dataset(str(path), format="parquet" if is_parquet else "feather")
    index = (file.schema.pandas_metadata or {}).get("index_columns", [])
    columns = {}
    for field in file.schema:
        name = field.name
        # Of the columns that are an index of pandas, only those of times are channels.
        if name in index and is_timestamp(field.type) and not names_times(name):
            name = "time"
        if field.name not in index or names_times(name):
            columns[name] = field.name

    def tables(options, n_samples):
        if n_samples is None:
            yield file.to_table(**options)
        elif is_parquet:
            # With the defaults, a whole row group is loaded before its first rows are
            # returned.
            with ParquetFile(
                path, pre_buffer=False, buffer_size=_BUFFER_BYTES
            ) as groups:
                # In one call, pyarrow would keep all row groups until the last is read.
                for group in range(groups.num_row_groups):
                    yield from groups.iter_batches(
                        n_samples, row_groups=[group], **options
                    )
        else:
            yield from file.to_batches(
                batch_size=n_samples, batch_readahead=0, **options
            )

    def read(names, n_samples):
        chosen = [columns[name] for name in names]
        # Constants take no space in a file: a small file can hold any number of
        # samples.
        check_unpacked(path.stat().st_size, file.count_rows() * 8 * len(chosen))
        for table in tables({"columns": chosen, "use_threads": False}, n_samples):
            yield [table.column(name).to_numpy(zero_copy_only=False) for name in chosen]

    yield Contents({name: Channel() for name in columns}, read)
