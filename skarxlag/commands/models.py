"""A saved diagnoser and what must be known to use it on recordings."""

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from sklearn.pipeline import Pipeline

from ..channels import ChannelRows
from ..persistence import load_diagnoser
from ..verdicts import rejection_rate
from .diagnosers import set_threads
from .errors import CommandError, as_command_error, printable


@dataclass(frozen=True)
class SavedModel:
    """What `fit`, or `save_diagnoser`, has written.

    Parameters
    ----------
    path : Path
        The file.
    diagnoser : Pipeline
        Fitted.
    facts : dict
        As saved.
    kind : str
        Name of the diagnoser in the commands, or of its class.
    conditions : list of str
        The healthy one first.
    n_channels : int
        Of the windows.
    window_length : int
        In samples.
    sampling_rate : float or None
        In Hz; None if nobody has stated it.
    train_rpm : list of float or None
        Speeds of the training.
    known : Pipeline or None
        The known conditions, where they were saved beside the diagnoser.
    """

    path: Path
    diagnoser: object
    facts: dict[str, Any]
    kind: str
    conditions: list[Any]
    n_channels: int
    window_length: int
    sampling_rate: float | None
    train_rpm: list[Any] | None
    known: Any = None


def load_model(path: Path, n_jobs: int | None = None) -> SavedModel:
    """Load a model. What `fit` states and `save_diagnoser` may not is taken from its steps.

    Parameters
    ----------
    path : Path
        The file.
    n_jobs : int or None, default=None
        Threads that work on windows.

    Returns
    -------
    SavedModel
        The model.

    Raises
    ------
    CommandError
        If it cannot be read, or neither states the length of its windows nor knows it.
    """
    with as_command_error():
        diagnoser, facts = load_diagnoser(path)
    if isinstance(diagnoser, Pipeline) and isinstance(diagnoser[0], ChannelRows):
        # Recordings are cut into windows, not into rows.
        diagnoser = diagnoser[1:]
    known_conditions = facts.pop("known_conditions", None)
    for each in (diagnoser, known_conditions):
        if each is not None:
            set_threads(each, n_jobs)
    known = _of_steps(diagnoser) | facts
    if "window_length" not in known:
        raise CommandError(
            f"{path}: does not state the length of its windows; save it with "
            "save_diagnoser(..., window_length=...)"
        )
    return SavedModel(
        path=path,
        diagnoser=diagnoser,
        facts=facts,
        kind=known["diagnoser"],
        conditions=known["conditions"],
        n_channels=known["n_channels"],
        window_length=known["window_length"],
        sampling_rate=known.get("sampling_rate"),
        train_rpm=known.get("train_rpm"),
        known=known_conditions,
    )


def stated_facts(model: Any) -> Any:
    """What a file of results states of the model."""
    known = {}
    if model.known is not None:
        known = {"false_rejection_rate": rejection_rate(model.known)}
    return known | {
        "file": printable(model.path),
        "diagnoser": model.kind,
        "conditions": model.conditions,
        "train_rpm": model.train_rpm,
        "sampling_rate": model.sampling_rate,
        "window_length": model.window_length,
    }


@functools.lru_cache(maxsize=2)
def cached_model(path: Path, changed: int, n_jobs: int | None) -> SavedModel:
    """`load_model` of a file as it was at a time: a worker loads it once for all recordings.

    Parameters
    ----------
    path : Path
        The file.
    changed : int
        Its time of modification in nanoseconds.
    n_jobs : int or None
        Threads that work on windows.

    Returns
    -------
    SavedModel
        The model.
    """
    return load_model(path, n_jobs)


def is_model_file(path: Any) -> Any:
    """Whether a file is a saved model, damaged or not."""
    try:
        with ZipFile(path) as file:
            return "schema.json" in file.namelist()
    except (BadZipFile, OSError):
        return False


def held_rate(n_windows: int, rate: float) -> list[str]:
    """What to say where fewer healthy windows were at hand than the false-alarm rate needs.

    Of n windows and a further one of the same kind, the further one is the largest with
    probability 1 / (n + 1), so no threshold that rests on the n promises less.

    Parameters
    ----------
    n_windows : int
        Healthy windows of the calibration.
    rate : float
        The rate that was asked for.

    Returns
    -------
    list of str
        A sentence, or none if the rate can be held.

    Examples
    --------
    >>> print(*held_rate(4, 0.01))
    4 healthy windows cannot hold a false-alarm rate of 0.01: no threshold promises less than
    1/5 = 0.2. It takes 99 windows.
    >>> held_rate(99, 0.01)
    []
    """
    needed = math.ceil(round(1 / rate - 1, 6))
    if n_windows >= needed:
        return []
    return [
        f"{n_windows} healthy windows cannot hold a false-alarm rate of {rate:g}: no threshold "
        f"promises less than 1/{n_windows + 1} = {1 / (n_windows + 1):.2g}. It takes {needed} "
        "windows."
    ]


def _of_steps(diagnoser):
    first, decide = diagnoser[0], diagnoser[-1]
    known = {"diagnoser": type(diagnoser).__name__}
    if hasattr(decide, "classes_"):
        conditions = decide.classes_.tolist()
        healthy = conditions[decide.healthy_index_] if hasattr(decide, "healthy_index_") else None
        known["conditions"] = sorted(conditions, key=lambda name: name != healthy)
    else:
        known["conditions"] = ["healthy"]
    shape = getattr(first, "window_shape_", None)
    if shape is not None:
        known["window_length"] = int(shape[-1])
        known["n_channels"] = 1 if len(shape) == 1 else int(shape[0])
    else:
        known["n_channels"] = len(getattr(first, "orders_", [0]))
        if known["n_channels"] == 1 and hasattr(first, "n_features_in_"):
            known["window_length"] = int(first.n_features_in_)
    return known
