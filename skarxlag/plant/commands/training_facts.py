"""Facts of the training recordings that decide where the limits of an alarm hold."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from sklearn.base import clone

from ..readers.entries import ListedRecording

#: Stated facts of a recording, and the names under which those of the training are saved.
_SAVED = {"load": "loads", "specimen": "specimens", "campaign": "campaigns"}
#: Blocks of time, of which each is left out once.
_N_BLOCKS = 5
#: Probability with which the true rate is below the stated bound.
_CONFIDENCE = 0.95


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


def why_no_limits(facts: dict[str, Any], recording: ListedRecording) -> str:
    """Return which stated fact differs from all training, or an empty text if none does.

    Parameters
    ----------
    facts : dict
        Of the model.
    recording : ListedRecording
        The recording.

    Examples
    --------
    >>> from pathlib import Path
    >>> recording = ListedRecording(None, "run", Path("run.npy"), load="11")
    >>> why_no_limits({"loads": ["0"]}, recording)
    'the load is 11, but the model was fitted on 0'
    """
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


def false_alarm_events(
    detector: Any,
    X: NDArray[Any],
    recording: NDArray[Any],
    metadata: dict[str, Any],
) -> int:
    """Count false alarms of a detector on blocks of time that its fit left out.

    Rows that exceed the limits one after another are one event.

    Parameters
    ----------
    detector : estimator
        Not fitted.
    X : ndarray of shape (n_rows, ...)
        Healthy rows, in the order of time.
    recording : ndarray of shape (n_rows,)
        Their recordings.
    metadata : dict of str to ndarray
        Requested by the detector in `fit` and `predict`.

    Returns
    -------
    int
        Number of events.

    Raises
    ------
    ValueError
        If the rows are too few.
    """
    exceeds = np.zeros(len(X), dtype=bool)
    block = np.zeros(len(X), dtype=int)
    for name in np.unique(recording):
        rows = np.flatnonzero(recording == name)
        block[rows] = np.arange(len(rows)) * _N_BLOCKS // len(rows)
    for left_out in np.unique(block):
        test = block == left_out
        of_training = {name: values[~test] for name, values in metadata.items()}
        of_test = {name: values[test] for name, values in metadata.items()}
        fitted = clone(detector).fit(X[~test], **of_training)
        exceeds[test] = fitted.predict(X[test], **of_test) == -1
    follows = np.concatenate([[False], recording[1:] == recording[:-1]])
    before = np.concatenate([[False], exceeds[:-1]]) & follows
    return int((exceeds & ~before).sum())


def false_alarm_sentence(
    n_events: int, healthy_seconds: float, rate: float, row_seconds: float, rows: str
) -> str:
    """Describe the false alarms of a detector as events an hour of operation.

    Parameters
    ----------
    n_events : int
        False alarms on blocks that were left out.
    healthy_seconds : float
        Length of these blocks together.
    rate : float
        Stated false-alarm rate of a row.
    row_seconds : float
        Length of a row.
    rows : str
        Word for the rows.

    Examples
    --------
    >>> false_alarm_sentence(0, 1800.0, 0.01, 1.0, "stretches")
    'False alarms of single stretches: 0 in 0.5 h of healthy signal that was left out, so at most
    6 an hour (95 % confidence); 36 an hour are expected.'
    """
    hours = healthy_seconds / 3600
    highest = chi2.ppf(_CONFIDENCE, 2 * (n_events + 1)) / 2 / hours
    return (
        f"False alarms of single {rows}: {n_events} in {hours:.2g} h of healthy signal "
        f"that was left out, so at most {highest:.2g} an hour ({100 * _CONFIDENCE:.0f} % "
        f"confidence); {3600 * rate / row_seconds:.2g} an hour are expected."
    )
