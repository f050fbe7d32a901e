"""Files of results: rows of recordings and of windows in several formats."""

import json
import re
from pathlib import Path
from typing import Any

import pandas as pd

from ...persistence.files import write_atomically
from ...verdicts.names import NO_VERDICT
from ..readers.formats.facts import distinct
from ..readers.listing import ListedRecording
from .diagnosis import Diagnosis
from .files import result_paths
from .messages import percent, printable

_FIRST = [
    "recording",
    "verdict",
    "probability",
    "alarm",
    "p-value",
    "windows",
    "no signal",
]
_FIRST_OF_WINDOWS = ["start", "verdict", "alarm", "quality"]
#: First characters of a text, or after a semicolon, that a spreadsheet would run as a
#: formula, also in full width.
_FORMULA = re.compile("(^|;)([=+@\uff1d\uff0b\uff0d\uff20-])")


def recording_rows(
    recordings: Any, diagnoses: list[Diagnosis], model: Any
) -> pd.DataFrame:
    """Return a row for each recording: verdict, healthy condition, remarks, error, stated facts."""
    rows = []
    for recording, diagnosis in zip(recordings, diagnoses, strict=True):
        # A recording that was not diagnosed has an error, such as an implausible speed.
        verdict = str(diagnosis.verdict["verdict"])
        error = verdict.partition(f"{NO_VERDICT}: ")[2]
        time = diagnosis.file[1] if diagnosis.file else None
        stated = {"specimen": recording.specimen, "load": recording.load}
        rows.append(
            dict.fromkeys(_FIRST)
            | diagnosis.verdict
            | {
                "recording": printable(recording.name),
                "healthy": model.healthy,
                "remark": " ".join(diagnosis.remarks),
                "error": printable(error),
                "condition": recording.condition,
                "rpm": recording.rpm,
                "file_time": time,
            }
            | {
                f"stated {name}": text
                for name, text in (stated | recording.further).items()
                if text is not None
            }
        )
    table = pd.DataFrame(rows).astype({"windows": "Int64", "no signal": "Int64"})
    times = pd.to_datetime(table["file_time"]).dt.strftime("%Y-%m-%dT%H:%M:%SZ")
    table = table.assign(alarm=table["alarm"].fillna("-"), file_time=times)
    return machine_names(table)


def window_rows(
    recordings: list[ListedRecording], diagnoses: list[Diagnosis]
) -> pd.DataFrame:
    """Return a row for each window; the index is the position of its recording."""
    frames = {
        place: diagnosis.windows
        for place, diagnosis in enumerate(diagnoses)
        if diagnosis.windows is not None
    }
    frames = frames or {0: pd.DataFrame(columns=_FIRST_OF_WINDOWS)}
    windows = pd.concat(frames).droplevel(1)
    names = [printable(recording.name) for recording in recordings]
    windows.insert(0, "recording", [names[place] for place in windows.index])
    return machine_names(windows)


def machine_names(table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose column names have no blanks and are unique.

    >>> list(machine_names(pd.DataFrame(columns=["p-value", "share of a b", "share of a_b"])))
    ['p_value', 'share_of_a_b', 'share_of_a_b.1']
    """
    plain = [
        "_".join(str(name).replace("p-value", "p_value").split()) for name in table
    ]
    return table.set_axis(distinct(plain), axis=1)


def write_tables(
    output: Path, recordings: Any, windows: Any, summary: dict[str, Any]
) -> None:
    """Write csv, json or parquet, as the suffix says; json holds the summary of the model, too."""
    suffix = output.suffix.lower()
    tables = [recordings, windows]
    if suffix == ".json":
        rows = [row | {"window_rows": []} for row in records(recordings)]
        of_windows = records(windows.drop(columns="recording"))
        for place, row in zip(windows.index, of_windows, strict=True):
            rows[place]["window_rows"].append(row)
        content = json.dumps({"model": summary, "recordings": rows})
        contents = [f"{content}\n".encode()]
    elif suffix == ".csv":
        contents = [csv_of(table).encode() for table in tables]
    else:
        contents = [frame.to_parquet(engine="pyarrow", index=False) for frame in tables]
    for path, content in zip(result_paths(output), contents, strict=True):
        write_atomically(path, content, follows_links=False)


def csv_of(table: pd.DataFrame, **options: Any) -> str:
    r"""Return a table as csv whose texts no spreadsheet runs as a formula.

    Control characters are escaped. An apostrophe stands before the first character of a
    formula, also after a separator of other countries.

    Examples
    --------
    >>> print(csv_of(pd.DataFrame({"name": ["=1+1", "a;=2", "b\x1b[2J"]})))
    name
    '=1+1
    a;'=2
    b\x1b[2J
    """
    texts = table.select_dtypes(["object", "string", "category"])
    safe = table.assign(**texts.astype(object).map(_inert))
    return safe.rename(columns=_inert, index=_inert).to_csv(
        **{"index": False} | options
    )


def _inert(value):
    """Return a text that a spreadsheet and a terminal show as it is."""
    if not isinstance(value, str) or len(value) < 2:
        return value
    return _FORMULA.sub(r"\1'\2", printable(value))


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return rows as JSON has them: missing values are None."""
    return frame.astype(object).where(frame.notna(), None).to_dict("records")


def verdict_table(rows: pd.DataFrame) -> str:
    """Return a line of text for each recording: stated facts, verdict, probability, alarm.

    >>> rows = pd.DataFrame({
    ...     "recording": ["run_1.npy"], "verdict": ["good"], "probability": [0.5],
    ...     "alarm": ["no"], "p_value": [0.25],
    ... })
    >>> print(verdict_table(rows))
              verdict probability        alarm
    run_1.npy    good       50.0%  no (p 0.25)
    """
    table = rows.set_index("recording").rename_axis(None)
    p_values = table["p_value"].map(" (p {:.2g})".format, na_action="ignore")
    table["alarm"] += p_values.fillna("")
    shown = ["condition", "rpm", "verdict", "probability", "alarm"]
    table = table.reindex(columns=shown).dropna(axis=1, how="all")
    forms = {"rpm": "{: g}".format, "probability": percent}
    return table.to_string(formatters=forms, na_rep="-")
