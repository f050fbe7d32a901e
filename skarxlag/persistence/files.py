"""Files that are written whole, archives that are read within limits, and their errors."""

import io
import math
import os
import shutil
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

import numpy as np

#: Largest size after unpacking: this many bytes, or this many times the size of the
#: file. A model of ten conditions needs less than one megabyte.
_MOST_BYTES = 100 * 2**20
_MOST_TIMES = 10
_MOST_MEMBERS = 10_000


def write_atomically(
    path: str | os.PathLike[str], content: bytes, *, follows_links: bool = True
) -> None:
    """Write a file under another name and move it to its place, so no reader sees half of it.

    If several threads and processes write to one path at the same time, one of the
    contents remains, complete. A symbolic link stays a link, and the file that it
    points to is replaced. A pipe, a terminal or a device cannot be replaced, so the
    content is written into it.

    Parameters
    ----------
    path : str or path-like
        The file. An existing one is replaced and keeps its permissions, which hold
        while it is written, too. A new one has those that the umask of the process
        leaves.
    content : bytes
        All of it.
    follows_links : bool, default=True
        False: a symbolic link is replaced. A program that has resolved and checked the
        path before writes nowhere else then.

    Raises
    ------
    OSError
        If it cannot be written. The message names the file. An existing file is then
        unchanged, and no other file remains.
    """
    path = Path(path)
    try:
        _write(path, content, follows_links)
    except OSError as error:
        if error.errno is not None:
            raise type(error)(error.errno, error.strerror, str(path)) from error
        raise


def _write(path, content, follows_links):
    is_link = path.is_symlink() and not follows_links
    if path.exists() and not is_link and not stat.S_ISREG(path.stat().st_mode):
        path.write_bytes(content)
        return
    if follows_links:
        path = Path(os.path.realpath(path))
    # The name is not made of the file's own name, which may be as long as the system
    # allows.
    temporary = path.with_name(f".{uuid.uuid4().hex}.tmp")
    is_old = path.exists() and not is_link
    mode = stat.S_IMODE(path.stat().st_mode) if is_old else 0o666
    try:
        with open(temporary, "xb", opener=partial(os.open, mode=mode)) as file:
            file.write(content)
        if is_old:
            shutil.copymode(path, temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def read_members(content: bytes) -> tuple[dict[str, Any], bytes]:
    """Read the members of an archive, unpacked within limits.

    The stated sizes are checked before anything is unpacked, and no member is unpacked
    beyond its stated size. Compression methods that need much memory are refused, and
    so are arrays that state a wrong size or hold Python objects.

    Parameters
    ----------
    content : bytes
        The file.

    Returns
    -------
    members : dict of str to bytes
        Contents by name.
    comment : bytes
        The comment of the archive.

    Raises
    ------
    BadZipFile
        If it is no zip archive, or exceeds the limits.
    """
    with ZipFile(io.BytesIO(content)) as file:
        infos = file.infolist()
        most = max(_MOST_BYTES, _MOST_TIMES * len(content))
        total = sum(info.file_size for info in infos)
        if total > most:
            raise BadZipFile(
                f"it unpacks to {total:,} bytes, expected at most {most:,}"
            )
        if len(infos) > _MOST_MEMBERS or len({info.filename for info in infos}) < len(
            infos
        ):
            raise BadZipFile(
                f"it has too many members, {len(infos):,}, or two of the same name"
            )
        for info in infos:
            if info.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
                raise BadZipFile(f"{info.filename} is neither stored nor deflated")
        members = {info.filename: _read(file, info) for info in infos}
        comment = file.comment
    for name, member in members.items():
        if name.endswith(".npy"):
            _check_array_size(name, member)
    return members, comment


def _read(file, info):
    with file.open(info) as member:
        # A read without a limit would unpack a whole member, even if its stated size is
        # wrong.
        content = member.read(info.file_size + 1)
    if len(content) != info.file_size:
        raise BadZipFile(
            f"{info.filename} does not have the size that the archive states"
        )
    return content


def _check_array_size(name, content):
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    # NumPy uses later versions for arrays of structures only.
    if version != (1, 0):
        raise BadZipFile(f"{name} is an array of format {version}, expected (1, 0)")
    shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    stated = math.prod(shape) * dtype.itemsize
    if dtype.hasobject or stated != len(content) - stream.tell():
        raise BadZipFile(f"{name} is an array of {dtype} that states {stated:,} bytes")


@contextmanager
def errors_named(path: str | os.PathLike[str], expected: str) -> Iterator[None]:
    """Name the file in the errors of those who read it."""
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        yield
    except ImportError:
        raise
    except MemoryError as error:
        raise MemoryError(f"{path}: not enough memory to load it") from error
    # What a parser raises on damaged input is as varied as the damage, such as
    # RecursionError.
    except Exception as error:
        raise ValueError(f"{path}: no {expected} ({error})") from error
