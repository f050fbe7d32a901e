"""Logs of shaft speeds."""

import os
from collections.abc import Callable

import numpy as np
import pandas as pd

from .formats.facts import (
    distinct,
    is_ambiguous,
    meanings,
    parse_number,
    seconds_of_date,
)
from .recording_tables import read_cells
from .speeds import HIGHEST_RPM, SpeedProfile


def logged_speed(
    path: str | os.PathLike[str],
    names: set[str],
    span: Callable[[bool], tuple[float, float]],
) -> float | SpeedProfile:
    """Return the speed of a recording in a log: the mean of its rows, or over time.

    Parameters
    ----------
    path : str or path-like
        Csv file with the column ``rpm``, and ``recording`` (name or file) or ``time``
        (dates, or seconds since the start of the recording).
    names : set of str
        Names of the recording.
    span : callable
        Returns the times at which the recording begins and ends. It is called with True
        for seconds since 1970, and with False for seconds since its start.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file cannot be read, has other columns, states no speed above 0 of the
        recording, or may have separators of thousands. The message names the file.
    """
    header, rows = read_cells(path, "rpm")
    columns = distinct([name.lower() for name in header])
    if "rpm" not in columns or not {"recording", "time"} & {*columns}:
        raise ValueError(
            f"{path}: the columns are {', '.join(columns)}; expected rpm, and "
            "recording or time"
        )
    log = pd.DataFrame(list(rows.values()), columns=columns)
    # Speeds such as 1.797 may be 1797, unless one shows that the point is decimal.
    with_sign = [text for text in log["rpm"] if {*".,"} & {*text}]
    if with_sign and all(is_ambiguous(text, HIGHEST_RPM) for text in with_sign):
        raise ValueError(f"{path}: rpm is {meanings(with_sign[0])}")
    log["rpm"] = log["rpm"].map(parse_number)
    if "recording" in log:
        log = log[log["recording"].isin(names)]
    else:
        is_date = bool(log["time"].map(parse_number).isna().all())
        begin, end = span(is_date)
        log["seconds"] = (
            log["time"].map(seconds_of_date if is_date else parse_number) - begin
        )
        log = log[log["seconds"].between(0, end - begin)].sort_values("seconds")
    speeds = log["rpm"].to_numpy(float)
    if not np.all((speeds >= 0) & np.isfinite(speeds)) or not speeds.any():
        raise ValueError(
            f"{path}: the log states no speed above 0 of the recording, or a text that "
            "is no speed"
        )
    if "recording" in log:
        return float(speeds.mean())
    return SpeedProfile(log["seconds"].to_numpy(), speeds)
