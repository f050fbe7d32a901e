"""Shaft speeds of recordings: ranges, and speeds that a tachometer or a log states."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..speeds import rpm_from_tacho
from .formats._facts import seconds_of_dates
from .formats.text import number

#: Beginning of a source of speeds that is a channel of pulses.
TACHO = "tacho:"
_NUMBER = r"\s*(\d+(?:\.\d+)?)\s*"
_SPEED = re.compile(rf"{_NUMBER}(?:\.\.{_NUMBER}|(?:\+-|\+/-|±){_NUMBER}(%?)\s*)?")


@dataclass(frozen=True)
class SpeedRange:
    """Range of shaft speeds.

    Parameters
    ----------
    low, high : float
        Its ends, which belong to it, in rev/min.

    Examples
    --------
    >>> from skarxlag.recordings.speeds import SpeedRange
    >>> SpeedRange.parse("1797+-30").contains([1750, 1772, 1797])
    array([False,  True,  True])
    >>> SpeedRange.parse("1700..1800")
    SpeedRange(low=1700.0, high=1800.0)
    """

    low: float
    high: float

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a range from a text.

        Parameters
        ----------
        text : str
            ``1797`` (this speed alone), ``1797+-30`` or ``1797+-2%`` (with a tolerance; ``±`` and
            ``+/-`` do as well) or ``1700..1800``.

        Returns
        -------
        SpeedRange

        Raises
        ------
        ValueError
            If the text is nothing of this, or the range is empty or holds no speed above 0.
        """
        low = high = np.nan
        if match := _SPEED.fullmatch(text):
            speed, width = float(match[1]), float(match[3] or 0)
            width *= speed / 100 if match[4] else 1
            low, high = speed - width, float(match[2] or speed + width)
        if not (np.isfinite(high) and high > 0 and low <= high):
            raise ValueError(f"{text!r}, expected a speed such as 1797, 1797+-30 or 1700..1800")
        return cls(max(low, 0.0), high)

    def contains(self, rpm: ArrayLike) -> NDArray[Any]:
        """Return which speeds lie in the range.

        Parameters
        ----------
        rpm : array-like of float
            Speeds, rev/min.

        Returns
        -------
        ndarray of bool, shape as `rpm`
        """
        rpm = np.asarray(rpm, dtype=np.float64)
        return (rpm >= self.low) & (rpm <= self.high)

    def __str__(self) -> str:
        ends = [f"{self.low:g}"] if self.low == self.high else [f"{self.low:g}", f"{self.high:g}"]
        return "..".join(ends)


def is_speed_source(text: str) -> bool:
    """Return whether a text names a channel of pulses or a log of speeds.

    Examples
    --------
    >>> [is_speed_source(text) for text in ("tacho:pulses", "speeds.csv", "900")]
    [True, True, False]
    """
    return text.startswith(TACHO) or text.lower().endswith(".csv")


def tacho_speed(blocks: Iterable[tuple[NDArray[Any], float | None]], pulses: float) -> float:
    """Return the mean speed that the pulses of a tachometer state.

    Parameters
    ----------
    blocks : iterable of tuple (signal, rate)
        The channel of the tachometer as one block, and its sampling rate in Hz.
    pulses : float
        Pulses in a turn of the shaft, an integer.

    Raises
    ------
    ValueError
        If the sampling rate is unknown, the signal has fewer than two pulses, or `pulses` is not an
        integer.
    """
    if pulses % 1:
        raise ValueError(f"pulses_per_turn is {pulses:g}, expected an integer")
    ((signal, rate),) = blocks
    if rate is None:
        raise ValueError("sampling_rate is missing and the file does not state it")
    return float(rpm_from_tacho(signal, rate, pulses_per_turn=int(pulses)).mean())


def logged_speed(
    path: str | os.PathLike[str], names: set[str], span: Callable[[bool], tuple[float, float]]
) -> float:
    """Return the mean speed of a recording in a log.

    Parameters
    ----------
    path : str or path-like
        Csv file with the column ``rpm``, and ``recording`` (name or file) or ``time`` (dates, or
        seconds since the start of the recording).
    names : set of str
        Names of the recording.
    span : callable
        Returns the times at which the recording begins and ends. It is called with True for seconds
        since 1970, and with False for seconds since its start.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file cannot be read, has other columns, or states no speed above 0 of the recording.
        The message names the file.
    """
    try:
        options = {"engine": "python", "encoding": "utf-8-sig", "keep_default_na": False}
        log = pd.read_csv(path, sep=None, dtype=str, **options)
    except (ValueError, pd.errors.ParserError) as error:
        raise ValueError(f"{path}: cannot be read as a csv log of speeds ({error})") from error
    log.columns = log.columns.str.strip().str.lower()
    if "rpm" not in log or not {"recording", "time"} & {*log.columns}:
        raise ValueError(
            f"{path}: columns {[*log.columns]}, expected 'rpm' and 'recording' or 'time'"
        )
    if "recording" in log:
        is_own = log["recording"].str.strip().isin(names)
    else:
        times = np.array([number(text) for text in log["time"]])
        is_date = bool(np.isnan(times).all())
        begin, end = span(is_date)
        times = seconds_of_dates(log["time"]) if is_date else times
        is_own = (times >= begin) & (times <= end)
    speeds = np.array([number(text) for text in log["rpm"][is_own]])
    if not speeds.size or not np.all((speeds > 0) & np.isfinite(speeds)):
        raise ValueError(f"{path}: states no speed above 0 of the recording, or one that is none")
    return float(speeds.mean())
