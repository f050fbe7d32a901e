"""Facts of the training recordings that decide where the limits of an alarm hold."""

from collections.abc import Iterable
from typing import Any

from ..readers.entries import ListedRecording

#: Stated facts of a recording, and the names under which those of the training are saved.
_SAVED = {"load": "loads", "specimen": "specimens", "campaign": "campaigns"}


def _stated(recording):
    facts = {
        "load": recording.load,
        "specimen": recording.specimen,
        "campaign": recording.further.get("campaign"),
    }
    return {name: str(value) for name, value in facts.items() if value is not None}


def facts_of_training(recordings: Iterable[ListedRecording]) -> dict[str, list[str]]:
    """Return the stated loads, specimens and campaigns of recordings, under their saved names."""
    values: dict[str, set[str]] = {}
    for recording in recordings:
        for name, value in _stated(recording).items():
            values.setdefault(_SAVED[name], set()).add(value)
    return {name: sorted(stated) for name, stated in values.items()}


def why_no_limits(
    facts: dict[str, Any],
    recording: ListedRecording,
    other_bearing: str | None = None,
) -> str:
    """Return which stated fact differs from all training, or an empty text if none does.

    Parameters
    ----------
    facts : dict
        Of the model.
    recording : ListedRecording
        The recording.
    other_bearing : str or None, default=None
        Its bearing, if it is not that of the training.

    Examples
    --------
    >>> from pathlib import Path
    >>> recording = ListedRecording(None, "run", Path("run.npy"), load="11")
    >>> why_no_limits({"loads": ["0"]}, recording)
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
    return ""


def unstated_facts(facts: dict[str, Any], recording: ListedRecording) -> list[str]:
    """Return the facts that an alarm assumes to be those of the training."""
    stated = _stated(recording)
    names = [
        name for name in _SAVED if name not in stated or not facts.get(_SAVED[name])
    ]
    return [
        name.replace("specimen", "bearing").replace("campaign", "mounting")
        for name in names
    ]
