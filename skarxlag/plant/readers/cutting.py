"""Cut recordings into windows, and find the speed of each."""

import io
import os
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.speeds import speed_errors
from ...core.validation import check_count
from ...core.windows import make_windows
from .entries import ListedRecording, OpenRecording
from .formats.facts import parse_number
from .formats.rates import NO_RATE, rates_agree
from .repeated import check_repeated

#: Samples of a channel that are processed at a time, if a recording is read in parts.
_BLOCK = 2**20
#: Times within a window over which its mean speed is computed.
_N_MEAN = 64
#: Share by which the speed of a row varies before order tracking is needed. In rows of
#: a second or two, combs at the mean speed are lost from 1 to 2 % on.
_LEAST_CHANGE = 0.005


def block_length(window_length: int) -> int:
    """Return the samples of a channel to read at a time: whole windows, about a million samples.

    Examples
    --------
    >>> from skarxlag.plant.readers.cutting import block_length
    >>> block_length(1000), block_length(3_000_000)
    (1048000, 3000000)
    """
    check_count(window_length, "window_length")
    return window_length * max(_BLOCK // window_length, 1)


def cut_blocks(
    blocks: Iterable[Any], name: str, window_length: int
) -> Iterator[NDArray[Any]]:
    """Cut a recording that arrives block by block into windows.

    Parameters
    ----------
    blocks : iterable of arrays of shape (n_samples,) or (n_channels, n_samples)
        Consecutive parts of one recording, of any lengths.
    name : str
        Name for error messages.
    window_length : int
        Samples in a window.

    Yields
    ------
    ndarray of shape (n_windows, window_length) or (n_windows, n_channels,
    window_length)
        The windows that :func:`make_windows` cuts from the whole, some at a time.

    Raises
    ------
    ValueError
        If the recording is shorter than one window.

    Examples
    --------
    >>> from skarxlag.plant.readers.cutting import cut_blocks
    >>> parts = (np.arange(3), np.arange(3, 8))
    >>> [windows.tolist() for windows in cut_blocks(parts, "run", 2)]
    [[[0.0, 1.0]], [[2.0, 3.0], [4.0, 5.0], [6.0, 7.0]]]
    """
    at_a_time = block_length(window_length)
    rest = None
    n_windows = 0
    for signal in blocks:
        if rest is not None:
            signal = np.concatenate([rest, signal], axis=-1)
        n_whole = signal.shape[-1] // window_length * window_length
        for first in range(0, n_whole, at_a_time):
            part = signal[..., first : min(first + at_a_time, n_whole)]
            yield make_windows(part, window_length)
        n_windows += n_whole // window_length
        # Without the copy, a few samples would keep the whole block in memory.
        rest = signal[..., n_whole:].copy()
    if n_windows == 0:
        raise ValueError(
            f"{name}: recording has {rest.shape[-1]} samples, fewer than "
            f"window_length={window_length}; choose a shorter window (--window-length)"
        )


def thin_windows(
    parts: Iterable[Any], max_windows: int | None
) -> tuple[NDArray[Any], NDArray[Any], int]:
    """Keep some of the windows of one recording, evenly spread over it.

    Every window is kept until there are too many; then every second, every fourth, and
    so on. At least half of `max_windows` remain of a recording that has more.

    Parameters
    ----------
    parts : iterable of ndarray of shape (n_windows, ...)
        Windows in time order, some at a time.
    max_windows : int or None
        Windows to keep, at most. None keeps all.

    Returns
    -------
    windows : ndarray
        Those kept.
    position : ndarray of int, shape (n_windows,)
        Position of each among all windows.
    n_available : int
        Number of all windows.

    Examples
    --------
    >>> from skarxlag.plant.readers.cutting import thin_windows
    >>> windows, position, n_available = thin_windows([np.zeros((7, 3)), np.ones((2, 3))], 5)
    >>> position, n_available
    (array([0, 2, 4, 6, 8]), 9)
    """
    kept = {}
    step = 1
    n_seen = 0
    for window in chain.from_iterable(parts):
        if n_seen % step == 0:
            # Without the copy, one window would keep its part in memory.
            kept[n_seen] = window.copy()
        n_seen += 1
        if max_windows is not None and len(kept) > max_windows:
            step *= 2
            kept = {place: kept[place] for place in kept if place % step == 0}
    return np.stack([*kept.values()]), np.array([*kept]), n_seen


def cut_recordings(
    listed: list[ListedRecording],
    source: str | os.PathLike[str],
    window_length: int,
    max_windows: int | None = None,
    healthy: str | None = None,
    resample: float | None = None,
    note: Callable[[Any, int], Any] = lambda entry, n_windows: None,
) -> Bunch:
    """Cut listed recordings into windows.

    Parameters
    ----------
    listed : list of ListedRecording
        The recordings.
    source : path-like
        The list itself.
    window_length, max_windows, healthy, resample
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
    if max_windows is not None:
        check_count(max_windows, "max_windows")
    check_repeated(listed)
    reader = Reader(resample)
    store = io.BytesIO()
    starts = []
    available = []
    for entry in listed:
        blocks = reader.blocks(entry, block_length(window_length))
        parts = cut_blocks(blocks, str(entry.path), window_length)
        windows, position, n_available = thin_windows(parts, max_windows)
        store.write(windows)
        available.append(n_available)
        starts.append(position * window_length)
        note(entry, n_available)
    # Without a copy, or memory would hold all windows twice.
    data = np.frombuffer(store.getbuffer()).reshape(-1, *windows.shape[1:])
    facts = reader.facts()
    counts = [*map(len, starts)]
    conditions = facts.pop("condition")
    of_recordings = {
        "target": conditions,
        "specimen": facts.specimen,
        "load": facts.load,
        "rpm": facts.rpm,
        "recording": np.array(facts.recording),
    }
    rig = Bunch(
        **facts
        | {
            name: None if values is None else values.repeat(counts)
            for name, values in of_recordings.items()
        },
        data=data,
        target_names=_ordered_conditions(conditions, healthy, source),
        start=np.concatenate(starts),
        available=np.array(available),
    )
    _set_mean_speeds(rig)
    notes = [f"{len(listed)} recordings listed in {source}, cut into windows"]
    if n_thinned := np.sum(np.greater(available, counts)):
        notes.append(
            f"at most {max_windows} windows of each, fewer than there are in {n_thinned}"
        )
    for name, rate in facts.resampled.items():
        notes.append(f"{name} resampled from {rate:g} to {facts.sampling_rate:g} Hz")
    rig.DESCR = "; ".join(notes)
    return rig


def _ordered_conditions(conditions, healthy, source):
    """Return the different conditions, the healthy one first."""
    names = [] if conditions is None else list(dict.fromkeys(conditions.tolist()))
    if healthy is None:
        return names
    if healthy not in names:
        raise ValueError(
            f"healthy is {healthy!r}, which is not a condition of {source}: "
            f"{', '.join(names) or 'none is stated'}"
        )
    return [healthy, *(name for name in names if name != healthy)]


def _set_mean_speeds(rig):
    """Fill in the mean speeds of rows whose speed varies."""
    step = rig.data.shape[-1] / _N_MEAN
    for name, profile in rig.profiles.items():
        is_of_recording = rig.recording == name
        start = rig.start[is_of_recording] / step
        speeds = profile.rows(start, _N_MEAN, rig.sampling_rate / step)
        rig.rpm[is_of_recording] = speeds.mean(axis=1)


class Reader:
    """Reader of recordings that must agree in sampling rate and number of channels."""

    def __init__(self, resample: float | None) -> None:
        self._resample = resample
        self._common: dict[str, Any] = {}
        self._read: list[OpenRecording] = []

    def blocks(
        self, entry: ListedRecording, n_samples: int | None
    ) -> Iterator[NDArray[Any]]:
        """Yield the samples of a recording block by block."""
        # If one speed is unknown, none is returned, and no other is read.
        has_speeds = all(opened.entry.rpm is not None for opened in self._read)
        with entry.named():
            opened = entry.open(
                n_samples, reads_speed=has_speeds, resample=self._resample
            )
            self._read.append(opened)
            rate = opened.sampling_rate
            if rate is None:
                raise ValueError(NO_RATE)
            self._check(entry, "sampling rates (Hz)", rate, rates_agree)
            n_channels = len(opened.channels)
            self._check(entry, "numbers of channels", n_channels, int.__eq__)
            yield from opened.blocks

    def facts(self) -> Bunch:
        """Return the facts of the recordings that were read."""
        entries = [opened.entry for opened in self._read]
        names = [entry.name for entry in entries]
        loads = [entry.load or "" for entry in entries]
        numbers = [parse_number(load) for load in loads if load]
        if np.isfinite(numbers).all():
            loads = [parse_number(load) for load in loads]
        rpm = _stated_by_all(entry.rpm for entry in entries)
        profiles = (
            {} if rpm is None else {entry.name: entry.profile for entry in entries}
        )
        return Bunch(
            condition=_stated_by_all(entry.condition for entry in entries),
            specimen=_stated_by_all(e.specimen or e.condition for e in entries),
            load=np.array(loads),
            rpm=rpm,
            profiles={name: profile for name, profile in profiles.items() if profile},
            recording=names,
            sampling_rate=self._common["sampling rates (Hz)"][0],
            filenames=[str(entry.path) for entry in entries],
            further=pd.DataFrame([entry.further for entry in entries], index=names),
            resampled={
                opened.entry.name: opened.old_rate
                for opened in self._read
                if opened.old_rate is not None
            },
            channels=[opened.channels for opened in self._read],
        )

    def _check(self, entry, what, value, agree):
        first, where = self._common.setdefault(what, (value, entry.where or entry.path))
        if not agree(value, first):
            raise ValueError(f"different {what}: {value:g}, but {first:g} in {where}")


def _stated_by_all(values):
    values = list(values)
    return None if None in values else np.array(values)


def speeds_within_rows(
    rig: Bunch, least_revolutions: float = 0
) -> tuple[NDArray[Any] | None, NDArray[Any]]:
    """Return the speed of each row, or at each sample if it varies within a row.

    Parameters
    ----------
    rig : Bunch
        Result of `cut_recordings`.
    least_revolutions : float, default=0
        Revolutions of the shaft that a row needs.

    Returns
    -------
    rpm : ndarray of shape (n_rows,) or (n_rows, n_samples), or None
        Two-dimensional if the speed of a row varies by more than 0.5 %.
    errors : ndarray of str of shape (n_rows,)
        Why a row cannot be used: there is no speed above 0, it varies too much, or the
        row has too few revolutions.
    """
    n_rows = len(rig.data)
    n_samples = rig.data.shape[-1]
    if not rig.profiles:
        return rig.rpm, np.full(n_rows, "", dtype=object)
    rpm = np.repeat(rig.rpm[:, np.newaxis], n_samples, axis=1)
    for name, profile in rig.profiles.items():
        is_of_recording = rig.recording == name
        rpm[is_of_recording] = profile.rows(
            rig.start[is_of_recording], n_samples, rig.sampling_rate
        )
    errors = speed_errors(rpm, n_rows)
    is_short = n_samples * rpm.mean(axis=1) < least_revolutions * 60 * rig.sampling_rate
    errors[(errors == "") & is_short] = (
        f"the row has less than {least_revolutions} revolutions"
    )
    varies = np.ptp(rpm, axis=1) > _LEAST_CHANGE * rig.rpm
    return rpm if varies.any() else rig.rpm, errors
