"""Read the signals or the windows of all recordings of a table, a folder or a glob."""

import io
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ..core.speeds import speed_errors
from ..core.validation import check_count
from .formats.text import number
from .listing import ListedRecording, list_recordings
from .rates import NO_RATE, rates_agree, resampled_blocks
from .repeated import check_repeated
from .windows import block_length, cut_blocks, thin_windows

#: Share by which the speed of a row varies before order tracking is needed. In rows of
#: a second or two, combs at the mean speed are lost from 1 to 2 % on.
_LEAST_CHANGE = 0.005
#: Times within a window over which its mean speed is computed.
_N_MEAN = 64


def read_recording_table(
    path: str | os.PathLike[str],
    *,
    pattern: str | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    sampling_rate: float | None = None,
    dtype: str | None = None,
    resample: float | None = None,
) -> Bunch:
    r"""Read all recordings that a table, a folder or a glob lists.

    The table is a text file (UTF-8) with one recording in a line. Its separator is the
    comma, the semicolon or the tabulator, whichever its first line holds most of. These
    are its columns, in any order and any case, of which only ``path`` must be there:

    - ``path``: the file, absolute or relative to the folder of the table; see
      :func:`read_recording` for the formats.
    - ``condition``: the state of the machine, any text. Needed to fit a diagnoser, not
      to diagnose.
    - ``specimen``: the bearing, any text. Recordings of one bearing have the same
      specimen, also if its condition changed. Without this column, each condition is
      one specimen.
    - ``load``: the load of the machine, a number or a text.
    - ``rpm``: the shaft speed, rev/min. Not needed if the file states it in a number or
      channel called ``rpm``. ``tacho:CHANNEL`` takes it from the pulses of a tachometer
      in that channel; a csv file with the columns ``rpm`` and ``recording`` or ``time``
      may state it, too.
    - ``pulses_per_revolution``: pulses of the tachometer in a turn of the shaft; 1 if it is
      not stated.
    - ``sampling_rate``: in Hz, or in the unit that a column ``sampling_rate_unit``
      states, such as kHz. Not needed if the file states it; if both do, they must agree
      within 0.1 %.
    - ``channel``: name, position or pattern of the channel, see :func:`read_recording`;
      several are separated by ``;``, the output first and then the inputs. Empty takes
      the only channel of the file.
    - ``dtype``: type of the samples of a raw binary file, see :func:`read_recording`.

    Any other column is kept and comes back as it is. A column that is there is filled
    in every line, except ``load``, ``channel``, ``sampling_rate``, ``dtype`` and
    columns of other names.

    Parameters
    ----------
    path : str or path-like
        The table. Or, instead of a table: a folder, of which all files with a known
        suffix are read, also in folders below; or a glob such as ``runs/*/acc_*.tdms``.
    pattern : str, default=None
        For a folder or a glob: a regular expression that is searched for in the path of
        each file (below the folder, with ``/``). Its named groups are ``condition``,
        ``specimen``, ``load``, ``rpm``, ``sampling_rate`` and ``channel``; groups of
        other names are kept like unknown columns.
        ``(?P<condition>[A-Z]+)_(?P<rpm>\d+)`` fits ``OR_1200.mat``.
    channel, sampling_rate, dtype : default=None
        Of all recordings for which neither the table nor the pattern states it.
    resample : float, default=None
        Sampling rate in Hz to which a polyphase filter resamples all recordings, see
        :func:`skarxlag.recordings.rates.resampled_blocks`. None leaves them as they
        are, and differing rates are an error.

    Returns
    -------
    table : :class:`~sklearn.utils.Bunch`
        With the following attributes, all in the order of the table or of the paths.

        recordings : list of ndarray of float64
            Of shape (n_samples,) or, if several channels are named, (n_channels,
            n_samples). The number of samples may differ between recordings.
        condition : ndarray of str, or None
            None if the conditions are not stated.
        specimen : ndarray of str, or None
            The condition if no specimen is stated. None if neither is stated.
        load : ndarray of float or of str
            Texts if one of the loads is no number. A load that is not stated is NaN, or
            empty among texts.
        rpm : ndarray of float, or None
            Mean speeds. None if the speed of a recording is stated neither outside the
            file nor in it.
        profiles : dict of str to tuple of two ndarrays
            Times since the first sample in seconds, and speeds, of the recordings of
            which a channel or a log states the speed over time.
        recording : list of str
            Id of each recording: its path as in the table, followed by a colon and the
            channel if the table lists the file more than once.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files.
        further : DataFrame
            The columns of other names, one row for each recording, texts.
        resampled : dict of str to float
            The recordings that were resampled, and the rates in Hz that they had.

    Raises
    ------
    FileNotFoundError
        If the table, or a file that it lists, does not exist.
    ValueError
        If the table is empty, misspells a column, has an empty or wrong field, the same
        recording twice (also by a link or a copy), conditions that look alike (``1``
        and ``01``), differing sampling rates or numbers of channels, or a recording
        that :func:`read_recording` refuses; if `pattern` does not fit a file or is
        given for a table; and if each line of a table states what an argument states.
        The message names the table, the line and the file.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag import read_recording_table
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     folder = pathlib.Path(folder)
    ...     np.save(folder / "a.npy", np.zeros(5))
    ...     np.save(folder / "b.npy", np.ones(7))
    ...     lines = ["path,condition,rpm,sampling_rate,load", "a.npy,good,300,50e3,low",
    ...              "b.npy,worn,300,50e3,high"]
    ...     _ = (folder / "table.csv").write_text("\n".join(lines))
    ...     table = read_recording_table(folder / "table.csv")
    >>> table.condition
    array(['good', 'worn'], dtype='<U4')
    >>> [signal.shape for signal in table.recordings]
    [(5,), (7,)]
    >>> table.load.tolist()
    ['low', 'high']
    """
    facts = {
        "pattern": pattern,
        "channel": channel,
        "sampling_rate": sampling_rate,
        "dtype": dtype,
    }
    listed = list_recordings(path, **facts)
    check_repeated(listed)
    reader = _Reader(resample)
    recordings = [
        np.concatenate([*reader.blocks(each, None)], axis=-1) for each in listed
    ]
    return Bunch(recordings=recordings, **reader.facts(listed))


