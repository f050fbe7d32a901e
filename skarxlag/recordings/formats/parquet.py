"""Apache Parquet files."""

import pandas as pd

from ._channels import columns

SUFFIXES = (".parquet",)


def blocks(path, n_samples):
    """Blocks of the columns."""
    if n_samples is None:
        yield columns(pd.read_parquet(path)), None
        return
    from pyarrow.parquet import ParquetFile

    with ParquetFile(path) as file:
        for batch in file.iter_batches(n_samples):
            yield columns(batch.to_pandas()), None
