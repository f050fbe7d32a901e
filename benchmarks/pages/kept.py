"""Tables in the output folder of a part, which are reused if the same code wrote them."""

import pandas as pd

from benchmarks.pages.digests import part_digest
from benchmarks.pages.parts import PARTS


def kept_or_computed(path, part, compute):
    """Read a table that the present code wrote earlier; otherwise compute and write it.

    The digest of the code, of the data and of the command is kept in a file next to the
    table. A table without this file, or with another digest, is computed again.

    Parameters
    ----------
    path : Path
        The csv file.
    part : str
        Name of the part in `benchmarks.pages.parts` that the table belongs to.
    compute : callable
        It takes no argument and returns a DataFrame.

    Returns
    -------
    DataFrame
        As it is read from the file.
    """
    # Before the computation, so that an edit during it cannot hide.
    digest = part_digest(PARTS[part])
    if not is_current(path, part):
        compute().to_csv(path, index=False, float_format="%.6g")
        _digest_path(path).write_text(digest)
    return pd.read_csv(path)


def is_current(path, part):
    """Return whether the present code wrote the table of a part."""
    stored = _digest_path(path)
    return (
        path.exists()
        and stored.exists()
        and stored.read_text() == part_digest(PARTS[part])
    )


def _digest_path(path):
    return path.with_suffix(".digest")
