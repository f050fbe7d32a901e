"""Results on disk as they come, so that an interrupted run goes on where it stopped."""

import json
import os
import sqlite3
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import pandas as pd

from ..readers.entries import ListedRecording
from .diagnosis import Diagnosis, file_state
from .messages import CommandError

_SUFFIX = ".skarxlag-journal"
#: Identifies databases of this format.
_APPLICATION = 0x736B6C08
#: The file may be new, but no link. Nobody else may read it.
_FLAGS = os.O_RDWR | os.O_CREAT | vars(os).get("O_NOFOLLOW", 0)
_MODE = 0o600
#: A computer that stops may lose results, a process may not.
_SETUP = (
    "PRAGMA synchronous = OFF",
    "PRAGMA locking_mode = EXCLUSIVE",
    f"PRAGMA application_id = {_APPLICATION}",
    "CREATE TABLE IF NOT EXISTS results (input TEXT PRIMARY KEY, result TEXT)",
)
_REFUSAL = "exists and is no journal of this command; move it away"
_REASONS = {
    sqlite3.SQLITE_BUSY: "another run is writing these results; wait for it, or choose "
    "another -o",
    sqlite3.SQLITE_NOTADB: _REFUSAL,
}


class Journal:
    """Database next to the results of `diagnose`, which lasts until the results are written.

    It is locked. A link, or a file that is no journal, is refused. A result is found for
    the same model, settings, recording and file only. A run that fails before its first
    result leaves no file.
    """

    path: Path

    def __init__(self, output: Path, settings: list[Any]) -> None:
        self.path = output.with_name(output.name + _SUFFIX)
        self._settings = settings

    def __enter__(self) -> Self:
        """Open the database, and lock it."""
        if self.path.is_symlink() or self.path.is_dir():
            raise CommandError(f"{self.path}: {_REFUSAL}")
        os.close(os.open(self.path, _FLAGS, _MODE))
        self._database = sqlite3.connect(self.path, timeout=0, isolation_level=None)
        try:
            [(number,)] = self._execute("PRAGMA application_id")
            if number != _APPLICATION and self.path.stat().st_size > 0:
                raise CommandError(f"{self.path}: {_REFUSAL}")
            for command in _SETUP:
                self._execute(command)
        except BaseException:
            self._database.close()
            raise
        return self

    def _execute(self, command, *values):
        """Execute a command of SQL, and return its rows."""
        try:
            return self._database.execute(command, values).fetchall()
        except sqlite3.Error as error:
            reason = f"results cannot be saved there ({error})"
            reason = _REASONS.get(error.sqlite_errorcode, reason)
            raise CommandError(f"{self.path}: {reason}") from error

    def __exit__(self, kind: object, *exception: object) -> None:
        is_empty = True
        with suppress(CommandError):
            is_empty = not self._execute("SELECT input FROM results LIMIT 1")
        self._database.close()
        if kind is None or is_empty:
            self.path.unlink()
            # A run that was killed at its start leaves the log of its transaction.
            Path(f"{self.path}-journal").unlink(missing_ok=True)
        else:
            print(
                f"{self.path}: The results so far are saved. Run the same command again "
                "to continue.",
                file=sys.stderr,
            )

    def result(self, recording: ListedRecording) -> Diagnosis | None:
        """Return the result of an earlier run if the recording has not changed since, or None."""
        with suppress(OSError):
            key = self._key(recording, file_state(recording))
            query = "SELECT result FROM results WHERE input = ?"
            for (content,) in self._execute(query, key):
                entries = json.loads(content)
                windows = pd.DataFrame(entries.pop("windows"))
                return Diagnosis(windows=windows, **entries)
        return None

    def add(self, recording: ListedRecording, diagnosis: Diagnosis) -> None:
        """Keep a result. Recordings that failed are not kept, so they are tried again."""
        if diagnosis.error is not None:
            return
        windows = {name: values.tolist() for name, values in diagnosis.windows.items()}
        content = json.dumps(vars(diagnosis) | {"windows": windows})
        key = self._key(recording, diagnosis.file)
        self._execute("INSERT OR REPLACE INTO results VALUES (?, ?)", key, content)

    def _key(self, recording, state):
        """Return all that the result of a recording depends on, as text."""
        log = Path(recording.speed_source or "")
        changed = log.stat().st_mtime_ns if log.is_file() else 0
        return json.dumps([self._settings, repr(recording), state, changed])
