"""A diagnoser calibrated at one speed and scored at every speed: the unit of work of `evaluate`."""

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import pandas as pd

from ..accuracy_tables import scored_windows
from ..model_selection import speed_splits
from .diagnosers import DIAGNOSERS
from .rigs import FETCHERS

#: Rigs that this process has loaded; threads share it, a worker process loads the files itself.
loaded_rigs: dict[Any, Any] = {}


@dataclass(frozen=True)
class Scores:
    """What came of a trial.

    Parameters
    ----------
    verdicts : DataFrame
        As `skarxlag.accuracy_tables` describes it.
    diagnoser : Pipeline
        Fitted.
    seconds : float
        How long it took.
    """

    verdicts: pd.DataFrame
    diagnoser: object
    seconds: float


@dataclass(frozen=True)
class Trial:
    """A rig, a training speed and a diagnoser, small enough to be sent to a worker.

    Parameters
    ----------
    rig : str
        Name of a real rig.
    data_home : Path or None
        Folder of its files.
    window_length : int
        Samples in a window.
    train_rpm : float
        Speed to calibrate at.
    name : str
        Of the diagnoser.
    n_jobs : int
        Threads that work on windows.
    """

    rig: str
    data_home: Path | None
    window_length: int
    train_rpm: float
    name: str
    n_jobs: int

    def __call__(self) -> Any:
        """Fit on first halves of the recordings at the speed, score on second halves of all."""
        rig = self._loaded()
        started = perf_counter()
        splits = speed_splits(
            rig.rpm, train_rpm=self.train_rpm, recording=rig.recording, same_speed=True
        )
        title, maker = DIAGNOSERS[self.name]
        diagnoser = maker(healthy=rig.target_names[0], n_jobs=self.n_jobs)
        train = splits[0][0]
        diagnoser.fit(rig.data[train], rig.target[train])
        constants = {"diagnoser": title, "train_rpm": self.train_rpm}
        frames = [scored_windows(diagnoser, rig, test, constants) for _, test in splits]
        verdicts = pd.concat(frames, ignore_index=True)
        return Scores(verdicts, diagnoser, perf_counter() - started)

    def _loaded(self):
        key = self.rig, self.data_home, self.window_length
        if key not in loaded_rigs:
            fetch = FETCHERS[self.rig]
            loaded_rigs[key] = fetch(data_home=self.data_home, window_length=self.window_length)
        return loaded_rigs[key]
