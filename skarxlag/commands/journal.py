"""Results on disk as they come, so that an interrupted run goes on where it stopped."""

import json
import sys
from pathlib import Path
from typing import Any, Self

import pandas as pd

from .._files import write_atomically
from ..recordings.listing import ListedRecording
from .diagnosis import Diagnosis
from .models import model_digest

_FORMAT = "skarxlag journal 3"


class Journal:
    """A file of JSON lines beside the results of `diagnose`, which lasts until they are written.

    Parameters
    ----------
    output : Path
        File of the results.
    model : Path
        The model, of which the contents count.
    settings : list
        All else that results depend on, as JSON has it.
    """

    path: Any

    def __init__(self, output: Path, model: Path, settings: list[Any]) -> None:
        self.path = output.with_name(output.name + ".partial")
        self._head = {"format": _FORMAT, "model": model_digest(model), "settings": settings}
        self._file = None

    def __enter__(self) -> Self:
        """Read what an earlier run has finished, if it had the same model and settings."""
        lines = self._whole_lines()
        if not lines or lines[0] != self._head:
            lines = [self._head]
        lines = lines[:1] + [line for line in lines[1:] if _is_whole(line)]
        self._finished = {_key(line["recording"]): line["result"] for line in lines[1:]}
        # Without the line that was being written when the earlier run ended.
        write_atomically(self.path, b"".join(map(_encoded, lines)))
        self._file = self.path.open("ab")
        return self

    def __exit__(self, kind: object, *exception: Any) -> None:
        self._file.close()
        if kind is None:
            self.path.unlink()
        else:
            print(f"{self.path}: the same command goes on from here", file=sys.stderr)

    def result(self, recording: ListedRecording) -> Diagnosis | None:
        """What an earlier run found of a recording that has not changed since, or None."""
        plain = self._finished.get(_key(_identity(recording)))
        return None if plain is None else _diagnosis(plain)

    def add(self, recording: ListedRecording, diagnosis: Diagnosis) -> None:
        """Keep a result. A recording that failed is not kept: it is tried again."""
        if diagnosis.error is None:
            line = {"recording": _identity(recording), "result": _plain(diagnosis)}
            self._file.write(_encoded(line))
            self._file.flush()

    def _whole_lines(self):
        if not self.path.is_file():
            return []
        lines = []
        for text in self.path.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                lines.append(json.loads(text))
            except ValueError:
                break
        return lines


def _identity(recording):
    """What tells a recording, that its file is as it was, and what is stated beside it."""
    status = recording.path.stat()
    stated = [recording.channel, recording.sampling_rate, recording.rpm, recording.dtype]
    path = str(recording.path)
    return [recording.name, path, status.st_size, status.st_mtime_ns, json.dumps(stated)]


def _is_whole(line):
    """Whether a line holds a result; what is damaged is computed once more."""
    try:
        hash(_key(line["recording"]))
        found = _diagnosis(line["result"])
    except (KeyError, TypeError, ValueError, AttributeError):
        return False
    return isinstance(found.verdict, dict) and "verdict" in found.verdict and len(found.windows) > 0


def _encoded(line):
    return (json.dumps(line) + "\n").encode()


def _key(identity):
    return tuple(identity)


def _plain(diagnosis):
    windows = diagnosis.windows
    columns = {name: windows[name].tolist() for name in windows}
    return {
        "verdict": diagnosis.verdict,
        "windows": columns,
        "sampling_rate": diagnosis.sampling_rate,
        "remarks": diagnosis.remarks,
    }


def _diagnosis(plain):
    return Diagnosis(
        plain["verdict"],
        pd.DataFrame(plain["windows"]),
        plain["sampling_rate"],
        tuple(plain["remarks"]),
    )
