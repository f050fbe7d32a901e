"""Files of results: a row for each recording and a row for each window, in the format asked for."""

import io
import json
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from .._files import write_atomically
from ..recordings.listing import ListedRecording
from .diagnosis import Diagnosis
from .errors import CommandError, UsageError, printable

#: Found in every file of results, so that a later run may replace it.
MARK = "skarxlag results 1"
SUFFIXES = (".csv", ".json", ".parquet", ".html")
_HEADS = (b"recording,verdict,confidence,", b"recording,start,verdict,alarm,")


def result_paths(output: Path) -> list[Path]:
    """The files that are written for an output.

    Examples
    --------
    >>> from pathlib import Path
    >>> [path.name for path in result_paths(Path("july.csv"))]
    ['july.csv', 'july_windows.csv']
    >>> [path.name for path in result_paths(Path("july.html"))]
    ['july.html']
    """
    if output.suffix.lower() in (".json", ".html"):
        return [output]
    return [output, output.with_name(f"{output.stem}_windows{output.suffix}")]


def check_output(
    output: Path,
    inputs: Iterable[Any],
    *,
    is_own: Callable[..., Any],
    force: bool,
    suffixes: Sequence[str] | None = None,
) -> None:
    """Refuse an output that cannot be meant, before anything is computed.

    Parameters
    ----------
    output : Path
        The file.
    inputs : iterable of path-like
        Files that are read.
    is_own : callable
        Whether an existing file is of the kind that is to be written.
    force : bool
        Whether a file of any other kind may be replaced.
    suffixes : sequence of str or None, default=None
        Expected ones; None for any.

    Raises
    ------
    UsageError
        If the suffix is another, the folder does not exist, the file is among the inputs, or it
        exists and is of another kind.
    """
    where = f"argument -o/--output: {output}"
    if suffixes is not None and output.suffix.lower() not in suffixes:
        raise UsageError(f"{where}, expected a name that ends in {', '.join(suffixes)}")
    if not output.parent.is_dir() or output.is_dir():
        raise UsageError(f"{where}, expected a file in a folder there")
    if not output.exists():
        return
    if any(os.path.exists(each) and output.samefile(each) for each in inputs):
        raise UsageError(f"{where} is an input, which is not replaced")
    if output.is_file() and output.stat().st_size and not force and not is_own(output):
        raise UsageError(f"{where} exists and was not written by this command; --force replaces it")


def is_result_file(path: Path) -> bool:
    """Whether a file is one of results, of any format."""
    with path.open("rb") as file:
        start = file.read(4096)
        file.seek(max(path.stat().st_size - 65536, 0))
        end = file.read()
    return start.startswith(_HEADS) or MARK.encode() in start or MARK.encode() in end


def recording_rows(recordings: list[ListedRecording], diagnoses: list[Diagnosis]) -> pd.DataFrame:
    """One row for each recording.

    Parameters
    ----------
    recordings : list
        What was diagnosed.
    diagnoses : list of Diagnosis
        What came of it.

    Returns
    -------
    DataFrame
        ``recording``; the entries of its verdict; ``remark``; ``error``; and what the table of
        recordings states of it.
    """
    rows = [
        {"recording": printable(recording.name)}
        | diagnosis.verdict
        | {"remark": " ".join(diagnosis.remarks), "error": printable(diagnosis.error or "")}
        | stated_columns(recording)
        for recording, diagnosis in zip(recordings, diagnoses, strict=True)
    ]
    table = pd.DataFrame(rows)
    first = ["recording", "verdict", "confidence", "windows", "no signal", "alarms"]
    first += [name for name in ("p-value", "none of these") if name in table]
    table = table.reindex(columns=[*first, *(name for name in table if name not in first)])
    types = {"windows": "Int64", "no signal": "Int64", "none of these": "boolean"}
    return table.astype({name: kind for name, kind in types.items() if name in table})


def stated_columns(recording: ListedRecording) -> dict[str, Any]:
    """What the table, or the name of the file, states of a recording."""
    stated = {"condition": recording.condition, "rpm": recording.rpm}
    stated = {name: value for name, value in stated.items() if value is not None}
    return stated | {f"stated {name}": value for name, value in recording.further.items()}


def window_rows(recordings: list[ListedRecording], diagnoses: list[Diagnosis]) -> pd.DataFrame:
    """One row for each window of the recordings that did not fail."""
    frames = []
    for recording, diagnosis in zip(recordings, diagnoses, strict=True):
        if diagnosis.windows is not None:
            windows = diagnosis.windows.copy()
            windows.insert(0, "recording", printable(recording.name))
            frames.append(windows)
    columns = ["recording", "start", "verdict", "alarm", "quality"]
    return pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=columns)


def write_tables(
    output: Path, recordings: pd.DataFrame, windows: pd.DataFrame, head: dict[str, Any]
) -> None:
    """Write csv, json or parquet.

    Parameters
    ----------
    output : Path
        Its suffix tells the format.
    recordings, windows : DataFrame
        Of `recording_rows` and `window_rows`.
    head : dict
        What a json file states of the model.

    Raises
    ------
    CommandError
        If a library is missing.
    OSError
        If a file cannot be written.
    """
    suffix = output.suffix.lower()
    if suffix == ".json":
        return write_atomically(output, _json(recordings, windows, head))
    for path, frame in zip(result_paths(output), (recordings, windows), strict=True):
        content = frame.to_csv(index=False).encode() if suffix == ".csv" else _parquet(frame)
        write_atomically(path, content)


def _json(recordings, windows, head):
    by_recording = dict(iter(windows.drop(columns="recording").groupby(windows["recording"])))
    rows = [
        row | {"window_rows": _records(by_recording.get(row["recording"]))}
        for row in _records(recordings)
    ]
    return (json.dumps({"format": MARK} | head | {"recordings": rows}) + "\n").encode()


def _records(frame):
    """Rows as JSON has them: what is missing is null."""
    if frame is None:
        return []
    return frame.astype(object).where(frame.notna(), None).to_dict("records")


def _parquet(frame):
    file = io.BytesIO()
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise CommandError("writing .parquet needs pyarrow: pip install 'skarxlag[io]'") from error
    table = pa.Table.from_pandas(frame, preserve_index=False)
    table = table.replace_schema_metadata((table.schema.metadata or {}) | {"kind": MARK})
    parquet.write_table(table, file)
    return file.getvalue()