def load_recordings(
    path: str | os.PathLike[str],
    *,
    window_length: int = 1200,
    hop: int | None = None,
    max_windows: int | None = None,
    healthy: str | None = None,
    pattern: str | None = None,
    channel: str | int | Sequence[str | int] | None = None,
    sampling_rate: float | None = None,
    dtype: str | None = None,
    resample: float | None = None,
    memory_map: str | os.PathLike[str] | None = None,
) -> Bunch:
    r"""Load the windows of all recordings of a table, a folder or a glob, as a rig.

    Recordings are read block by block, so that memory holds no more than the windows.
    If these are too many, reduce their number by `hop` or `max_windows`, or keep them
    on disk by `memory_map`.

    Parameters
    ----------
    path : str or path-like
        The table, a folder or a glob, see :func:`read_recording_table`.
    window_length : int, default=1200
        Samples in a window.
    hop : int, default=None
        Samples from the start of one window to the start of the next. None takes
        `window_length`; more than that leaves out samples between windows. The tail of
        a recording that does not fill a window is left out.
    max_windows : int, default=None
        Windows of each recording, at most, at least 1. Of a recording that has more,
        every second, fourth, eighth, ... window is kept, so that they are spread over
        all of it. None keeps all.
    healthy : str, default=None
        The healthy condition. None takes the condition in the first line of the table.
    pattern, channel, sampling_rate, dtype, resample
        As in :func:`read_recording_table`.
    memory_map : str or path-like, default=None
        A file that the windows are written to; an existing one is replaced. `data` is
        then read from it as it is used, and may be larger than memory. None keeps the
        windows in memory.

    Returns
    -------
    rig : :class:`~sklearn.utils.Bunch`
        With the following attributes.

        data : ndarray of float64, shape (n_windows[, n_channels], window_length)
            Windows: recording after recording, in time order within each.
        target : ndarray of str, shape (n_windows,), or None
            Condition of each window. None if the table has no conditions.
        specimen : ndarray of str, shape (n_windows,), or None
            Bearing of each window: its condition if no specimen is stated. None if
            neither is stated.
        load : ndarray of float or of str, shape (n_windows,)
            Load of each window. Texts if one of the loads is no number. A load that is
            not stated is NaN, or empty among texts.
        target_names : list of str
            The conditions, the healthy one first, then in the order of the table.
        rpm : ndarray of float, shape (n_windows,), or None
            Mean shaft speed of the window, rev/min. None if the speed of a recording is
            not known.
        profiles : dict of str to tuple of two ndarrays
            As in :func:`read_recording_table`.
        recording : ndarray of str, shape (n_windows,)
            Recording that the window was cut from.
        start : ndarray of int, shape (n_windows,)
            Index of the window's first sample in its recording, counted after
            resampling.
        available : ndarray of int, shape (n_recordings,)
            Windows that there are in each recording; `max_windows` may have kept fewer.
        sampling_rate : float
            In Hz.
        filenames : list of str
            Paths of the files, in the order of the table.
        further : DataFrame
            The table's columns of other names, one row for each recording.
        resampled : dict of str to float
            The recordings that were resampled, and the rates in Hz that they had.
        DESCR : str
            Which table this is, and what was left out or resampled.

    Raises
    ------
    FileNotFoundError, ValueError
        As in :func:`read_recording_table`; if a recording is shorter than one window;
        if `max_windows` is below 1; if `memory_map` is among the files that are read;
        and if `healthy` is not a condition of the table.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import numpy as np
    >>> from skarxlag import load_recordings
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     folder = pathlib.Path(folder)
    ...     np.save(folder / "good_300.npy", np.zeros(5))
    ...     rig = load_recordings(folder, window_length=2, sampling_rate=50e3,
    ...                           pattern=r"(?P<condition>[a-z]+)_(?P<rpm>\d+)")
    >>> rig.data.shape, rig.target, rig.start
    ((2, 2), array(['good', 'good'], dtype='<U4'), array([0, 2]))
    """
    facts = {
        "pattern": pattern,
        "channel": channel,
        "sampling_rate": sampling_rate,
        "dtype": dtype,
    }
    listed = list_recordings(path, **facts)
    return cut_recordings(
        listed, path, window_length, hop, max_windows, healthy, resample, memory_map
    )


