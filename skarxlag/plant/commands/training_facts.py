"""Facts of the training recordings, and how another recording differs from them."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from ..readers.entries import ListedRecording
from .messages import printable

#: Stated facts of a recording that decide where the limits of an alarm hold, and the names
#: under which those of the training are saved.
_SAVED = {"load": "loads", "specimen": "specimens", "campaign": "campaigns"}
#: Ways to write a unit, in lower case.
_SAME_UNIT = {
    "m/s^2": "m/s2",
    "m/s²": "m/s2",
    "m/s/s": "m/s2",
    "mm/sec": "mm/s",
    "g's": "g",
}
#: Name and unit of each channel of a recording.
Channels = Sequence[tuple[str, str | None]]


def facts_of_training(
    recordings: Sequence[ListedRecording], channels: Sequence[Channels]
) -> dict[str, Any]:
    """Return facts of a model: loads, specimens, campaigns, channels and unit of its training.

    The names of the channels are those in the first recording for each way in which
    channels are stated. Of several channels, they are separated by semicolons. The unit
    is None if recordings state several.

    Parameters
    ----------
    recordings : sequence of ListedRecording
        The recordings.
    channels : sequence of sequence of tuple
        Name and unit of each channel of each recording.
    """
    names: dict[str, str] = {}
    values: dict[str, set[str]] = {}
    for recording, named in zip(recordings, channels, strict=True):
        names.setdefault(str(recording.channel), _joined(named))
        for name, value in _stated(recording).items():
            values.setdefault(_SAVED[name], set()).add(value)
    units = units_of(channels)
    return {name: sorted(stated) for name, stated in values.items()} | {
        "channels": np.atleast_1d(recordings[0].channel or []).tolist(),
        "channel_names": sorted({*names.values()}),
        "unit": units[0] if len(units) == 1 else None,
    }


def _stated(recording):
    campaign = recording.further.get("campaign")
    facts = {name: getattr(recording, name) for name in ("load", "specimen")}
    facts["campaign"] = campaign
    return {name: str(value) for name, value in facts.items() if value is not None}


def _joined(channels):
    return printable("; ".join(name for name, _ in channels))


def units_of(channels: Sequence[Channels]) -> list[str]:
    """Return the different units of the first channels; none if the first recording states none."""
    first = [unit for (_, unit), *_ in channels]
    if first[0] is None:
        return []
    units: dict[str, str] = {}
    for unit in first:
        if unit is not None:
            units.setdefault(plain_unit(unit), printable(unit))
    return list(units.values())


def plain_unit(unit: str) -> str:
    """Return one way to write a unit.

    >>> plain_unit(" m/s^2"), plain_unit("G's")
    ('m/s2', 'g')
    """
    unit = unit.strip().lower()
    return _SAME_UNIT.get(unit, unit)


def why_no_limits(
    facts: dict[str, Any],
    recording: ListedRecording,
    channels: Channels,
    other_bearing: str | None = None,
) -> str:
    """Return which fact differs from all training, or an empty text if none does.

    Parameters
    ----------
    facts : dict
        Of the model.
    recording : ListedRecording
        The recording as it was stated.
    channels : sequence of tuple
        Names and units of the channels that are read.
    other_bearing : str or None, default=None
        Its bearing, if it is not that of the training.

    Examples
    --------
    >>> from pathlib import Path
    >>> recording = ListedRecording(None, "run", Path("run.npy"), load="11")
    >>> why_no_limits({"loads": ["0"]}, recording, [("0", None)])
    'the load is 11, but the model was fitted on 0'
    """
    if other_bearing is not None:
        return (
            f"the bearing is {other_bearing}, but the model was fitted on "
            f"{facts.get('bearing')}"
        )
    for name, value in _stated(recording).items():
        trained = facts.get(_SAVED[name])
        if trained and value not in trained:
            return (
                f"the {name} is {value}, but the model was fitted on "
                f"{', '.join(trained)}"
            )
    return channel_difference(channels, facts, recording.channel)


def channel_difference(channels: Channels, facts: dict[str, Any], stated: Any) -> str:
    """Return how channels differ from those of a model, or an empty text if they do not.

    Another unit may be that of another quantity, and another scale counts if the model
    has a fixed gain.

    Parameters
    ----------
    channels : sequence of tuple
        Names and units of the channels that are read.
    facts : dict
        Of the model.
    stated : str, list of str or None
        Channels as they were stated, None if they were not.

    Examples
    --------
    >>> facts = {"channel_names": ["acc_x"], "channels": ["acc_x"], "unit": "g"}
    >>> channel_difference([("acc_y", "g")], facts, "acc_y")
    'the channel is acc_y, but the model was fitted on acc_x'
    >>> channel_difference([("acc_x", "mm/s")], facts, "acc_x")
    'the unit is mm/s, but the model was fitted on g'
    >>> channel_difference([("acc_x", "G's")], facts, "acc_x")
    ''
    """
    joined = _joined(channels)
    fitted = facts.get("channel_names") or []
    names = [name for name, _ in channels]
    if fitted and joined not in fitted and not _is_like(names, facts, stated):
        return f"the channel is {joined}, but the model was fitted on {' or '.join(fitted)}"
    unit = channels[0][1]
    fitted_unit = facts.get("unit")
    if unit and fitted_unit and plain_unit(unit) != plain_unit(fitted_unit):
        return f"the unit is {unit}, but the model was fitted on {fitted_unit}"
    return ""


def _is_like(names, facts, stated):
    """Return whether nothing shows that channels are others than those of the model."""
    patterns = facts.get("channels") or []
    # A bracket is part of a name such as x[0].
    escaped = [pattern.replace("[", "[[]") for pattern in patterns]
    if len(patterns) == len(names) and all(map(fnmatchcase, names, escaped)):
        return True
    # Files with one channel each may call it as they like.
    fitted = "; ".join(facts["channel_names"]).split("; ")
    has_position = any(map(str.isdecimal, [*names, *fitted]))
    return stated is None and (not patterns or has_position)


def channels_of_model(facts: dict[str, Any]) -> list[list[str]]:
    """Return ways to state the channels of a model, the best first; none if they were not stated.

    A position means another channel in a file with more columns, so the name comes
    first.
    """
    stated = facts.get("channels") or []
    names = facts.get("channel_names") or []
    by_name = [names[0].split("; ")] if len(names) == 1 else []
    return [*by_name, stated] if all(stated) and stated else []
