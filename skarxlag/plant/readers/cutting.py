"""Cut the recordings of a list into windows."""

import io
import os
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ...core.validation import check_count
from .entries import ListedRecording, OpenRecording
from .formats.facts import number
from .formats.rates import NO_RATE, rates_agree
from .repeated import check_repeated
from .speeds import SpeedProfile
from .windows import block_length, cut_blocks, thin_windows

#: Times within a window over which its mean speed is computed.
_N_MEAN = 64


def cut_recordings(
    listed: list[ListedRecording],
    source: str | os.PathLike[str],
    window_length: int,
    hop: int | None = None,
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
    window_length, hop, max_windows, healthy, resample
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
    reader = Reader(resample)
    store = io.BytesIO()
    starts = []
    available = []
    for entry in listed:
        blocks = reader.blocks(entry, block_length(window_length))
        parts = cut_blocks(blocks, str(entry.path), window_length, hop)
        if max_windows is None:
            n_available = 0
            for windows in parts:
                store.write(windows)
                n_available += len(windows)
            position = np.arange(n_available)
        else:
            windows, position, n_available = thin_windows(parts, max_windows)
            store.write(windows)
        available.append(n_available)
        starts.append(position * hop)
        note(entry, n_available)
    # Without a copy, or memory would hold all windows twice.
    data = np.frombuffer(store.getbuffer())
    facts = reader.facts()
    counts = [len(start) for start in starts]
    row = np.repeat(np.arange(len(listed)), counts)
    rpm = facts.rpm
    if rpm is not None:
        rpm = np.repeat(rpm, counts)
        for name, profile in facts.profiles.items():
            i = facts.recording.index(name)
            rpm[row == i] = mean_speeds(
                profile, starts[i], window_length, facts.sampling_rate
            )
    of_rows = {
        "target": None if facts.condition is None else facts.condition[row],
        "specimen": None if facts.specimen is None else facts.specimen[row],
        "load": facts.load[row],
        "rpm": rpm,
        "recording": np.array(facts.recording)[row],
    }
    conditions = _ordered_conditions(facts.pop("condition"), healthy, source)
    notes = [f"{len(listed)} recordings listed in {source}, cut into windows"]
    if n_thinned := np.sum(np.greater(available, counts)):
        notes.append(
            f"at most {max_windows} windows of each, fewer than there are in {n_thinned}"
        )
    for name, rate in facts.resampled.items():
        notes.append(f"{name} resampled from {rate:g} to {facts.sampling_rate:g} Hz")
    return Bunch(
        **facts
        | of_rows
        | {
            "data": data.reshape(-1, *windows.shape[1:]),
            "target_names": conditions,
            "start": np.concatenate(starts),
            "available": np.array(available),
            "DESCR": "; ".join(notes),
        }
    )


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


def mean_speeds(
    profile: SpeedProfile, start: NDArray[Any], n_samples: int, sampling_rate: float
) -> NDArray[Any]:
    """Return the mean speed of each row."""
    step = n_samples / _N_MEAN
    return profile.rows(start / step, _N_MEAN, sampling_rate / step).mean(axis=1)


def _loads(texts: list[str]) -> NDArray[Any]:
    """Convert the loads of recordings to numbers, unless one of them is another text."""
    numbers = np.array([number(text) for text in texts])
    is_stated = np.array(texts) != ""
    return numbers if np.isfinite(numbers[is_stated]).all() else np.array(texts)


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
        listed = [opened.entry for opened in self._read]
        names = [entry.name for entry in listed]
        conditions = [entry.condition for entry in listed]
        specimens = [entry.specimen or entry.condition for entry in listed]
        speeds = [entry.rpm for entry in listed]
        has_speeds = None not in speeds
        return Bunch(
            condition=None if None in conditions else np.array(conditions),
            specimen=None if None in specimens else np.array(specimens),
            load=_loads([entry.load or "" for entry in listed]),
            rpm=np.array(speeds) if has_speeds else None,
            profiles={
                entry.name: entry.profile
                for entry in listed
                if has_speeds and entry.profile is not None
            },
            recording=names,
            sampling_rate=self._common["sampling rates (Hz)"][0],
            filenames=[str(entry.path) for entry in listed],
            further=pd.DataFrame([entry.further for entry in listed], index=names),
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
