"""Blocks of samples from standard input, from a growing file, and from a folder."""

import os
import signal
import stat
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from .files import recording_blocks, recording_start
from .live_samples import RawSamples, TextSamples
from .rates import rates_agree
from .windows import block_length

_BYTES_AT_A_TIME = 2**18


class StopRequestedError(Exception):
    """A signal requested the end while the program was waiting."""


class Stopping:
    """Context in which SIGINT and SIGTERM request the end at a moment that does no harm.

    While the program computes, a request is only noted. While it waits for input, the wait ends.

    Attributes
    ----------
    requested : bool
        Whether a signal came.
    """

    requested: bool

    def __init__(self) -> None:
        self.requested, self._is_waiting, self._before = False, False, {}

    def __enter__(self) -> Self:
        # Python lets only the main thread handle signals.
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *exception: Any) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number, frame):
        self.requested = True
        if self._is_waiting:
            raise StopRequestedError

    @contextmanager
    def waiting(self) -> Iterator[Any]:
        """Let a signal end this block by a `StopRequestedError`."""
        self._is_waiting = True
        try:
            if self.requested:
                raise StopRequestedError
            yield
        finally:
            self._is_waiting = False


@dataclass
class Block:
    """Samples that arrived together.

    Parameters
    ----------
    samples : ndarray of shape (n_channels, n_samples)
        The samples.
    time : float or None, default=None
        Seconds at the first of them, if the source states it.
    source : str or None, default=None
        File of the samples, if there are several.
    place : object, default=None
        Position of the source after this block.
    is_last : bool, default=True
        Whether `place` points after this block; False if further blocks come before it.
    """

    samples: np.ndarray
    time: float | None = None
    source: str | None = None
    place: object = None
    is_last: bool = True


@dataclass
class Patience:
    """How a source waits for more data.

    Parameters
    ----------
    stopping : Stopping
        Ends the wait on a signal.
    poll : float
        Seconds between two looks.
    idle : float or None
        Seconds without new data after which the source ends; None waits for ever.
    """

    stopping: Stopping
    poll: float
    idle: float | None

    def __post_init__(self) -> None:
        self.renew()

    def renew(self) -> None:
        """Restart the idle timer."""
        self._since = time.monotonic()

    def wait(self) -> bool:
        """Sleep; return whether to look again."""
        if self.idle is not None and time.monotonic() - self._since >= self.idle:
            return False
        with self.stopping.waiting():
            time.sleep(self.poll)
        return True


def from_stream(
    open_stream: Callable[[], Any], parser: RawSamples | TextSamples, stopping: Stopping
) -> Iterator[Block]:
    """Yield blocks from a pipe or a device until it ends."""
    with stopping.waiting():
        # A named pipe opens when a program writes to it.
        stream = open_stream()
    with stream as source:
        data = b" "
        while data:
            with stopping.waiting():
                data = source.read1(_BYTES_AT_A_TIME)
            for samples, moment in parser.parts(data, is_end=not data):
                yield Block(samples, moment)


def from_growing_file(
    path: Path,
    parser: RawSamples | TextSamples,
    patience: Patience,
    warn: Callable[[str], None],
    place: list[int] | None = None,
) -> Iterator[Block]:
    """Yield blocks from a growing file, starting at `place` (offset and file number).

    If the file was truncated or replaced, reading starts again at its beginning; the rest of a
    replaced file is read before. An incomplete last line or sample waits for its rest.
    """
    file = path.open("rb")
    try:
        offset, number = place or (0, os.fstat(file.fileno()).st_ino)
        is_same = number == os.fstat(file.fileno()).st_ino
        if 0 < offset <= path.stat().st_size and is_same:
            parser.begin(file.read(min(offset, _BYTES_AT_A_TIME)))
            file.seek(offset)
        elif offset > 0:
            warn(f"{path} was started afresh since the state was saved")
        is_replaced = False
        while True:
            if data := file.read(_BYTES_AT_A_TIME):
                patience.renew()
                parts = list(parser.parts(data))
                after = [file.tell() - parser.n_pending, os.fstat(file.fileno()).st_ino]
                for i, (samples, moment) in enumerate(parts, start=1):
                    where = None if is_replaced else after
                    yield Block(samples, moment, place=where, is_last=i == len(parts))
            elif is_replaced:
                warn(f"{path} was started afresh")
                file.close()
                file, is_replaced = path.open("rb"), False
                parser.begin()
            elif not patience.wait():
                break
            else:
                is_replaced = _is_replaced(path, file)
    finally:
        file.close()


