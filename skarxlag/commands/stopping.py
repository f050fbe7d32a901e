"""A clean end on Ctrl-C and on the signal that asks a program to end."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self


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
