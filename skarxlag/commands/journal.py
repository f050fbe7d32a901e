"""Results on disk as they come, so that an interrupted run goes on where it stopped."""

import json
import os
import sys
from pathlib import Path
from typing import Any, Self

import pandas as pd

from ..recordings.listing import ListedRecording
from .diagnosis import Diagnosis, file_state
from .messages import CommandError
from .models import model_digest

_FORMAT = "skarxlag journal 4"
_SUFFIX = ".skarxlag-journal"


class Journal:
    """A file of JSON lines next to the results of `diagnose`, which lasts until they are written.

    The file is created exclusively and locked. A link, or a file that is no journal, is refused.

    Parameters
    ----------
    output : Path
        File of the results.
    model : Path
        The model, of which the contents count.
    settings : list
        Everything else that results depend on, as JSON has it.
    """

    path: Path

    def __init__(self, output: Path, model: Path, settings: list[Any]) -> None:
        self.path = output.with_name(output.name + _SUFFIX)
        self._head = {"format": _FORMAT, "model": model_digest(model), "settings": settings}

    def __enter__(self) -> Self:
        """Read the results of an earlier run if it had the same model and settings."""
        self._file = self._opened()
        try:
            lines = self._whole_lines()
        except BaseException:
            self._file.close()
            raise
        if not lines or lines[0] != self._head:
            lines = [self._head]
        lines = lines[:1] + [line for line in lines[1:] if _is_whole(line)]
        self._finished = {_key(line["recording"]): line["result"] for line in lines[1:]}
        self._file.seek(0)
        self._file.truncate()
        self._file.write(b"".join(map(_encoded, lines)))
        self._file.flush()
        return self

    def __exit__(self, kind: object, *exception: Any) -> None:
        if kind is None:
            self.path.unlink()
        else:
            print(f"{self.path}: the same command goes on from here", file=sys.stderr)
        self._file.close()

    def result(self, recording: ListedRecording) -> Diagnosis | None:
        """Return the result of an earlier run if the recording has not changed since, or None."""
        try:
            state = file_state(recording)
        except OSError:
            return None
        plain = self._finished.get(_key(_identity(recording, state)))
        return None if plain is None else _diagnosis(plain, state)

    def add(self, recording: ListedRecording, diagnosis: Diagnosis) -> None:
        """Keep a result. Recordings that failed are not kept, so they are tried again."""
        if diagnosis.error is None:
            identity = _identity(recording, diagnosis.file)
            self._file.write(_encoded({"recording": identity, "result": _plain(diagnosis)}))
            self._file.flush()

    def _opened(self):
        refusal = f"{self.path}: exists and is no journal of this command; move it away"
        flags = os.O_RDWR | vars(os).get("O_BINARY", 0)
        try:
            descriptor = os.open(self.path, flags | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            if self.path.is_symlink() or not self.path.is_file():
                raise CommandError(refusal) from None
            descriptor = os.open(self.path, flags | vars(os).get("O_NOFOLLOW", 0))
        file = os.fdopen(descriptor, "r+b")
        try:
            _lock(file)
        except OSError as error:
            file.close()
            raise CommandError(
                f"{self.path}: another run is writing these results; wait for it, or choose "
                "another -o"
            ) from error
        start = file.read(64)
        if start and not start.startswith(b'{"format": "skarxlag journal'):
            file.close()
            raise CommandError(refusal)
        return file

    def _whole_lines(self):
        self._file.seek(0)
        lines = []
        for text in self._file.read().decode("utf-8", "replace").splitlines():
            try:
                lines.append(json.loads(text))
            except ValueError:
                break
        return lines


def _lock(file):
    """Lock a file until it is closed; raise OSError if another process holds it."""
    if os.name == "nt":
        import msvcrt

        file.seek(2**30)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        file.seek(0)
    else:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _identity(recording, state):
    """Name, path and state of a recording, and what is stated about it."""
    stated = [recording.channel, recording.sampling_rate, recording.rpm, recording.dtype]
    return [recording.name, str(recording.path), *state, json.dumps(stated)]


def _is_whole(line):
    """Whether a line holds a result; recordings of damaged lines are diagnosed once more."""
    try:
        hash(_key(line["recording"]))
        found = _diagnosis(line["result"], ())
    except (KeyError, TypeError, ValueError, AttributeError):
        return False
    return isinstance(found.verdict, dict) and "verdict" in found.verdict and len(found.windows) > 0


def _encoded(line):
    return (json.dumps(line) + "\n").encode()


def _key(identity):
    return tuple(identity)


def _plain(diagnosis):
    windows = diagnosis.windows
    return {
        "verdict": diagnosis.verdict,
        "windows": {name: windows[name].tolist() for name in windows},
        "sampling_rate": diagnosis.sampling_rate,
        "remarks": diagnosis.remarks,
    }


def _diagnosis(plain, state):
    return Diagnosis(
        plain["verdict"],
        pd.DataFrame(plain["windows"]),
        plain["sampling_rate"],
        tuple(plain["remarks"]),
        file=state,
    )
