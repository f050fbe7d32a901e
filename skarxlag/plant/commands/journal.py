"""Results on disk as they come, so that an interrupted run goes on where it stopped."""

import json
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import pandas as pd

from ..readers.entries import ListedRecording
from .diagnosis import Diagnosis, file_state
from .messages import CommandError

_FORMAT = "skarxlag journal 5"
_START = b'{"format": "skarxlag journal'
_SUFFIX = ".skarxlag-journal"
#: A link that replaces the file at the last moment is not followed.
_FLAGS = (
    os.O_RDWR | os.O_CREAT | vars(os).get("O_NOFOLLOW", 0) | vars(os).get("O_BINARY", 0)
)


class Journal:
    """JSON lines next to the results of `diagnose`, which last until the results are written.

    The file is locked. A link, or a file that is no journal, is refused. The first line
    holds all that the results depend on but the recordings: model and settings. A run
    that fails before its first result leaves no file.
    """

    path: Path

    def __init__(self, output: Path, settings: list[Any]) -> None:
        self.path = output.with_name(output.name + _SUFFIX)
        self._head = _encoded({"format": _FORMAT, "settings": settings})

    def __enter__(self) -> Self:
        """Read the results of an earlier run if it had the same model and settings."""
        refusal = CommandError(
            f"{self.path}: exists and is no journal of this command; move it away"
        )
        if self.path.is_symlink() or (self.path.exists() and not self.path.is_file()):
            raise refusal
        self._file = open(
            self.path, "r+b", 0, opener=lambda path, _: os.open(path, _FLAGS, 0o600)
        )
        try:
            _lock(self._file)
            content = self._file.read()
            # A full disk may have kept the first bytes only.
            if not _START.startswith(content[: len(_START)]):
                raise refusal
            self._finished = self._read(content)
            self._is_empty = not self._finished
        except BaseException:
            self._file.close()
            raise
        return self

    def _read(self, content):
        head, *lines = content.splitlines(keepends=True) or [b""]
        if head != self._head:
            self._file.seek(0)
            self._file.truncate()
            self._file.write(self._head)
            return {}
        finished = {}
        for line in lines:
            # Recordings of damaged lines are diagnosed once more.
            with suppress(
                AttributeError, LookupError, TypeError, ValueError, RecursionError
            ):
                entry = json.loads(line)
                key = entry.pop("recording")
                windows = pd.DataFrame(entry.pop("windows"))
                diagnosis = Diagnosis(windows=windows, **entry)
                if diagnosis.is_whole:
                    finished[key] = diagnosis
        # The last line may be incomplete.
        self._file.write(b"\n")
        return finished

    def __exit__(self, kind: object, *exception: object) -> None:
        if kind is None or self._is_empty:
            self.path.unlink()
        else:
            print(
                f"{self.path}: The results so far are saved. Run the same command again "
                "to continue.",
                file=sys.stderr,
            )
        self._file.close()

    def result(self, recording: ListedRecording) -> Diagnosis | None:
        """Return the result of an earlier run if the recording has not changed since, or None."""
        with suppress(OSError):
            return self._finished.get(_key(recording, file_state(recording)))
        return None

    def add(self, recording: ListedRecording, diagnosis: Diagnosis) -> None:
        """Keep a result. Recordings that failed are not kept, so they are tried again."""
        if diagnosis.error is None:
            windows = {
                name: column.tolist() for name, column in diagnosis.windows.items()
            }
            line = vars(diagnosis) | {"windows": windows}
            line |= {"recording": _key(recording, diagnosis.file)}
            self._file.write(_encoded(line))
            self._is_empty = False


def _key(recording, state):
    """Return all that the result of a recording depends on, as text."""
    log = Path(recording.speed_source or "")
    return json.dumps(
        [repr(recording), state, log.stat().st_mtime_ns if log.is_file() else 0]
    )


def _encoded(line):
    return (json.dumps(line) + "\n").encode()


def _lock(file):
    """Lock a file, or raise an error if another process holds it."""
    try:
        if os.name == "nt":
            import msvcrt

            file.seek(2**30)
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
            file.seek(0)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise CommandError(
            f"{file.name}: another run is writing these results; wait for it, or choose "
            "another -o"
        ) from error
