"""Rows over time from results of ``diagnose`` and from logs of ``watch``."""

import io
import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any

import pandas as pd

from ..commands.files import MARK, WINDOWS_HEAD
from ..commands.messages import CommandError

#: Columns of the rows, which all sources share.
COLUMNS = (
    "time",
    "sensor",
    "kind",
    "verdict",
    "healthy",
    "probability",
    "alarm",
    "alarm_level",
    "p_value",
    "velocity_rms",
    "model",
    "problem",
)
_NUMBERS = ("probability", "alarm", "alarm_level", "p_value", "velocity_rms")
#: Columns of results that state a time or a sensor, the best first.
TIMES = ("stated_time", "stated_date", "stated_start", "file_time")
SENSORS = ("stated_sensor", "stated_machine")
#: Lines of a log that are parsed together.
_CHUNK = 100_000


def read_rows(
    paths: Iterable[Path], time: str | None = None, sensor: str | None = None
) -> pd.DataFrame:
    """Read results and logs.

    Parameters
    ----------
    paths : iterable of Path
        Results as .csv, .json or .parquet, or logs of JSON lines.
    time, sensor : str or None, default=None
        Columns of results; None: the first of `TIMES` and `SENSORS` that they have.

    Returns
    -------
    DataFrame
        The `COLUMNS`, in the order of time. ``time`` is in UTC. If no row has a time, it
        is the number of the row; otherwise rows without a time are left out. ``alarm``
        is 1, 0 or NaN.

    Raises
    ------
    CommandError
        If a file is of another kind, has no such column, or holds a time that cannot be
        read.
    """
    frames = [_read(path, time, sensor) for path in paths]
    rows = pd.concat(frames, ignore_index=True)
    if rows["time"].isna().all():
        return rows.assign(time=range(1, len(rows) + 1))
    rows = rows.dropna(subset="time")
    return rows.sort_values("time", kind="stable", ignore_index=True)


def _read(path, time, sensor):
    with path.open("rb") as file:
        start = file.read(4096)
    try:
        if path.suffix.lower() == ".parquet":
            return _of_results(path, pd.read_parquet(path), time, sensor)
        if start.startswith(b"recording,"):
            if start.startswith(WINDOWS_HEAD):
                raise CommandError(
                    f"{path}: this is a table of windows; expected that of recordings, "
                    f"{path.name.replace('_windows', '')}"
                )
            return _of_results(path, pd.read_csv(path), time, sensor)
        if MARK.encode() in start and path.suffix.lower() == ".json":
            content = json.loads(path.read_text("utf-8"))
            return _of_results(path, pd.DataFrame(content["recordings"]), time, sensor)
        return _of_log(path)
    except (ValueError, LookupError, TypeError, ImportError) as error:
        raise CommandError(f"{path}: {' '.join(str(error).split())}") from error


def _of_results(path, table, time, sensor):
    """Return the rows of results."""
    missing = [name for name in (time, sensor) if name and name not in table]
    missing += sorted({"recording", "verdict", "alarm"} - {*table.columns})
    if missing:
        shown = ", ".join(map(str, table.columns))
        raise CommandError(f"{path}: no column {missing[0]}; it has {shown}")
    rows = table.assign(kind="verdict")
    rows["alarm"] = table["alarm"].map({"yes": 1.0, "no": 0.0})
    rows = rows.rename(columns={"velocity_rms_mm_s": "velocity_rms"})
    of_time = time or _first_filled(table, TIMES)
    if of_time is None:
        rows["time"] = pd.NaT
    else:
        try:
            rows["time"] = pd.to_datetime(table[of_time], utc=True, format="ISO8601")
        except ValueError as error:
            raise CommandError(
                f"{path}: column {of_time} holds no dates such as 2026-11-26 ({error})"
            ) from error
    of_sensor = sensor or _first_filled(table, SENSORS)
    rows["sensor"] = (
        "" if of_sensor is None else table[of_sensor].fillna("").astype(str)
    )
    return _with_types(rows.reindex(columns=COLUMNS))


def _first_filled(table, names):
    """Return the first of some columns that holds something, or None."""
    filled = [name for name in names if name in table and table[name].notna().any()]
    return filled[0] if filled else None


def _of_log(path):
    """Return the rows of a log. Lines that are cut or damaged are left out."""
    with path.open(encoding="utf-8", errors="replace") as file:
        frames = [*_chunks(file)]
    if not frames:
        raise CommandError(
            f"{path}: expected results of diagnose (.csv, .json, .parquet) or the lines "
            "that watch writes"
        )
    rows = pd.concat(frames, ignore_index=True)
    rows["time"] = pd.to_datetime(rows["time"], utc=True, format="ISO8601")
    return rows


def _chunks(file: io.TextIOBase) -> Iterator[pd.DataFrame]:
    while lines := [*islice(file, _CHUNK)]:
        entries = []
        for line in lines:
            with suppress(ValueError, RecursionError):
                entry = json.loads(line)
                if isinstance(entry, dict) and {"kind", "time", "sensor"} <= {*entry}:
                    entries.append({name: entry.get(name) for name in COLUMNS})
        if entries:
            yield _with_types(pd.DataFrame(entries, columns=COLUMNS))


def _with_types(rows: pd.DataFrame) -> pd.DataFrame:
    numbers: dict[str, Any] = {
        name: pd.to_numeric(rows[name].astype(object), errors="coerce").astype(float)
        for name in _NUMBERS
    }
    return rows.assign(**numbers)
