"""A diagnoser calibrated at one speed and scored at every speed: the unit of work of `evaluate`."""

from dataclasses import dataclass
from functools import partial
from time import perf_counter

import pandas as pd
from sklearn.utils import Bunch

from ..accuracy_tables import scored_windows
from ..model_selection import speed_splits
from ..paper.protocol import score_crack
from .diagnosers import DIAGNOSERS, LADDERS
from .rigs import FetchedRig, SimulatedRig, loaded, select_windows


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
    rig : FetchedRig
        A real rig.
    train_rpm : float
        Speed to calibrate at.
    name : str
        Of the diagnoser.
    n_jobs : int
        Threads that work on windows.
    """

    rig: FetchedRig
    train_rpm: float
    name: str
    n_jobs: int

    def __call__(self) -> Scores:
        """Fit on first halves of the recordings at the speed, score on second halves of all."""
        rig = loaded(self.rig)
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


@dataclass(frozen=True)
class PaperTrial:
    """A crack size and a diagnoser under the paper's protocol.

    Parameters
    ----------
    rig : SimulatedRig
        All conditions and speeds at the crack size.
    ladder : str
        Of `LADDERS`.
    title : str
        Of the diagnoser.
    n_jobs : int
        Threads that work on windows.
    """

    rig: SimulatedRig
    ladder: str
    title: str
    n_jobs: int

    def __call__(self) -> Bunch:
        """What `skarxlag.paper.protocol.score_crack` returns, with ``seconds``."""
        rig = loaded(self.rig)
        started = perf_counter()
        make = partial(LADDERS[self.ladder][self.title], n_jobs=self.n_jobs)
        outcome = score_crack(
            lambda crack_mm, rpm: select_windows(rig, rig.rpm == rpm),
            self.rig.crack_mm,
            {self.title: make},
        )
        return Bunch(**outcome, seconds=perf_counter() - started)
