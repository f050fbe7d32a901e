"""Rigs that ``skarxlag evaluate`` takes, with their splits and the diagnosers to compare."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, scale
from sklearn.utils import Bunch

from ..datasets import FETCHERS, simulate_rig
from ..diagnosers import make_diagnoser
from ..kernels.speed_references import group_speeds
from ..model_selection import first_and_second_half
from ..recordings.rig import cut_recordings, speeds_of_samples
from .arguments import table_recordings
from .messages import UsageError, as_command_error, report_progress
from .models import DIAGNOSERS, of_outputs

TITLES = {
    "simulated": "Simulated rig",
    **{name: f"{name.upper().replace('_', '-')} rig" for name in FETCHERS},
}
#: The simulated rig: samples of a recording, crack sizes, and the speed of the calibration.
N_SAMPLES = 120_000
_CRACKS_MM = (3.0, 6.0)
_SIMULATED_RPM = 500.0
#: Windows of a table are long if every recording holds two of them. Those of a rig are short.
_LONG, _SHORT = 4800, 1200


#: Titles of protocols: of a rig, and of the recordings of a table.
_HALVES = {
    "speeds": "calibrated on first halves of recordings at one speed (rows), tested on second "
    "halves (columns)"
}
_SPEEDS = {
    "in": "trained at one speed, tested at all others (columns)",
    "out": "trained at all speeds but one, tested at that (columns)",
}

_CAMPAIGNS = " Training and test differ in recording and campaign."
_NO_CAMPAIGNS = (
    " Training and test differ in recording. The table has no column campaign. If the test was "
    "measured without remounting after the training, the accuracy may be too high."
)


class Split(NamedTuple):
    """Rows of a training and of its test; protocol and, if there is one, speed of the training."""

    train: NDArray[Any]
    test: NDArray[Any]
    protocol: str
    train_rpm: float


@dataclass(frozen=True)
class Case:
    """A rig, its splits, and the diagnosers that are compared on it."""

    title: str
    stem: str
    rig: Bunch
    splits: list[Split]
    methods: dict[str, Any]
    protocols: dict[str, str]
    note: str = ""

    @property
    def is_own(self) -> bool:
        """Return whether the recordings are those of a table."""
        return bool(self.note)

    @property
    def heading(self) -> str:
        """Description of the rig in one sentence."""
        rig = self.rig
        speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
        return (
            f"{self.title}: {len(rig.target_names)} conditions ({', '.join(rig.target_names)}) at "
            f"{speeds} rpm, windows of {rig.data.shape[-1]} samples at {rig.sampling_rate:g} Hz."
            f"{self.note}"
        )


def rig_cases(args: argparse.Namespace) -> list[Case]:
    """Return the cases of a rig: one for each crack size of the simulated rig."""
    length, title = args.window_length or _SHORT, TITLES[args.rig]
    report_progress(args, f"{title}: loading")
    try:
        with as_command_error(OSError):
            if args.rig in FETCHERS:
                rig = FETCHERS[args.rig](data_home=args.data_home, window_length=length)
                return [_rig_case(args, title, args.rig, rig, "all")]
    except ValueError as error:
        # The files of a fetcher are the original ones, so only the window length can be wrong.
        raise UsageError(f"argument --window-length: {error}") from error
    # A tail that fills no window is not simulated.
    n_samples = max((args.n_samples or N_SAMPLES) // length, 1) * length
    cases = []
    for crack in _CRACKS_MM:
        rig = simulate_rig(crack_mm=crack, n_samples=n_samples, window_length=length)
        name, stem = f"{title}, crack {crack:g} mm", f"{args.rig}_{crack:g}mm"
        cases.append(_rig_case(args, name, stem, rig, _SIMULATED_RPM))
    return cases


def _rig_case(args, title, stem, rig, train_rpm):
    if np.unique(rig.recording, return_counts=True)[1].min() < 2:
        raise UsageError(
            f"argument --window-length: {rig.data.shape[-1]}, expected at most half of the "
            "shortest recording"
        )
    speeds, wanted = np.unique(rig.rpm).tolist(), args.train_rpm or train_rpm
    if wanted not in (*speeds, "all"):
        listed = ", ".join(f"{speed:g}" for speed in speeds)
        raise UsageError(f"argument --train-rpm: {wanted:g}, expected {listed}, or all")
    first, second = first_and_second_half(rig.recording)
    splits = [
        Split(np.flatnonzero(first & (rig.rpm == rpm)), np.flatnonzero(second), "speeds", rpm)
        for rpm in (speeds if wanted == "all" else [wanted])
    ]
    healthy = rig.target_names[0]
    methods = {name: make(healthy=healthy) for name, make in DIAGNOSERS.values()}
    return Case(title, stem, rig, splits, methods, _HALVES)


def own_case(args: argparse.Namespace) -> Case:
    """Return the splits of the recordings of a table, and the diagnosers to compare.

    Recordings that are tested are never those of the training. If the table has a column
    ``campaign``, neither are their campaigns: recordings between which nothing was remounted.
    """
    with as_command_error():
        listed = table_recordings(args)
        try:
            rig = cut_recordings(listed, args.table, args.window_length or _LONG)
        except ValueError:
            if args.window_length is not None:
                raise
            rig = cut_recordings(listed, args.table, _SHORT)
    if rig.target is None or rig.rpm is None:
        raise UsageError(f"{args.table}: needs the columns condition and rpm")
    rig.speeds, errors = speeds_of_samples(rig)
    if rig.profiles:
        # Recordings of varying speed are left out by their mean speed.
        mean = pd.Series(rig.rpm).groupby(rig.recording).transform("mean")
        known, at = group_speeds(np.log(mean.to_numpy()))
        rig.rpm = np.exp(known).round(1)[at]
    n_speeds = len(np.unique(rig.rpm))
    if n_speeds < 2 or len(rig.target_names) < 2:
        raise UsageError(
            f"{args.table}: {len(rig.target_names)} conditions at {n_speeds} speeds; expected "
            "at least two of each"
        )
    splits = list(_own_splits(rig, errors == ""))
    if not splits:
        raise UsageError(f"{args.table}: no speed or campaign can be left out")
    diagnoser = make_diagnoser(sampling_rate=float(rig.sampling_rate))
    methods = {
        "make_diagnoser": of_outputs(args, diagnoser),
        "log spectrum + LDA": _peer(256, LinearDiscriminantAnalysis()),
        "band energies + forest": _peer(64, RandomForestClassifier(random_state=0)),
    }
    note = _CAMPAIGNS if "campaign" in rig.further else _NO_CAMPAIGNS
    return Case(str(args.table), args.table.resolve().stem, rig, splits, methods, _SPEEDS, note)


def _own_splits(rig, usable) -> Iterator[Split]:
    """Yield the splits of both protocols, without those whose training lacks a condition."""
    parts = [(True, True)]
    if "campaign" in rig.further:
        campaign = rig.further["campaign"].loc[rig.recording].to_numpy(dtype=str)
        parts = [(campaign != each, campaign == each) for each in np.unique(campaign)]
    for protocol, speed, (learned, tested) in product(["in", "out"], np.unique(rig.rpm), parts):
        at_speed = rig.rpm == speed
        is_train = at_speed if protocol == "in" else ~at_speed
        train = np.flatnonzero(is_train & learned & usable)
        test = np.flatnonzero(~is_train & tested & usable)
        if len(test) > 0 and len(set(rig.target[train])) == len(rig.target_names):
            yield Split(train, test, protocol, float(speed) if protocol == "in" else np.nan)


def _peer(nperseg, classifier):
    return make_pipeline(
        FunctionTransformer(log_spectrum, kw_args={"nperseg": nperseg}), classifier
    )


def log_spectrum(X: NDArray[Any], nperseg: int) -> NDArray[Any]:
    """Compute the log power spectrum of the output at unit RMS, by Welch's method.

    Parameters
    ----------
    X : ndarray of shape (n_windows, n_samples) or (n_windows, n_channels, n_samples)
        Windows.
    nperseg : int
        Samples in a segment; there are half as many bands.
    """
    y = scale(X if X.ndim == 2 else X[:, 0], axis=1)
    return np.log(welch(y, nperseg=nperseg, axis=1)[1][:, 1:] + np.finfo(float).tiny)
