"""Sources of samples that arrive while they are read: a stream, a growing file, a folder.

A source is an iterator of `Block`. It yields None if nothing new has arrived, and ends
with its input. Growing files and folders never end.
"""

import os
import queue
import stat
import threading
import time
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..readers.entries import ListedRecording
from ..readers.files import recording_start
from ..readers.windows import block_length
from .live_samples import RawSamples
from .live_text import TextSamples

_BYTES_AT_A_TIME = 2**18
#: Bytes at the beginning of a growing file by which it is recognised.
_HEAD = 4096
#: Seconds to wait for a stream, and pieces of it that are read ahead.
_STREAM_SECONDS = 0.05
_READ_AHEAD = 4


@dataclass
class Block:
    """Samples that arrived together.

    Parameters
    ----------
    samples : ndarray of shape (n_channels, n_samples)
        The samples.
    time : float or None, default=None
        Seconds at the first of them, if the source states it.
    rpm : ndarray of shape (n_samples,), float or None, default=None
        Shaft speed, if the file states it.
    source : str or None, default=None
        File of the samples, if there are several.
    position : list or None, default=None
        Two values from which a later run continues after this block. None: the source
        cannot be interrupted here, because further blocks of the same piece follow.
    """

    samples: np.ndarray
    time: float | None = None
    rpm: Any = None
    source: str | None = None
    position: list[Any] | None = None


Blocks = Iterator[Block | None]
Parser = RawSamples | TextSamples


def from_stream(open_stream: Callable[[], Any], parser: Parser) -> Blocks:
    """Yield blocks from a pipe or a device, which is opened without a buffer, until it ends."""
    arrived: queue.Queue[bytes | Exception] = queue.Queue(_READ_AHEAD)
    is_closed = threading.Event()

    def read():
        try:
            with open_stream() as stream:
                while not is_closed.is_set() and (
                    data := stream.read(_BYTES_AT_A_TIME)
                ):
                    arrived.put(data)
            arrived.put(b"")
        except (OSError, ValueError) as error:
            arrived.put(error)

    # Opening a named pipe and reading cannot be interrupted, and must not keep the
    # process alive.
    threading.Thread(target=read, daemon=True).start()
    is_end = False
    try:
        while not is_end:
            try:
                data = arrived.get(timeout=_STREAM_SECONDS)
            except queue.Empty:
                yield None
                continue
            if isinstance(data, Exception):
                raise data
            is_end = not data
            for samples, moment in parser.parts(data, is_end=is_end):
                yield Block(samples, moment, position=[0, 0])
    finally:
        is_closed.set()
        # The thread may wait for room.
        while not arrived.empty():
            arrived.get_nowait()


def from_growing_file(
    path: Path, parser: Parser, warn: Callable, position: Any = None
) -> Blocks:
    """Yield blocks from a growing file, starting at `position` (offset and checksum of the head).

    If the file was truncated or replaced, reading starts again at its beginning; the
    rest of a replaced file is read before. An incomplete last line or sample waits for
    its rest.
    """
    file = path.open("rb")
    try:
        if position is not None:
            if position[0] <= path.stat().st_size and position == _position(
                file, position[0]
            ):
                parser.begin(file.read(min(position[0], _BYTES_AT_A_TIME)))
                file.seek(position[0])
            else:
                warn(f"{path} was started afresh since the state was saved")
        is_replaced = False
        while True:
            if data := file.read(_BYTES_AT_A_TIME):
                parts = list(parser.parts(data))
                after = _position(file, file.tell() - parser.n_pending)
                for i, part in enumerate(parts, start=1):
                    yield Block(*part, position=after if i == len(parts) else None)
            elif is_replaced:
                warn(f"{path} was started afresh")
                file.close()
                file = path.open("rb")
                is_replaced = False
                parser.begin()
            else:
                yield None
                is_replaced = _is_replaced(path, file)
    finally:
        file.close()


def _position(file, offset):
    """Return an offset in a file and a checksum of what is before it; nothing is read on."""
    current = file.tell()
    file.seek(0)
    checksum = zlib.crc32(file.read(min(offset, _HEAD)))
    file.seek(current)
    return [offset, checksum]


