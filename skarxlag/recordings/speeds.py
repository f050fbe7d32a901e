"""Shaft speeds of recordings over time, that a tachometer or a log states."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .formats._facts import seconds_of_dates
from .formats.text import number

if TYPE_CHECKING:
    import pandas as pd

#: Beginning of a source of speeds that is a channel of pulses.
TACHO = "tacho:"
#: Seconds on which the levels of pulses in a stream are measured. Two pulses in this
#: time are a speed.
_TACHO_SECONDS = 4.0
#: Even times over which a mean is computed.
_N_MEAN = 1000
#: Speed as 1.797 or 1,797 for 1797. A slow machine may have three digits before a
#: point.
_THOUSANDS = re.compile(r"([1-9]\d?)[.,](\d{3})")


def is_speed_source(text: str) -> bool:
    """Return whether a text names a channel of pulses or a log of speeds.

    Examples
    --------
    >>> [is_speed_source(text) for text in ("tacho:pulses", "speeds.csv", "900")]
    [True, True, False]
    """
    return text.startswith(TACHO) or text.lower().endswith(".csv")


def check_stated_speed(text: str) -> None:
    """Refuse the text of a speed that may have a separator of thousands.

    Raises
    ------
    ValueError
        If one or two digits are followed by a point or a comma and three digits.

    Examples
    --------
    >>> check_stated_speed("1797.5")
    >>> check_stated_speed("1.797")
    Traceback (most recent call last):
        ...
    ValueError: rpm is '1.797', which means 1797 or 1.797; write 1797, or 1.7970
    """
    if match := _THOUSANDS.fullmatch(text.strip()):
        whole, decimals = match.groups()
        either = f"{whole}{decimals} or {whole}.{decimals}"
        advice = f"write {whole}{decimals}, or {whole}.{decimals}0"
        raise ValueError(f"rpm is {text!r}, which means {either}; {advice}")


class SpeedProfile(NamedTuple):
    """Shaft speed of a recording over time.

    Attributes
    ----------
    seconds : ndarray of shape (n_times,)
        Times since the first sample, ascending.
    rpm : ndarray of shape (n_times,)
        Speeds. They are interpolated linearly between the times, and constant beyond
        them.

    Examples
    --------
    >>> profile = SpeedProfile(np.array([0.0, 1.0]), np.array([600.0, 900.0]))
    >>> profile.rows(np.array([0, 20]), 20, sampling_rate=40)[:, [0, 10]]
    array([[600., 675.],
           [750., 825.]])
    """

    seconds: NDArray[Any]
    rpm: NDArray[Any]

    def mean(self) -> float:
        """Return the mean over time."""
        even = np.linspace(self.seconds[0], self.seconds[-1], _N_MEAN)
        return float(np.interp(even, *self).mean())

    def rows(
        self, start: NDArray[Any], n_samples: int, sampling_rate: float
    ) -> NDArray[Any]:
        """Return the speeds of rows at each sample.

        Parameters
        ----------
        start : ndarray of int of shape (n_rows,)
            Position of the first sample of each row in the recording.
        n_samples : int
            Samples in a row.
        sampling_rate : float
            In Hz.

        Returns
        -------
        ndarray of shape (n_rows, n_samples)
        """
        samples = np.asarray(start)[:, np.newaxis] + np.arange(n_samples)
        return np.interp(samples / sampling_rate, *self)


class TachoStream:
    """Speed of a shaft from the pulses of a tachometer that arrive in blocks.

    The speed at a sample follows from the last two pulses before it, or from the time
    since the last pulse if that is longer. The levels of a pulse are those of
    :func:`rpm_from_tacho` in the last complete four seconds, unless their range is less
    than half of the range before: the shaft then stands still. The speeds do not depend
    on how the signal is cut into blocks.

    Parameters
    ----------
    sampling_rate : float
        In Hz.
    pulses : int
        Pulses in a turn of the shaft.

    Examples
    --------
    >>> pulses = np.arange(10_000) % 100 < 10              # at 1000 Hz, 10 in a second
    >>> tacho = TachoStream(1000.0, pulses=2)
    >>> speeds = np.concatenate([tacho.speeds(part) for part in np.split(pulses * 1.0, 4)])
    >>> speeds[3999], speeds[5000:].round(6).tolist() == [300.0] * 5000
    (np.float64(nan), True)
    """

    def __init__(self, sampling_rate: float, pulses: int) -> None:
        self._n, self._scale = (
            int(_TACHO_SECONDS * sampling_rate),
            60 * sampling_rate / pulses,
        )
        self._signal, self._levels = np.empty(0), (0.0, 0.0)

    def speeds(self, signal: NDArray[Any]) -> NDArray[Any]:
        """Return the speed at each of the next samples, NaN if it is not known."""
        import pandas as pd

        signal, found = pd.Series(signal).ffill().fillna(0.0).to_numpy(), []
        first = self._n - len(self._signal) % self._n
        for part in np.split(signal, range(first, len(signal), self._n)):
            self._signal = np.append(self._signal, part)
            found.append(self._speeds_of_last(len(part)))
            if len(self._signal) in (self._n, 2 * self._n):
                from ..core.speeds import pulse_levels

                self._signal = self._signal[-self._n :]
                quarter, middle = pulse_levels(self._signal)
                if middle - quarter >= 0.5 * (self._levels[1] - self._levels[0]):
                    self._levels = quarter, middle
        return np.concatenate(found)

    def _speeds_of_last(self, n_new):
        from ..core.speeds import pulse_times

        times = pulse_times(self._signal, *self._levels)
        if len(times) < 2:
            return np.full(n_new, np.nan)
        samples = np.arange(len(self._signal) - n_new, len(self._signal))
        last = np.searchsorted(times, samples) - 1
        intervals = np.diff(times)[np.maximum(last - 1, 0)]
        intervals = np.maximum(intervals, samples - times[last])
        return np.where(last > 0, self._scale / intervals, np.nan)


def read_texts(path: str | os.PathLike[str], **options: Any) -> pd.DataFrame:
    """Read a csv table as texts. The sign that its first line holds most of separates.

    Parameters
    ----------
    path : str or path-like
        Text in UTF-8, separated by commas, semicolons or tabulators.
    **options
        As `pandas.read_csv` takes them.

    Raises
    ------
    FileNotFoundError, ValueError
        If the file cannot be read. The message names it.
    """
    import pandas as pd

    try:
        with open(path, encoding="utf-8-sig") as file:
            separator = max(",;\t", key=file.readline().count)
        options |= {"encoding": "utf-8-sig", "sep": separator, "keep_default_na": False}
        return pd.read_csv(path, dtype=str, **options)
    except ValueError as error:
        raise ValueError(f"{path}: cannot be read as a csv table ({error})") from error


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
        If the file cannot be read, has other columns, or states no speed above 0 of the
        recording. The message names the file.
    """
    log = read_texts(path)
    log.columns = log.columns.str.strip().str.lower()
    if "rpm" not in log or not {"recording", "time"} & {*log.columns}:
        raise ValueError(
            f"{path}: columns {[*log]}, expected 'rpm' and 'recording' or 'time'"
        )
    if "recording" in log:
        own = log[log["recording"].str.strip().isin(names)]
    else:
        times = log["time"].map(number)
        is_date = bool(times.isna().all())
        begin, end = span(is_date)
        log["seconds"] = (seconds_of_dates(log["time"]) if is_date else times) - begin
        own = log[log["seconds"].between(0, end - begin)].sort_values(
            "seconds", kind="stable"
        )
    speeds = own["rpm"].map(number).to_numpy(dtype=np.float64)
    if not np.all((speeds >= 0) & np.isfinite(speeds)) or not speeds.any():
        raise ValueError(
            f"{path}: states no speed above 0 of the recording, or one that is none"
        )
    if "recording" in log:
        return float(speeds.mean())
    return SpeedProfile(own["seconds"].to_numpy(), speeds)