def cut_recordings(
    listed: list[ListedRecording],
    source: str | os.PathLike[str],
    window_length: int,
    hop: int | None = None,
    max_windows: int | None = None,
    healthy: str | None = None,
    resample: float | None = None,
    memory_map: str | os.PathLike[str] | None = None,
    note: Callable[[Any, int], Any] = lambda entry, n_windows: None,
) -> Bunch:
    """Cut listed recordings into windows.

    Parameters
    ----------
    listed : list of ListedRecording
        The recordings.
    source : path-like
        The list itself.
    window_length, hop, max_windows, healthy, resample, memory_map
        As in `load_recordings`.
    note : callable
        Called with each recording that was read and the number of its windows.

    Returns
    -------
    Bunch
        As `load_recordings` returns it.

    Raises
    ------
    FileNotFoundError, ValueError
        As in `load_recordings`.
    """
    check_count(window_length, "window_length")
    hop = window_length if hop is None else check_count(hop, "hop")
    if max_windows is not None:
        check_count(max_windows, "max_windows")
    check_repeated(listed)
    inputs = {
        Path(file).resolve() for file in (source, *(entry.path for entry in listed))
    }
    if memory_map is not None and Path(memory_map).resolve() in inputs:
        raise ValueError(
            f"memory_map={str(memory_map)!r} is among the files that are read"
        )
    reader, starts, available = _Reader(resample), [], []
    with (
        nullcontext(io.BytesIO())
        if memory_map is None
        else open(memory_map, "wb") as store
    ):
        for entry in listed:
            blocks = reader.blocks(entry, block_length(window_length))
            parts = cut_blocks(blocks, str(entry.path), window_length, hop)
            if max_windows is not None:
                windows, position, n_available = thin_windows(parts, max_windows)
                parts = [windows]
            n_windows = 0
            for windows in parts:
                store.write(windows)
                n_windows += len(windows)
            if max_windows is None:
                position, n_available = np.arange(n_windows), n_windows
            available.append(n_available)
            starts.append(position * hop)
            note(entry, n_available)
    if memory_map is None:
        # Without a copy, or memory would hold all windows twice.
        data = np.frombuffer(store.getbuffer())
    else:
        data = np.memmap(memory_map, np.float64, "r")
    table = reader.facts(listed)
    conditions = (
        [] if table.condition is None else list(dict.fromkeys(table.condition.tolist()))
    )
    if healthy is not None:
        if healthy not in conditions:
            raise ValueError(
                f"healthy={healthy!r} is not a condition of {source}: {conditions}"
            )
        conditions.sort(key=lambda condition: condition != healthy)
    counts = [len(start) for start in starts]
    row = np.repeat(np.arange(len(listed)), counts)
    notes = [f"{len(listed)} recordings listed in {source}, cut into windows"]
    if thinned := np.sum(np.greater(available, counts)):
        notes.append(
            f"at most {max_windows} windows of each, fewer than there are in {thinned}"
        )
    for name, rate in table.resampled.items():
        notes.append(f"{name} resampled from {rate:g} to {table.sampling_rate:g} Hz")
    speeds, targets, names = (
        table.pop(each) for each in ("rpm", "condition", "recording")
    )
    specimens = table.pop("specimen")
    loads = table.pop("load")
    if speeds is not None:
        speeds = np.repeat(speeds, counts)
        for name, profile in table.profiles.items():
            i = names.index(name)
            speeds[row == i] = _mean_speeds(
                profile, starts[i], window_length, table.sampling_rate
            )
    return Bunch(
        data=data.reshape(-1, *windows.shape[1:]),
        target=None if targets is None else targets[row],
        target_names=conditions,
        specimen=None if specimens is None else specimens[row],
        load=loads[row],
        rpm=speeds,
        recording=np.array(names)[row],
        start=np.concatenate(starts),
        available=np.array(available),
        DESCR="; ".join(notes),
        **table,
    )


