"""Cases of `evaluate`: a rig, or the recordings of a table, with what is compared on them."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, scale
from sklearn.utils import Bunch

from ...core.validation import output_of_windows
from ...datasets import FETCHERS, simulate_rig
from ...diagnosers import make_diagnoser
from ...kernels.speed_references import group_speeds
from ..readers.cutting import cut_recordings
from ..readers.rows import speeds_of_samples
from . import protocols
from .messages import UsageError, counted, listed, report_progress
from .models import DIAGNOSERS, of_outputs
from .parsers.evaluate import N_SAMPLES, TITLES

#: Crack sizes of the simulated rig, and the speed of its calibration.
_CRACKS_MM = (3.0, 6.0)
_SIMULATED_RPM = 500.0
#: Windows of a table are long if every recording holds two of them. Those of a rig are
#: short.
_LONG = 4800
_SHORT = 1200
#: Titles of protocols across speeds: of a rig, and of the recordings of a table.
_HALVES = {
    "speeds": "trained on first halves at one speed (rows), tested on second (columns)"
}
_SPEEDS = {
    "in": "trained at one speed, tested at all others (columns)",
    "out": "trained at all speeds but one, tested at that (columns)",
}
_CAMPAIGNS = " Training and test differ in recording and campaign."
_NO_CAMPAIGNS = " No column campaign: without remounting, the accuracy may be too high."


@dataclass(frozen=True)
class Case:
    """Windows of one evaluation, the diagnosers to compare, and their tests.

    Parameters
    ----------
    rig : Bunch
        Windows and their facts, as `load_recordings` returns them.
    speeds : ndarray of shape (n_rows,) or (n_rows, n_samples)
        Speeds that the diagnosers are given.
    title : str
        Title.
    stem : str
        Beginning of the names of its files.
    methods : dict of str to estimator
        Diagnosers to compare.
    recommended : str
        Name of one of them.
    protocols : dict of str to str
        Titles of the protocols across speeds.
    splits : list of Split
        Tests of all protocols.
    sentences : list of str
        What is not measured, and why.
    part : str, default=""
        Distinguishes it from other cases of the same rig.
    note : str, default=""
        Sentence on the recordings of a table; empty for a rig.
    """

    rig: Bunch
    speeds: NDArray[Any]
    title: str
    stem: str
    methods: dict[str, Any]
    recommended: str
    protocols: dict[str, str]
    splits: list[protocols.Split]
    sentences: list[str]
    part: str = ""
    note: str = ""

    @property
    def is_rig(self) -> bool:
        """Return whether it is a rig; otherwise, its recordings are those of a table."""
        return not self.note

    @property
    def specimens(self) -> NDArray[Any]:
        """Specimen of each row; each condition is one if none are stated."""
        return self.rig.get("specimen", self.rig.target)


def rig_cases(args: argparse.Namespace) -> Iterator[Case]:
    """Yield the cases of the rig in the arguments: one for each simulated crack size.

    Raises
    ------
    UsageError
        If its recordings are too short, or it has no such training speed.
    """
    length = args.window_length or _SHORT
    report_progress(args, f"{TITLES[args.rig]}: loading")
    if args.rig in FETCHERS:
        rig = FETCHERS[args.rig](data_home=args.data_home, window_length=length)
        yield _rig_case(args, rig, "all", TITLES[args.rig], args.rig)
        return
    # A tail that fills no window is not simulated.
    n_samples = max((args.n_samples or N_SAMPLES) // length, 1) * length
    for crack in _CRACKS_MM:
        rig = simulate_rig(crack_mm=crack, n_samples=n_samples, window_length=length)
        part = f"crack {crack:g} mm"
        title = f"{TITLES[args.rig]}, {part}"
        stem = f"{args.rig}_{crack:g}mm"
        yield _rig_case(args, rig, _SIMULATED_RPM, title, stem, part)


def _rig_case(args, rig, usual_rpm, title, stem, part=""):
    if np.unique(rig.recording, return_counts=True)[1].min() < 2:
        raise UsageError(
            f"argument --window-length: {rig.data.shape[-1]}, expected at most half of "
            "the shortest recording"
        )
    speeds = np.unique(rig.rpm).tolist()
    train_rpm = args.train_rpm or usual_rpm
    if train_rpm not in (*speeds, "all"):
        raise UsageError(
            f"argument --train-rpm: {train_rpm:g}, expected {listed(speeds)}, or all"
        )
    splits = protocols.half_splits(rig, speeds if train_rpm == "all" else [train_rpm])
    usable = np.ones(len(rig.target), dtype=bool)
    others, sentences = protocols.splits_at_any_speed(rig, usable, halves=True)
    splits += [
        split
        for split in others
        if train_rpm in ("all", split.train_rpm) or split.protocol == "load"
    ]
    healthy = rig.target_names[0]
    return Case(
        rig,
        rig.rpm,
        title,
        stem,
        methods={name: make(healthy=healthy) for name, make in DIAGNOSERS.values()},
        recommended=DIAGNOSERS["diagnoser"][0],
        protocols=_HALVES,
        splits=splits,
        sentences=sentences,
        part=part,
    )


def table_case(args: argparse.Namespace) -> Case:
    """Return the case of the table in the arguments.

    Recordings that are tested are never those of the training. If the table has a
    column ``campaign``, neither are their campaigns: recordings between which nothing
    was remounted.

    Raises
    ------
    UsageError
        If the table lacks speeds or conditions, or if none can be left out.
    """
    rig = _windows_of_table(args)
    if rig.target is None or rig.rpm is None:
        raise UsageError(f"{args.table}: needs the columns condition and rpm")
    speeds, errors = speeds_of_samples(rig)
    usable = errors == ""
    if rig.profiles:
        # Recordings of varying speed are left out by their mean speed.
        mean = pd.Series(rig.rpm).groupby(rig.recording).transform("mean")
        log_speeds, group = group_speeds(np.log(mean.to_numpy()))
        rig.rpm = np.exp(log_speeds).round(1)[group]
    splits = list(protocols.speed_splits(rig, usable))
    if not splits or len(rig.target_names) < 2:
        raise UsageError(f"{args.table}: {_why_no_split(rig)}")
    others, sentences = protocols.splits_at_any_speed(rig, usable, halves=False)
    diagnoser = make_diagnoser(sampling_rate=float(rig.sampling_rate))
    return Case(
        rig,
        speeds,
        title=str(args.table),
        stem=args.table.resolve().stem,
        methods={
            "make_diagnoser": of_outputs(args, diagnoser),
            "log spectrum + LDA": _of_spectra(256, LinearDiscriminantAnalysis()),
            "band energies + forest": _of_spectra(
                64, RandomForestClassifier(random_state=0)
            ),
        },
        recommended="make_diagnoser",
        protocols=_SPEEDS,
        splits=splits + others,
        sentences=sentences,
        note=_CAMPAIGNS if "campaign" in rig.further else _NO_CAMPAIGNS,
    )


def _windows_of_table(args):
    if args.window_length is not None:
        return cut_recordings(args.listed, args.table, args.window_length)
    try:
        return cut_recordings(args.listed, args.table, _LONG)
    except ValueError:
        return cut_recordings(args.listed, args.table, _SHORT)


def _why_no_split(rig):
    """Return what a table has, and what it needs so that a speed or campaign can be left out."""
    n_conditions = len(rig.target_names)
    n_speeds = len(np.unique(rig.rpm))
    if "campaign" not in rig.further or min(n_conditions, n_speeds) < 2:
        return (
            f"{counted(n_conditions, 'condition')} at {counted(n_speeds, 'speed')}; "
            "expected at least two of each, and that a speed can be left out"
        )
    campaigns = np.unique(rig.further["campaign"].to_numpy(dtype=str)).tolist()
    return (
        f"{counted(len(campaigns), 'campaign')} ({', '.join(campaigns[:5])}); expected "
        "at least two, and all conditions in the others if one is left out. Without "
        "the column campaign, the accuracy may be too high"
    )


def _of_spectra(nperseg, classifier):
    spectra = FunctionTransformer(log_spectrum, kw_args={"nperseg": nperseg})
    return make_pipeline(spectra, classifier)


def log_spectrum(X: NDArray[Any], nperseg: int) -> NDArray[Any]:
    """Compute the log power spectrum of the output at unit RMS, by Welch's method.

    Parameters
    ----------
    X : ndarray of shape (n_windows, n_samples) or (n_windows, n_channels, n_samples)
        Windows.
    nperseg : int
        Samples in a segment; there are half as many bands.
    """
    y = scale(output_of_windows(X), axis=1)
    return np.log(welch(y, nperseg=nperseg, axis=1)[1][:, 1:] + np.finfo(float).tiny)
