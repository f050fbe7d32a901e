"""Zip archives of models and states, read within limits."""

import io
import math
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

import numpy as np

#: Largest size after unpacking: this many bytes, or this many times the size of the file. A model
#: of ten conditions needs less than one megabyte.
_MOST_BYTES, _MOST_TIMES = 100 * 2**20, 10
_MOST_MEMBERS = 10_000


def read_members(content: bytes) -> tuple[dict[str, Any], bytes]:
    """Read the members of an archive, unpacked within limits.

    The stated sizes are checked before anything is unpacked, and no member is unpacked beyond its
    stated size. Compression methods that need much memory are refused, and so are arrays that state
    a wrong size or hold Python objects.

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
            raise BadZipFile(f"it unpacks to {total:,} bytes, expected at most {most:,}")
        if len(infos) > _MOST_MEMBERS or len({info.filename for info in infos}) < len(infos):
            raise BadZipFile(f"it has {len(infos):,} members, some of the same name or too many")
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
        # A plain read would unpack all of a member whose stated size is a lie.
        content = member.read(info.file_size + 1)
    if len(content) != info.file_size:
        raise BadZipFile(f"{info.filename} has another size than is stated")
    return content


def _check_array_size(name, content):
    stream = io.BytesIO(content)
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    version = np.lib.format.read_magic(stream)
    if version not in readers:
        raise BadZipFile(f"{name} is an array of format {version}, expected {sorted(readers)}")
    shape, _, dtype = readers[version](stream)
    stated = math.prod(shape) * dtype.itemsize
    if dtype.hasobject or stated != len(content) - stream.tell():
        raise BadZipFile(f"{name} is an array of {dtype} that states {stated:,} bytes")


def write_members(members: dict[str, Any], comment: bytes) -> bytes:
    """Write an archive without compression.

    Parameters
    ----------
    members : dict of str to bytes
        Contents by name.
    comment : bytes
        The comment of the archive.

    Returns
    -------
    bytes
        The file.

    Examples
    --------
    >>> read_members(write_members({"a": b"text"}, b"comment"))
    ({'a': b'text'}, b'comment')
    """
    stream = io.BytesIO()
    with ZipFile(stream, "w") as file:
        for name, member in members.items():
            file.writestr(name, member)
        file.comment = comment
    return stream.getvalue()
