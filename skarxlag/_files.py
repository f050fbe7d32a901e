"""Files that are written whole or not at all."""

import os
from pathlib import Path


def write_atomically(path, content):
    """Write a file beside its place and move it there, so that no half of it is ever seen.

    Parameters
    ----------
    path : str or path-like
        The file; an existing one is replaced.
    content : bytes
        All of it.

    Raises
    ------
    OSError
        If it cannot be written; then nothing is left behind.
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("xb") as file:
            file.write(content)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
