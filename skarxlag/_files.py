"""Files that are written whole or not at all."""

import os
import shutil
import stat
import uuid
from pathlib import Path


def write_atomically(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file under another name and move it to its place, so no reader sees half of it.

    If several threads and processes write to one path at the same time, one of the contents
    remains, complete. A symbolic link stays a link, and the file that it points to is replaced. A
    pipe, a terminal or a device cannot be replaced, so the content is written into it.

    Parameters
    ----------
    path : str or path-like
        The file. An existing one is replaced and keeps its permissions.
    content : bytes
        All of it.

    Raises
    ------
    OSError
        If it cannot be written. An existing file is then unchanged, and no other file remains.
    """
    path = Path(path)
    if path.exists() and not stat.S_ISREG(path.stat().st_mode):
        path.write_bytes(content)
        return
    path = Path(os.path.realpath(path))
    # The name is not made of the file's own name, which may be as long as the system allows.
    beside = path.with_name(f".{uuid.uuid4().hex}.tmp")
    try:
        with beside.open("xb") as file:
            file.write(content)
        if path.exists():
            shutil.copymode(path, beside)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
