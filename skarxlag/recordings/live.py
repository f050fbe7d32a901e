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
    """The user or the system asked for the end while the program was waiting."""


class Stopping:
    """Takes the signals SIGINT and SIGTERM as a request to end, at a moment that does no harm.

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
        """Let a signal end what is done in here, by a `StopRequestedError`."""
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
        When the first of them was taken, where the source tells.
    source : str or None, default=None
        File that they are from, where there are several.
    place : object, default=None
        What the source needs to go on behind this block.
    is_last : bool, default=True
        Whether `place` is behind this block; False where further blocks come before it.
    """

    samples: np.ndarray
    time: float | None = None
    source: str | None = None
    place: object = None
    is_last: bool = True


@dataclass
class Patience:
    """How a source waits for more.

    Parameters
    ----------
    stopping : Stopping
        Ends the wait on a signal.
    poll : float
        Seconds between looks.
    idle : float or None
        Seconds without anything new after which the source ends; None waits for ever.
    """

    stopping: object
    poll: float
    idle: float | None

    def __post_init__(self) -> None:
        self.renew()

    def renew(self) -> None:
        """Something new has come."""
        self._since = time.monotonic()

    def wait(self) -> bool:
        """Sleep, and say whether to look again."""
        if self.idle is not None and time.monotonic() - self._since >= self.idle:
            return False
        with self.stopping.waiting():
            time.sleep(self.poll)
        return True


def from_stream(
    open_stream: Callable[[], Any], parser: RawSamples | TextSamples, stopping: Stopping
) -> Iterator[Block]:
    """Blocks from a pipe or a device, until it ends."""
    with stopping.waiting():
        # A named pipe opens when somebody writes to it.
        stream = open_stream()
    with stream as source:
        while True:
            with stopping.waiting():
                data = source.read1(_BYTES_AT_A_TIME)
            yield from _parsed(parser, data, is_end=not data)
            if not data:
                return


def _parsed(parser, data, *, is_end=False, place=None):
    """Blocks of what a parser makes of some bytes; the place is behind all of them."""
    parts = list(parser.parts(data, is_end=is_end))
    for i, (samples, moment) in enumerate(parts):
        where = None if place is None else place()
        yield Block(samples, moment, place=where, is_last=i == len(parts) - 1)


def from_growing_file(
    path: Path,
    parser: RawSamples | TextSamples,
    patience: Patience,
    warn: Callable[[str], None],
    place: list[int] | None = None,
) -> Iterator[Block]:
    """Blocks from a file to which somebody appends, from a place on.

    A file that got shorter, or another file of the same name, was started afresh, and is read from
    its beginning; of the other one, what was appended last is read before. A last line or sample
    that is not whole is left for the next time. The place is an offset and the file's own number.
    """
    file = path.open("rb")
    try:
        offset, number = place or (0, _number(file))
        if 0 < offset <= path.stat().st_size and number == _number(file):
            parser.begin(file.read(min(offset, _BYTES_AT_A_TIME)))
            file.seek(offset)
        elif offset > 0:
            warn(f"{path} was started afresh since the state was saved")

        def behind():
            return [file.tell() - parser.n_pending, _number(file)]

        while True:
            data = file.read(_BYTES_AT_A_TIME)
            if data:
                patience.renew()
                yield from _parsed(parser, data, place=behind)
                continue
            if not patience.wait():
                break
            if _started_afresh(path, file):
                while data := file.read(_BYTES_AT_A_TIME):
                    yield from _parsed(parser, data, place=lambda: None)
                warn(f"{path} was started afresh")
                file.close()
                file = path.open("rb")
                parser.begin()
    finally:
        file.close()


def _number(file):
    """What tells an open file from others, whatever they are called."""
    return os.fstat(file.fileno()).st_ino


def _started_afresh(path, file):
    try:
        now = path.stat()
    except OSError:
        return False
    if not stat.S_ISREG(now.st_mode):
        # A folder, or a pipe, whose opening would wait for ever.
        return False
    return now.st_size < file.tell() or not os.path.samestat(now, os.fstat(file.fileno()))


def from_folder(
    folder: Path,
    options: dict[str, Any],
    patience: Patience,
    warn: Callable[..., Any],
    place: list[Any] | None = None,
) -> Iterator[Block]:
    """Blocks from the files of a folder, in the order in which they were finished.

    A file is read when its size and time have not changed for a while. A file that comes later but
    has an older time than one that was read already is read, too, and told: somebody has copied it,
    or the clock was set back.

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
        Is told of files that cannot be read.
    place : list or None, default=None
        Time and name of the latest file that was read. Those that are older and there now count as
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
            # Links that lead nowhere, or in a circle, are no files.
            if not entry.name.startswith(".") and entry.is_file():
                status = entry.stat()
                found[status.st_mtime_ns, entry.name] = status.st_size
    return found


def _blocks_of_file(path, changed, options, warn, place):
    try:
        length = _checked_length(path, options)
        start = None
        if options["has_times"]:
            start = recording_start(path, channel=options["channel"], dtype=options["dtype"])
            if start is None:
                start = changed * 1e-9 - length / options["sampling_rate"]
        n_read = 0
        for samples, _ in _signals(path, options):
            n_read += samples.shape[1]
            yield Block(samples, start, path.name, place, is_last=n_read == length)
            start = None
    except (OSError, ValueError, ImportError, MemoryError) as error:
        warn(f"skipped: {error}")


def _checked_length(path, options):
    """Samples of a file that fits; all of it is read, so that no file is used in part."""
    length = 0
    for samples, rate in _signals(path, options):
        length += samples.shape[1]
        if not rates_agree(rate, options["sampling_rate"]):
            raise ValueError(
                f"{path}: sampled at {rate:g} Hz, expected {options['sampling_rate']:g} Hz"
            )
        if len(samples) != options["n_channels"]:
            raise ValueError(f"{path}: {len(samples)} channels, expected {options['n_channels']}")
    return length


def _signals(path, options):
    for samples, rate in recording_blocks(
        path,
        block_length(options["window_length"]),
        channel=options["channel"],
        dtype=options["dtype"],
    ):
        yield np.atleast_2d(samples), rate
