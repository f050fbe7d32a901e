"""``skarxlag evaluate TABLE``: accuracy across the speeds of the user's own recordings."""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
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

from .._files import write_atomically
from ..accuracy_tables import confusion_table
from ..diagnosers import make_diagnoser
from ..recordings.rig import load_recordings
from .messages import UsageError, as_command_error
from .tables import matrix_text

#: Windows are this long if every recording holds two of them.
_LONG, _SHORT = 4800, 1200
_PROTOCOLS = {
    "in": "trained at one speed, tested at all others",
    "out": "trained at all speeds but one, tested at that",
}


@dataclass(frozen=True)
class Split:
    """Windows of a training and of its test.

    Parameters
    ----------
    train, test : ndarray of int
        Rows of the windows.
    label : str
        Description for progress lines.
    columns : dict
        Constant columns of the verdicts.
    """

    train: NDArray[Any]
    test: NDArray[Any]
    label: str
    columns: dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A rig, its splits, and the makers of the diagnosers that are compared on it."""

    title: str
    stem: str
    rig: Bunch
    splits: list[Split]
    makers: dict[str, Callable[[], Any]]


def own_case(args: argparse.Namespace) -> Case:
    """Return the splits of the recordings of a table, and the diagnosers to compare.

    Recordings that are tested are never those of the training. If the table has a column
    ``campaign``, neither are their campaigns: recordings between which nothing was remounted.
    """
    rig = _loaded(args)
    splits = list(_splits(rig))
    if not splits:
        raise UsageError(f"{args.table}: no speed or campaign can be left out")
    makers = {
        "make_diagnoser": partial(make_diagnoser, sampling_rate=float(rig.sampling_rate)),
        "log spectrum + LDA": lambda: _peer(256, LinearDiscriminantAnalysis()),
        "band energies + forest": lambda: _peer(64, RandomForestClassifier(random_state=0)),
    }
    return Case(str(args.table), Path(args.table).stem, rig, splits, makers)


def _loaded(args):
    with as_command_error():
        try:
            rig = load_recordings(args.table, window_length=args.window_length or _LONG)
        except ValueError:
            if args.window_length is not None:
                raise
            rig = load_recordings(args.table, window_length=_SHORT)
    if rig.target is None or rig.rpm is None:
        raise UsageError(f"{args.table}: needs the columns condition and rpm")
    n_speeds = len(np.unique(rig.rpm))
    if n_speeds < 2 or len(rig.target_names) < 2:
        raise UsageError(
            f"{args.table}: {len(rig.target_names)} conditions at {n_speeds} speeds; expected "
            "at least two of each"
        )
    return rig


def _splits(rig) -> Iterator[Split]:
    """Yield the splits of both protocols, without those whose training lacks a condition."""
    parts = [(True, True)]
    if "campaign" in rig.further:
        campaign = rig.further["campaign"].loc[rig.recording].to_numpy(dtype=str)
        parts = [(campaign != each, campaign == each) for each in np.unique(campaign)]
    for protocol, speed, (learned, tested) in product(_PROTOCOLS, np.unique(rig.rpm), parts):
        at_speed = rig.rpm == speed
        is_train = at_speed if protocol == "in" else ~at_speed
        train, test = np.flatnonzero(is_train & learned), np.flatnonzero(~is_train & tested)
        if len(test) > 0 and len(set(rig.target[train])) == len(rig.target_names):
            label = f"one speed {protocol}: {speed:g} rpm"
            yield Split(train, test, label, {"protocol": protocol, "left": float(speed)})


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


def own_report(args: argparse.Namespace, case: Case, verdicts: pd.DataFrame, _: Any = None) -> str:
    """Write the verdicts, and return the report."""
    path = args.output / f"{case.stem}_verdicts.csv"
    write_atomically(path, verdicts.to_csv(index=False).encode())
    rig, has_campaigns = case.rig, "campaign" in case.rig.further
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
    lines = [
        f"{args.table}: {len(rig.target_names)} conditions ({', '.join(rig.target_names)}) at "
        f"{speeds} rpm, windows of {rig.data.shape[-1]} samples at {rig.sampling_rate:g} Hz. "
        f"Training and test differ in recording{' and campaign' if has_campaigns else ''}."
    ]
    if not has_campaigns:
        lines.append(
            "The table has no column campaign. If the test was measured without remounting after "
            "the training, the accuracy may be too high."
        )
    # The verdict on a recording is that of most of its windows.
    keys = ["protocol", "diagnoser", "left", "test_rpm", "recording", "true"]
    most = verdicts.groupby(keys, sort=False)["predicted"].agg(lambda each: each.mode().iloc[0])
    recordings = most.reset_index()
    for protocol, (name, frame) in product(
        verdicts["protocol"].unique(), {"windows": verdicts, "recordings": recordings}.items()
    ):
        own = frame[frame["protocol"] == protocol]
        hits = own.assign(hit=100.0 * (own["true"] == own["predicted"]))
        table = hits.pivot_table("hit", "diagnoser", "test_rpm").rename(columns="{:g} rpm".format)
        table = table.assign(mean=table.mean(axis=1)).round(1).rename_axis(columns=None)
        title = f"\nAccuracy of {name} in %, {_PROTOCOLS[protocol]}, by speed of the test"
        lines += [title, table.to_string()]
    own = recordings[recordings["diagnoser"] == "make_diagnoser"]
    matrix = matrix_text(confusion_table(own, rig.target_names))
    title = "\nConfusion matrix of recordings, make_diagnoser, all tests; rows: true condition, "
    return "\n".join(
        [*lines, f"{title}columns: verdict, corner: accuracy in %", matrix.to_string()]
    )