def _is_replaced(path, file):
    """Whether a file got shorter, or its name belongs to another file."""
    try:
        now = path.stat()
    except OSError:
        return False
    # A folder cannot be read, and opening a pipe would wait for ever.
    is_file = stat.S_ISREG(now.st_mode)
    is_other = not os.path.samestat(now, os.fstat(file.fileno()))
    return is_file and (now.st_size < file.tell() or is_other)


def from_folder(
    folder: Path,
    options: dict[str, Any],
    patience: Patience,
    warn: Callable[..., Any],
    place: list[Any] | None = None,
) -> Iterator[Block]:
    """Yield blocks from the files of a folder, in the order in which they were finished.

    A file is finished when its size and time have not changed for a while. A file that arrives late
    with an older time than the last one is read, too, with a warning: it was copied, or the clock
    was set back.

    Parameters
    ----------
    folder : Path
        The folder.
    options : dict
        ``channel``, ``dtype``, ``sampling_rate``, ``n_channels`` and ``window_length`` for reading
        a file; ``settle``: seconds without a change after which it is finished; and ``has_times``:
        whether its time of modification is the time of its last sample.
    patience : Patience
        How to wait.
    warn : callable
        Called with a message for each file that cannot be read.
    place : list or None, default=None
        Time and name of the latest file that was read. Older files that exist at the start count as
        read.
    """
    done = tuple(place or (-1, ""))
    read = {key for key in _files(folder) if key <= done}
    seen = {}
    while True:
        now, moment = _files(folder), time.monotonic()
        read &= now.keys()
        seen = {
            key: seen[key] if seen.get(key, (None,))[0] == size else (size, moment)
            for key, size in now.items()
            if key not in read
        }
        for key in sorted(seen):
            if moment - seen[key][1] < options["settle"]:
                break
            read.add(key)
            if key < done:
                warn(f"{folder / key[1]}: older than the file before, read nevertheless")
            done = max(done, key)
            patience.renew()
            yield from _blocks_of_file(folder / key[1], key[0], options, warn, list(done))
        if not patience.wait():
            return


def _files(folder):
    """Sizes of the files, by time of modification and name."""
    found = {}
    for entry in os.scandir(folder):
        with suppress(OSError):
            # Links that lead nowhere, or in a circle, are not files.
            if not entry.name.startswith(".") and entry.is_file():
                status = entry.stat()
                found[status.st_mtime_ns, entry.name] = status.st_size
    return found


def _blocks_of_file(path, changed, options, warn, place):
    chosen = {"channel": options["channel"], "dtype": options["dtype"]}

    def signals():
        n_samples = block_length(options["window_length"])
        for samples, rate in recording_blocks(path, n_samples, **chosen):
            yield np.atleast_2d(samples), rate

    try:
        # All of a file is read before any of it is used, so that no file is used in part.
        length = sum(_checked(path, options, *block) for block in signals())
        start = None
        if options["has_times"]:
            start = recording_start(path, **chosen)
            if start is None:
                start = changed * 1e-9 - length / options["sampling_rate"]
        n_read = 0
        for samples, _ in signals():
            n_read += samples.shape[1]
            yield Block(samples, start, path.name, place, is_last=n_read == length)
            start = None
    except (OSError, ValueError, ImportError, MemoryError) as error:
        warn(f"skipped: {error}")


def _checked(path, options, samples, rate):
    """Number of samples of a block whose rate and number of channels fit."""
    if not rates_agree(rate, options["sampling_rate"]):
        raise ValueError(
            f"{path}: sampled at {rate:g} Hz, expected {options['sampling_rate']:g} Hz"
        )
    if len(samples) != options["n_channels"]:
        raise ValueError(f"{path}: {len(samples)} channels, expected {options['n_channels']}")
    return samples.shape[1]
