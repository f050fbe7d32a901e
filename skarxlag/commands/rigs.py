"""The rigs that ``evaluate`` offers, cut into parts that are diagnosed separately."""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import Bunch

from ..datasets import FETCHERS, simulate_rig
from .errors import UsageError, as_command_error

TITLES = {
    "simulated": "Simulated rig",
    **{name: f"{name.upper().replace('_', '-')} rig" for name in FETCHERS},
}
_SIMULATED_SAMPLES = 120_000
_SIMULATED_CRACKS_MM = (3.0, 6.0)
_ROW_WISE = ("data", "target", "rpm", "recording", "start")


@dataclass(frozen=True)
class FetchedRig:
    """Where a real rig comes from, small enough to be sent to a worker.

    Parameters
    ----------
    name : str
        Of the rig.
    data_home : Path or None
        Folder of its files.
    window_length : int
        Samples in a window.
    """

    name: str
    data_home: Path | None
    window_length: int

    def load(self) -> Bunch:
        """The rig from its files."""
        return FETCHERS[self.name](data_home=self.data_home, window_length=self.window_length)


@dataclass(frozen=True)
class SimulatedRig:
    """What a simulated rig is made from, small enough to be sent to a worker.

    Parameters
    ----------
    crack_mm : float
        Crack size of its faulty windows.
    n_samples : int
        Samples in a recording.
    window_length : int
        Samples in a window.
    seed : int
        Of its random numbers.
    """

    crack_mm: float
    n_samples: int
    window_length: int
    seed: int

    def load(self) -> Bunch:
        """The rig, simulated."""
        return simulate_rig(
            crack_mm=self.crack_mm,
            n_samples=self.n_samples,
            window_length=self.window_length,
            random_state=self.seed,
        )


#: Rigs that this process has loaded; threads share them, a worker process loads its own.
loaded_rigs: dict[FetchedRig | SimulatedRig, Bunch] = {}


def loaded(source: FetchedRig | SimulatedRig) -> Bunch:
    """A rig, loaded once in a process."""
    if source not in loaded_rigs:
        loaded_rigs[source] = source.load()
    return loaded_rigs[source]


@dataclass(frozen=True)
class Part:
    """Windows that are diagnosed together.

    Parameters
    ----------
    crack_mm : float or None
        Crack size of its faulty windows; None where the rig has no such thing.
    rig : Bunch
        As `skarxlag.datasets` returns it.
    source : FetchedRig or SimulatedRig
        Where the rig comes from.
    """

    crack_mm: float | None
    rig: Bunch
    source: FetchedRig | SimulatedRig

    @property
    def stem(self) -> str:
        """What tells its files from those of other parts."""
        return "" if self.crack_mm is None else f"_{self.crack_mm:g}mm"

    @property
    def title(self) -> str:
        """What tells its tables from those of other parts."""
        return "" if self.crack_mm is None else f", crack {self.crack_mm:g} mm"


def load_parts(args: argparse.Namespace) -> list[Part]:
    """Load the rig that the arguments name.

    Parameters
    ----------
    args : argparse.Namespace
        With ``rig``, ``data_home``, ``window_length``, ``train_rpm``, ``n_samples``, ``seed``
        and ``ladder``.

    Returns
    -------
    list of Part
        One for each crack size, each with the normal windows too; one for a rig without cracks.

    Raises
    ------
    UsageError
        If an argument does not fit the rig.
    CommandError
        If a file cannot be read.
    """
    if args.rig == "simulated":
        return _simulate(args)
    for name in ("n_samples", "seed", "ladder"):
        if getattr(args, name) is not None:
            option = "--" + name.replace("_", "-")
            raise UsageError(f"argument {option}: only the simulated rig has it, not {args.rig}")
    # A worker may run in another folder.
    data_home = None if args.data_home is None else args.data_home.absolute()
    try:
        with as_command_error(OSError):
            part = _part(FetchedRig(args.rig, data_home, args.window_length))
    except ValueError as error:
        # Of files that are the original ones a fetcher can refuse nothing else.
        raise UsageError(f"argument --window-length: {error}") from error
    _check_halves(part.rig, args.window_length)
    return [part]


def _part(source, crack_mm=None):
    loaded_rigs[source] = source.load()
    return Part(crack_mm, loaded_rigs[source], source)


def _simulate(args):
    if args.data_home is not None:
        raise UsageError("argument --data-home: the simulated rig reads no files")
    n_samples = _SIMULATED_SAMPLES if args.n_samples is None else args.n_samples
    n_windows = n_samples // args.window_length
    if n_windows < 2:
        raise UsageError(
            f"argument --window-length: {args.window_length}, expected at most half of the "
            f"{n_samples} samples of a recording"
        )
    if args.train_rpm is not None:
        raise UsageError(
            "argument --train-rpm: only the real rigs have it; the paper calibrates at 500 rpm"
        )
    whole = n_windows * args.window_length
    seed = 0 if args.seed is None else args.seed
    return [
        _part(SimulatedRig(crack_mm, whole, args.window_length, seed), crack_mm)
        for crack_mm in _SIMULATED_CRACKS_MM
    ]


def _check_halves(rig, window_length):
    _, counts = np.unique(rig.recording, return_counts=True)
    if counts.min() < 2:
        raise UsageError(
            f"argument --window-length: {window_length}, expected at most half of the shortest "
            "recording"
        )


def select_windows(rig: Bunch, chosen: NDArray[Any]) -> Bunch:
    """Some windows of a rig.

    Parameters
    ----------
    rig : Bunch
        As `skarxlag.datasets` returns it.
    chosen : ndarray of bool of shape (n_windows,)
        Which.

    Returns
    -------
    Bunch
        The same with these windows alone.
    """
    return Bunch(**(dict(rig) | {name: rig[name][chosen] for name in _ROW_WISE}))
