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
_APPLICATION = 0x736B6C06
#: The file may be new, but no link. Nobody else may read it.
_FLAGS = os.O_RDWR | os.O_CREAT | vars(os).get("O_NOFOLLOW", 0)
_MODE = 0o600


class Journal:
    """Database next to the results of `diagnose`, which lasts until the results are written.

    It is locked. A link, or a file that is no journal, is refused. The results of
    another model or of other settings are dropped. A run that fails before its first
    result leaves no file.
    """

    path: Path

    def __init__(self, output: Path, settings: list[Any]) -> None:
        self.path = output.with_name(output.name + _SUFFIX)
        self._settings = json.dumps(settings)

    def __enter__(self) -> Self:
        """Open the database, and keep its results if it has the same model and settings."""
        refusal = CommandError(
            f"{self.path}: exists and is no journal of this command; move it away"
        )
        if self.path.is_symlink() or self.path.is_dir():
            raise refusal
        os.close(os.open(self.path, _FLAGS, _MODE))
        self._database = sqlite3.connect(self.path, timeout=0, isolation_level=None)
        try:
            self._open(refusal)
        except BaseException as error:
            self._database.close()
            if not isinstance(error, sqlite3.Error):
                raise
            if "locked" in str(error):
                raise CommandError(
                    f"{self.path}: another run is writing these results; wait for it, "
                    "or choose another -o"
                ) from error
            raise (self._failure(error) if "disk" in str(error) else refusal) from error
        return self

    def _open(self, refusal):
        execute = self._database.execute
        # A computer that stops may lose results, a process may not.
        execute("PRAGMA synchronous = OFF")
        execute("PRAGMA locking_mode = EXCLUSIVE")
        execute("BEGIN EXCLUSIVE")
        if execute("SELECT COUNT(*) FROM sqlite_master").fetchone() == (0,):
            execute(f"PRAGMA application_id = {_APPLICATION}")
            execute("CREATE TABLE settings (settings TEXT)")
            execute("CREATE TABLE results (recording TEXT PRIMARY KEY, result TEXT)")
        elif execute("PRAGMA application_id").fetchone()[0] != _APPLICATION:
            raise refusal
        if execute("SELECT settings FROM settings").fetchall() != [(self._settings,)]:
            execute("DELETE FROM settings")
            execute("DELETE FROM results")
            execute("INSERT INTO settings VALUES (?)", [self._settings])
        execute("COMMIT")

    def _failure(self, error):
        return OSError(f"{self.path}: results cannot be saved there ({error})")

    def __exit__(self, kind: object, *exception: object) -> None:
        is_empty = True
        with suppress(sqlite3.Error):
            counted = self._database.execute("SELECT COUNT(*) FROM results")
            is_empty = counted.fetchone() == (0,)
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
        with suppress(OSError, sqlite3.Error):
            key = _key(recording, file_state(recording))
            found = self._database.execute(
                "SELECT result FROM results WHERE recording = ?", [key]
            )
            for (content,) in found:
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
        key = _key(recording, diagnosis.file)
        try:
            self._database.execute(
                "INSERT OR REPLACE INTO results VALUES (?, ?)", [key, content]
            )
        except sqlite3.Error as error:
            raise self._failure(error) from error


def _key(recording, state):
    """Return all that the result of a recording depends on, as text."""
    log = Path(recording.speed_source or "")
    return json.dumps(
        [repr(recording), state, log.stat().st_mtime_ns if log.is_file() else 0]
    )