def _mean_speeds(profile, start, n_samples, sampling_rate):
    """Return the mean speed of each row."""
    step = n_samples / _N_MEAN
    return profile.rows(start / step, _N_MEAN, sampling_rate / step).mean(axis=1)


def join_windows(rig: Bunch, n_windows: int) -> Bunch:
    """Join consecutive windows of recordings to rows, as if they had been cut in rows.

    Parameters
    ----------
    rig : Bunch
        Result of `cut_recordings` that holds all windows of each recording, without a
        hop. Its data are overwritten.
    n_windows : int
        Windows in a row. The last windows of a recording that do not fill a row are
        left out.

    Returns
    -------
    Bunch
        The rows, as `cut_recordings` returns them.

    Examples
    --------
    >>> rig = Bunch(data=np.arange(10.0).reshape(5, 2), start=np.array([0, 2, 4, 0, 2]), rpm=None,
    ...             recording=np.array(["a", "a", "a", "b", "b"]), available=np.array([3, 2]))
    >>> rows = join_windows(rig, 2)
    >>> rows.data.tolist(), rows.start.tolist(), rows.recording.tolist(), rows.available.tolist()
    ([[0.0, 1.0, 2.0, 3.0], [6.0, 7.0, 8.0, 9.0]], [0, 0], ['a', 'b'], [1, 1])
    """
    n_old, *n_channels, window_length = rig.data.shape
    position, n_own = (
        rig.start // window_length,
        np.repeat(rig.available, rig.available),
    )
    first = np.flatnonzero(
        (position % n_windows == 0) & (position + n_windows <= n_own)
    )
    windows = rig.data.reshape(n_old, -1)
    for row, start in enumerate(first):
        # Memory would hold all windows twice, were they not moved within it.
        joined = np.moveaxis(rig.data[start : start + n_windows], 0, -2)
        place = row * n_windows
        windows[place : place + n_windows] = joined.reshape(n_windows, -1)
    data = windows[: len(first) * n_windows].reshape(len(first), *n_channels, -1)
    rows = rig | {"data": data, "available": rig.available // n_windows}
    for name in {
        "target",
        "specimen",
        "load",
        "rpm",
        "recording",
        "start",
    } & rig.keys():
        rows[name] = None if rig[name] is None else rig[name][first]
    for name, profile in rig.get("profiles", {}).items():
        own = rows["recording"] == name
        speeds = _mean_speeds(
            profile, rows["start"][own], data.shape[-1], rig.sampling_rate
        )
        rows["rpm"][own] = speeds
    return Bunch(**rows)


def speeds_of_samples(
    rig: Bunch, least_revolutions: float = 0
) -> tuple[NDArray[Any] | None, NDArray[Any]]:
    """Return the speed of each row, or at each sample if it varies within a row.

    Parameters
    ----------
    rig : Bunch
        Result of `cut_recordings`.
    least_turns : float, default=0
        Turns of the shaft that a row needs.

    Returns
    -------
    rpm : ndarray of shape (n_rows,) or (n_rows, n_samples), or None
        Two-dimensional if the speed of a row varies by more than 0.5 %.
    errors : ndarray of str of shape (n_rows,)
        Why a row cannot be used: there is no speed above 0, it varies too much, or the
        row has too few turns.
    """
    n_rows, n_samples = len(rig.data), rig.data.shape[-1]
    if not rig.profiles:
        return rig.rpm, np.full(n_rows, "", dtype=object)
    rpm = np.repeat(rig.rpm[:, np.newaxis], n_samples, axis=1)
    for name, profile in rig.profiles.items():
        own = rig.recording == name
        rpm[own] = profile.rows(rig.start[own], n_samples, rig.sampling_rate)
    errors = speed_errors(rpm, n_rows)
    is_short = n_samples * rpm.mean(axis=1) < least_revolutions * 60 * rig.sampling_rate
    errors[(errors == "") & is_short] = (
        f"the row has less than {least_revolutions} turns"
    )
    varies = np.ptp(rpm, axis=1) > _LEAST_CHANGE * rig.rpm
    return rpm if varies.any() else rig.rpm, errors


def _loads(texts: list[str]) -> NDArray[Any]:
    """Convert the loads of recordings to numbers, unless one of them is another text."""
    numbers = np.array([number(text) for text in texts])
    is_stated = np.array(texts) != ""
    return numbers if np.isfinite(numbers[is_stated]).all() else np.array(texts)


class _Reader:
    """Reader of recordings that must agree in sampling rate and number of channels."""

    def __init__(self, resample: float | None) -> None:
        self._resample, self._common, self._resampled = resample, {}, {}

    def blocks(
        self, entry: ListedRecording, n_samples: int | None
    ) -> Iterator[NDArray[Any]]:
        blocks = entry.blocks(n_samples)
        if self._resample is not None:
            note = partial(self._resampled.__setitem__, entry.name)
            blocks = resampled_blocks(blocks, self._resample, note=note)
        with entry.named():
            for signal, rate in blocks:
                if rate is None:
                    raise ValueError(NO_RATE)
                self._check(entry, "sampling rates (Hz)", rate, rates_agree)
                n_channels = 1 if signal.ndim == 1 else len(signal)
                self._check(entry, "numbers of channels", n_channels, int.__eq__)
                yield signal

    def facts(self, listed: list[ListedRecording]) -> Bunch:
        """Return the facts of the recordings."""
        names = [entry.name for entry in listed]
        conditions = [entry.condition for entry in listed]
        specimens = [entry.specimen or entry.condition for entry in listed]
        # If one speed is unknown, none is returned, and the other files are not opened.
        entries = (entry.with_speed() for entry in listed)
        known = list(takewhile(lambda entry: entry.rpm is not None, entries))
        if len(known) < len(listed):
            known = []
        return Bunch(
            condition=None if None in conditions else np.array(conditions),
            specimen=None if None in specimens else np.array(specimens),
            load=_loads([entry.load or "" for entry in listed]),
            rpm=np.array([entry.rpm for entry in known]) if known else None,
            profiles={
                each.name: each.profile for each in known if each.profile is not None
            },
            recording=names,
            sampling_rate=self._common["sampling rates (Hz)"][0],
            filenames=[str(entry.path) for entry in listed],
            further=pd.DataFrame([entry.further for entry in listed], index=names),
            resampled=self._resampled,
        )

    def _check(self, entry, what, value, agree):
        first, where = self._common.setdefault(what, (value, entry.where or entry.path))
        if not agree(value, first):
            raise ValueError(f"different {what}: {value:g}, but {first:g} in {where}")
