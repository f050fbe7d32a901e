"""Channels of a model: those that it was fitted on, and those that it is asked about."""

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from ..recordings.entries import ListedRecording
from ..recordings.files import chosen_channels
from .messages import printable

#: Ways to write a unit, in lower case.
_SAME_UNIT = {
    "m/s^2": "m/s2",
    "m/s²": "m/s2",
    "m/s/s": "m/s2",
    "mm/sec": "mm/s",
    "g's": "g",
}


def fitted_channels(recordings: Sequence[ListedRecording]) -> dict[str, Any]:
    """Return facts of a model: its channels as they were stated, their names, and the unit.

    The names are those in the first recording for each way in which channels are
    stated. Of several channels, they are separated by semicolons. The unit is None if
    recordings state several.
    """
    # The first recording replaces later ones that state their channels alike.
    first = {str(recording.channel): recording for recording in reversed(recordings)}
    units = set(units_of(recordings))
    return {
        "channels": np.atleast_1d(recordings[0].channel or []).tolist(),
        "channel_names": sorted(
            {_joined(channels) for channels in map(_channels, first.values())}
        ),
        "unit": units.pop() if len(units) == 1 else None,
    }


def units_of(recordings: Sequence[ListedRecording]) -> list[str]:
    """Return the different units of the first channels; none if the first recording states none."""
    units: dict[str, str] = {}
    for recording in recordings:
        unit = _channels(recording)[0][1]
        if unit is None and not units:
            return []
        if unit is not None:
            units.setdefault(plain_unit(unit), printable(unit))
    return list(units.values())


def _channels(recording):
    return chosen_channels(
        recording.path, channel=recording.channel, dtype=recording.dtype
    )


def channel_remarks(
    channels: Sequence[tuple[str, str | None]], facts: dict[str, Any], asked: Any
) -> Iterator[str]:
    """Yield remarks on channels or units that are not those of a model.

    Parameters
    ----------
    channels : sequence of tuple
        Names and units of the channels that are read.
    facts : dict
        Of the model.
    asked : str, list of str or None
        Channels as they were stated, None if they were not.
    """
    names = _joined(channels)
    fitted = facts.get("channel_names") or []
    if fitted and names not in fitted and not _is_like(channels, facts, asked):
        yield f"The channel is {names}, but the model was fitted on {' or '.join(fitted)}."
    unit = channels[0][1]
    fitted_unit = facts.get("unit")
    if unit and fitted_unit and plain_unit(unit) != plain_unit(fitted_unit):
        yield (
            f"The unit is {unit}, but the model was fitted on {fitted_unit}. Another "
            "scale changes nothing, unless the model has a fixed gain; another quantity, "
            "such as velocity for acceleration, has other spectra."
        )


def _is_like(channels, facts, asked):
    """Return whether nothing shows that channels are others than those of the model."""
    stated = facts.get("channels") or []
    names = [name for name, _ in channels]
    # A bracket is part of a name such as x[0].
    patterns = [pattern.replace("[", "[[]") for pattern in stated]
    if len(stated) == len(names) and all(map(fnmatchcase, names, patterns)):
        return True
    # Files with one channel each may call it as they like.
    fitted = "; ".join(facts["channel_names"]).split("; ")
    return asked is None and (not stated or any(map(str.isdecimal, [*names, *fitted])))


def channels_of_model(facts: dict[str, Any]) -> list[list[str]]:
    """Return ways to state the channels of a model, the best first; none if they were not stated.

    A position means another channel in a file with more columns, so the name comes
    first.
    """
    stated = facts.get("channels") or []
    names = facts.get("channel_names") or []
    by_name = [names[0].split("; ")] if len(names) == 1 else []
    return [*by_name, stated] if all(stated) and stated else []


def _joined(channels):
    return printable("; ".join(name for name, _ in channels))


def plain_unit(unit: str) -> str:
    """Return one way to write a unit.

    >>> plain_unit(" m/s^2"), plain_unit("G's")
    ('m/s2', 'g')
    """
    unit = unit.strip().lower()
    return _SAME_UNIT.get(unit, unit)