def _is_replaced(path, file):
    """Return whether a file got shorter, or its name belongs to another file."""
    status = _status(path)
    if status is None:
        return False
    is_same = os.path.samestat(status, os.fstat(file.fileno()))
    return status.st_size < file.tell() or not is_same


def _status(path):
    """Return the status of a file; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    # A folder cannot be read, and opening a pipe would wait for ever.
    return status if stat.S_ISREG(status.st_mode) else None


def from_folder(
    folder: Path,
    entry_of: Callable[[Path], ListedRecording],
    rows: Any,
    settle: float,
    has_times: bool,
    warn: Callable,
    position: Any,
) -> Blocks:
    """Yield blocks from the files of a folder, in the order in which they were finished.

    A file is finished when its size and time have not changed for a while. A file that
    arrives late with an older time than the last one is read, too, with a warning: it
    was copied, or the clock was set back.

    Parameters
    ----------
    folder : Path
        The folder.
    entry_of : callable
        Called with the path of each file before it is read. It returns the recording
        with its channels.
    rows : Answers
        Length and channels of windows; whether the speed is read, and a file without is
        skipped.
    settle : float
        Seconds without a change after which a file is finished.
    has_times : bool
        Whether files have times: the dates that they state, or else their times of
        modification, which are those of their last samples.
    warn : callable
        Called with a message for each file that cannot be read.
    position : sequence or None
        Time and name of the latest file that was read. Older files that exist at the
        start count as read.
    """
    done = tuple(position or (-1, ""))
    read = {state for state in _states(folder) if state[:2] <= done}
    first_seen: dict[tuple[Any, ...], float] = {}
    while True:
        states = _states(folder)
        moment = time.monotonic()
        read &= states
        first_seen = {state: first_seen.get(state, moment) for state in states - read}
        for state in sorted(first_seen):
            path = folder / state[1]
            # What changed since the folder was listed is read when it is finished
            # again.
            if moment - first_seen[state] < settle or _state(path) != state:
                break
            read.add(state)
            if state[:2] < done:
                warn(f"{path}: older than the file before, read nevertheless")
            done = max(done, state[:2])
            try:
                entry = entry_of(path)
                yield from _blocks_of_file(entry, state, rows, has_times, list(done))
            except (OSError, ValueError, ImportError, MemoryError) as error:
                warn(f"skipped: {error}")
        yield None


def _states(folder):
    """States of the files of a folder that are not hidden."""
    return {_state(path) for path in folder.iterdir() if path.name[0] != "."} - {None}


def _state(path):
    """Time of modification, name and size of a file; None if there is none."""
    status = _status(path)
    return None if status is None else (status.st_mtime_ns, path.name, status.st_size)


def _blocks_of_file(entry, state, rows, has_times, position):
    path = entry.path
    n_samples = block_length(rows.window_length)
    # All of a file is read before any of it is used, so that no file is used in part.
    opened = entry.open(n_samples, reads_speed=rows.takes_rpm)
    shapes = [np.atleast_2d(signal).shape for signal in opened.blocks]
    entry = opened.entry
    n_channels = shapes[0][0]
    if n_channels != rows.n_channels:
        raise ValueError(
            f"{path}: the number of channels is {n_channels}, expected {rows.n_channels}"
        )
    if entry.rpm is None and rows.needs_rpm:
        raise ValueError(f"{path}: the speed is not stated; expected --rpm")
    start = None
    if has_times:
        start = recording_start(path, channel=entry.channel, dtype=entry.dtype)
        if start is None:
            length = sum(shape[1] for shape in shapes)
            start = state[0] * 1e-9 - length / opened.sampling_rate
    n_read = 0
    opened = entry.open(n_samples)
    for i, signal in enumerate(opened.blocks, start=1):
        if _state(path) != state:
            raise ValueError(f"{path}: changed while it was read, from block {i}")
        samples = np.atleast_2d(signal)
        rpm = np.atleast_1d(
            entry.speeds([n_read], samples.shape[1], opened.sampling_rate)
        )[0]
        is_last = i == len(shapes)
        yield Block(samples, start, rpm, path.name, position if is_last else None)
        start = None
        n_read += samples.shape[1]
