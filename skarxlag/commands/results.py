"""Files of results: a row for each recording and a row for each window, in the format asked for."""

import io
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from .._files import write_atomically
from ..recordings.listing import ListedRecording
from .diagnosis import Diagnosis
from .messages import CommandError, UsageError, printable

#: Found in every file of results, so that a later run may replace it.
MARK = "skarxlag results 1"
SUFFIXES = (".csv", ".json", ".parquet", ".html")
_HEADS = (b"recording,verdict,probability,alarm,", b"recording,start,verdict,alarm,")
#: First characters of a text that a spreadsheet would run as a formula.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_SHORTEST_NAME = 12


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


def recording_rows(
    recordings: list[ListedRecording], diagnoses: list[Diagnosis], healthy: str | None
) -> pd.DataFrame:
    """Return one row for each recording.

    Parameters
    ----------
    recordings : list
        The recordings.
    diagnoses : list of Diagnosis
        Their results.
    healthy : str or None
        The healthy condition.

    Returns
    -------
    DataFrame
        ``recording``; the entries of its verdict, ``healthy``, ``remark`` and ``error``; and facts
        of the recording that its table states. Names of columns have no blanks.
    """
    rows = [
        {"recording": printable(recording.name)}
        | diagnosis.verdict
        | {"healthy": healthy, "remark": " ".join(diagnosis.remarks)}
        | {"error": printable(diagnosis.error or "")}
        | stated_columns(recording)
        for recording, diagnosis in zip(recordings, diagnoses, strict=True)
    ]
    first = ["recording", "verdict", "probability", "alarm", "p-value", "windows", "no signal"]
    table = pd.DataFrame(rows)
    table = table.reindex(columns=[*first, *(name for name in table if name not in first)])
    table["alarm"] = table["alarm"].fillna("-")
    return machine_names(table.astype({"windows": "Int64", "no signal": "Int64"}))


def machine_names(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose column names have no blanks and are unique.

    Examples
    --------
    >>> list(machine_names(pd.DataFrame(columns=["p-value", "share of a b", "share of a_b"])))
    ['p_value', 'share_of_a_b', 'share_of_a_b_2']
    """
    names = []
    for name in map(str, table.columns):
        stem = "_".join(name.replace("p-value", "p_value").split())
        number = 1 + sum(each == stem or each.startswith(f"{stem}_") for each in names)
        taken = stem in names
        names.append(f"{stem}_{number}" if taken else stem)
    return table.set_axis(names, axis=1)


def stated_columns(recording: ListedRecording) -> dict[str, Any]:
    """What the table, or the name of the file, states of a recording."""
    stated = {"condition": recording.condition, "rpm": recording.rpm}
    stated = {name: value for name, value in stated.items() if value is not None}
    return stated | {f"stated {name}": value for name, value in recording.further.items()}


def window_rows(recordings: list[ListedRecording], diagnoses: list[Diagnosis]) -> pd.DataFrame:
    """Return one row for each window; the index is the position of its recording."""
    frames = []
    for place, (recording, diagnosis) in enumerate(zip(recordings, diagnoses, strict=True)):
        if diagnosis.windows is not None:
            windows = diagnosis.windows.set_axis([place] * len(diagnosis.windows))
            windows.insert(0, "recording", printable(recording.name))
            frames.append(windows)
    columns = ["recording", "start", "verdict", "alarm", "quality"]
    return machine_names(pd.concat(frames) if frames else pd.DataFrame(columns=columns))


def write_tables(
    output: Path, recordings: pd.DataFrame, windows: pd.DataFrame, head: dict[str, Any]
) -> None:
    """Write csv, json or parquet.

    Parameters
    ----------
    output : Path
        Its suffix determines the format.
    recordings : DataFrame
        Of `recording_rows`.
    windows : DataFrame
        Of `window_rows`; its index is the position of the recording.
    head : dict
        Facts of the model for a json file.

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
        write_atomically(path, _csv(frame) if suffix == ".csv" else _parquet(frame))


def _csv(frame):
    """Text that no spreadsheet runs: an apostrophe stands before the first sign of a formula."""
    texts = frame.select_dtypes(["object", "string"])
    safe = frame.assign(**{name: texts[name].map(_inert) for name in texts})
    return safe.rename(columns=_inert).to_csv(index=False).encode()


def _inert(value):
    is_formula = isinstance(value, str) and len(value) > 1 and value.startswith(_FORMULA)
    return f"'{value}" if is_formula else value


def _json(recordings, windows, head):
    by_place = dict(iter(windows.drop(columns="recording").groupby(level=0)))
    rows = [
        row | {"window_rows": _records(by_place.get(place))}
        for place, row in enumerate(_records(recordings))
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


def verdict_table(rows: pd.DataFrame, *, width: int | None = None) -> str:
    """Return one line of text for each recording: verdict, probability, alarm.

    Parameters
    ----------
    rows : DataFrame
        Of `recording_rows`.
    width : int or None, default=None
        Characters in a line. None: those of the terminal, or no limit if there is no terminal. If
        the lines are longer, the names of the recordings are cut at the front.

    Returns
    -------
    str
        The lines under a heading.

    Examples
    --------
    >>> rows = pd.DataFrame({
    ...     "recording": ["a/long/path/to/run_1.npy"], "verdict": ["good"], "probability": [0.5],
    ...     "alarm": ["no"], "p_value": [0.25],
    ... })
    >>> print(verdict_table(rows, width=54))
                          verdict probability        alarm
    …ng/path/to/run_1.npy    good       50.0%  no (p 0.25)
    """
    if width is None:
        width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 10**6
    stated = [name for name in ("condition", "rpm") if name in rows and rows[name].notna().any()]
    table = rows.set_index("recording").rename_axis(None)[[*stated, "verdict"]]
    table["probability"] = rows["probability"].map("{:.1%}".format, na_action="ignore").array
    if table["probability"].isna().all():
        table = table.drop(columns="probability")
    table["alarm"] = [
        alarm if pd.isna(p) else f"{alarm} (p {p:.2g})"
        for alarm, p in zip(rows["alarm"], rows["p_value"], strict=True)
    ]
    if "rpm" in table:
        table["rpm"] = table["rpm"].map("{:g}".format, na_action="ignore")
    table = table.astype(object).where(table.notna(), "-")
    excess = _width(table) - width
    if excess > 0:
        longest = max(max(map(len, table.index)) - excess, _SHORTEST_NAME)
        table.index = [
            name if len(name) <= longest else "…" + name[1 - longest :] for name in table.index
        ]
    return table.to_string()


def _width(table):
    return max(map(len, table.to_string().splitlines()))
