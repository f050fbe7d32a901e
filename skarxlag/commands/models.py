"""A saved diagnoser and what must be known to use it on recordings."""

import hashlib
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from sklearn.pipeline import Pipeline

from .._answers import answers
from .._validation import estimators_within
from ..channels import ChannelRows
from ..kernels.ladder import rows_that_hold
from ..persistence import load_diagnoser
from ..pipelines import in_one_pass
from ..verdicts import Judge
from .diagnosers import set_threads
from .messages import CommandError, as_command_error, printable


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
    healthy : str or None
        The healthy one; None if nobody has stated which that is.
    n_channels : int
        Of the windows.
    window_length : int
        In samples.
    sampling_rate : float or None
        In Hz; None if nobody has stated it.
    train_rpm : list of float or None
        Speeds of the training.
    judge : Judge
        Diagnoser, known conditions and detector of the file as one, for verdicts.
    known : Pipeline or None
        Known conditions that were saved with the diagnoser.
    detector : Pipeline or None
        Detector that was saved with the diagnoser.
    """

    path: Path
    diagnoser: object
    facts: dict[str, Any]
    kind: str
    conditions: list[Any]
    healthy: str | None
    n_channels: int
    window_length: int
    sampling_rate: float | None
    train_rpm: list[Any] | None
    judge: Judge
    known: Any = None
    detector: Any = None


def load_model(path: str | os.PathLike[str], n_jobs: int | None = None) -> SavedModel:
    """Load a model. What `fit` states and `save_diagnoser` may not is taken from its steps.

    Parameters
    ----------
    path : path-like
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
    _take_windows(path, diagnoser)
    companions = [facts.pop(name, None) for name in ("known_conditions", "detector")]
    for each in (diagnoser, *companions):
        if each is not None:
            set_threads(each, n_jobs)
    known = _of_steps(path, diagnoser, in_one_pass(diagnoser)[-1]) | facts
    if "window_length" not in known:
        raise CommandError(
            f"{path}: does not state the length of its windows; save it with "
            "save_diagnoser(..., window_length=...)"
        )
    conditions, train_rpm, healthy = known["conditions"], known.get("train_rpm"), known["healthy"]
    if "conditions" in facts:
        healthy = facts.get("healthy", conditions[0])
    with as_command_error():
        judge = Judge(
            diagnoser,
            conditions=None if healthy is None else conditions,
            known=companions[0],
            detector=companions[1],
            train_rpm=train_rpm or (),
        )
    if healthy is None:
        # Without a healthy condition there are no healthy limits.
        judge.healthy, judge.detects = None, False
    return SavedModel(
        path=path,
        diagnoser=in_one_pass(diagnoser),
        facts=facts,
        kind=known["diagnoser"],
        conditions=conditions,
        healthy=healthy,
        n_channels=known["n_channels"],
        window_length=known["window_length"],
        sampling_rate=known.get("sampling_rate"),
        train_rpm=train_rpm,
        judge=judge,
        known=companions[0],
        detector=companions[1],
    )


def stated_facts(model: SavedModel) -> dict[str, Any]:
    """What a file of results states of the model."""
    known = {}
    if model.known is not None:
        known = {"false_rejection_rate": answers(model.known).stated_rate}
    return known | {
        "file": printable(model.path),
        "diagnoser": model.kind,
        "conditions": model.conditions,
        "healthy": model.healthy,
        "train_rpm": model.train_rpm,
        "sampling_rate": model.sampling_rate,
        "window_length": model.window_length,
    }


def model_heading(model: SavedModel) -> str:
    """Describe a model in one line."""
    at = (
        "" if model.train_rpm is None else f" at {', '.join(f'{s:g}' for s in model.train_rpm)} rpm"
    )
    rate = "" if model.sampling_rate is None else f" at {model.sampling_rate:g} Hz"
    rows, seconds = "windows", ""
    if answers(model.diagnoser).is_stretch:
        rows = "stretches"
        if model.sampling_rate is not None:
            seconds = f", {model.window_length / model.sampling_rate:.3g} s,"
    return (
        f"{model.path}: {model.kind} calibrated on {', '.join(map(str, model.conditions))}{at}, "
        f"{rows} of {model.window_length} samples{seconds}{rate}. "
        f"Healthy: {'not known' if model.healthy is None else model.healthy}"
    )


@lru_cache(maxsize=2)
def cached_model(path: str | os.PathLike[str], changed: int, n_jobs: int | None) -> SavedModel:
    """`load_model` of a file as it was at a time: a worker loads it once for all recordings.

    Parameters
    ----------
    path : path-like
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


def model_digest(path: str | os.PathLike[str]) -> str:
    """SHA-256 of a model file, by which later runs know that the model is the same."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_model_file(path: Path) -> bool:
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
    needed = rows_that_hold(rate)
    if n_windows >= needed:
        return []
    return [
        f"{n_windows} healthy windows cannot hold a false-alarm rate of {rate:g}: no threshold "
        f"promises less than 1/{n_windows + 1} = {1 / (n_windows + 1):.2g}. It takes {needed} "
        "windows."
    ]


def calibration_basis(decide: Any, rows: str = "windows") -> str:
    """What the limits of a fitted detector rest on.

    Parameters
    ----------
    decide : FaultDetector
        The last step.
    rows : str, default="windows"
        What its rows are called.

    Returns
    -------
    str
        For a line of text.
    """
    text = f"{decide.n_rows_} healthy {rows}"
    if len(decide.left_out_rates_) == 0:
        return text
    shares = zip(decide.speeds_, decide.left_out_rates_, strict=True)
    listed = ", ".join(f"{share:.1%} at {speed:g} rpm" for speed, share in shares)
    return f"{text}; false alarms at speeds that were left out: {listed}"


def _take_windows(path, diagnoser):
    """Leave out the step that makes windows of rows: recordings are cut into windows."""
    pipelines = [part for part in estimators_within(diagnoser) if isinstance(part, Pipeline)]
    behind = {id(step) for pipeline in pipelines for _, step in pipeline.steps[1:]}
    for pipeline in pipelines:
        for _, step in pipeline.steps:
            # Windows of one channel are rows.
            if not isinstance(step, ChannelRows) or step.n_channels == 1:
                continue
            if step is not pipeline[0] or id(pipeline) in behind:
                raise CommandError(
                    f"{path}: ChannelRows(n_channels={step.n_channels}) stands behind other steps, "
                    "expected the first step: recordings are cut into windows, not into rows"
                )
            pipeline.steps = pipeline.steps[1:]


def _of_steps(path, diagnoser, decide):
    can = answers(diagnoser)
    known = {"diagnoser": type(diagnoser).__name__, "healthy": can.healthy}
    if can.conditions is None:
        known["healthy"], known["conditions"] = "healthy", ["healthy"]
    elif not can.states_probabilities:
        raise CommandError(
            f"{path}: {type(decide).__name__} states no probabilities, which verdicts rest "
            "on; fit it within CalibratedClassifierCV"
        )
    else:
        known["conditions"] = sorted(can.conditions, key=lambda name: name != can.healthy)
    known["n_channels"] = can.n_channels
    if can.window_length is not None:
        known["window_length"] = can.window_length
    return known
