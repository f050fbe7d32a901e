"""``skarxlag evaluate TABLE``: accuracy across the speeds of the user's own recordings."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils import Bunch

from .._answers import requests
from .._files import write_atomically
from ..accuracy_tables import confusion_table, scored_windows
from ..diagnosers import make_diagnoser
from ..recordings.rig import load_recordings
from .messages import Progress, UsageError, as_command_error
from .tables import matrix_text

#: Windows are this long if every recording holds two of them.
_LONG, _SHORT = 4800, 1200
_N_BANDS = 32
_PROTOCOLS = {
    "in": "trained at one speed, tested at all others",
    "out": "trained at all speeds but one, tested at that",
}


def evaluate_table(args: argparse.Namespace) -> int:
    """Compare the recommended diagnoser with two others on the recordings of a table.

    Recordings that are tested are never those of the training. If the table has a column
    ``campaign``, neither are their campaigns: recordings between which nothing was remounted.
    """
    rig = _loaded(args)
    campaign = _campaigns(rig)
    splits = {name: list(_splits(rig, campaign, name)) for name in _PROTOCOLS}
    total = sum(map(len, splits.values())) * len(_makers(rig))
    if total == 0:
        raise UsageError(f"{args.table}: no speed or campaign can be left out")
    verdicts = []
    with as_command_error(), Progress(total, "fits", args) as progress:
        for protocol, chosen in splits.items():
            for train, test, speed in chosen:
                for title, make in _makers(rig).items():
                    diagnoser = make()
                    takes_rpm = requests(diagnoser, "fit", "rpm")
                    speeds = {"rpm": rig.rpm[train]} if takes_rpm else {}
                    diagnoser.fit(rig.data[train], rig.target[train], **speeds)
                    constants = {"protocol": protocol, "diagnoser": title, "left": speed}
                    verdicts.append(scored_windows(diagnoser, rig, test, constants))
                    progress.step(f"{title}, one speed {protocol}: {speed:g} rpm")
    verdicts = pd.concat(verdicts, ignore_index=True)
    text = "\n".join(_report(args, rig, campaign, verdicts))
    print(text)
    with as_command_error():
        stem = Path(args.table).stem
        write_atomically(args.output / f"{stem}_report.txt", (text + "\n").encode())
        content = verdicts.to_csv(index=False).encode()
        write_atomically(args.output / f"{stem}_verdicts.csv", content)
    print(f"Report and verdicts are in {args.output.resolve()}")
    return 0


def _loaded(args):
    with as_command_error():
        length = args.window_length or _LONG
        try:
            rig = load_recordings(args.table, window_length=length)
        except ValueError:
            if args.window_length is not None:
                raise
            rig = load_recordings(args.table, window_length=_SHORT)
    if rig.target is None or rig.rpm is None:
        raise UsageError(f"{args.table}: needs the columns condition and rpm")
    speeds = np.unique(rig.rpm)
    if len(speeds) < 2 or len(rig.target_names) < 2:
        raise UsageError(
            f"{args.table}: {len(rig.target_names)} conditions at {len(speeds)} speeds; expected "
            "at least two of each"
        )
    return rig


def _campaigns(rig):
    """Return the campaign of each window, or None if the table has no such column."""
    if "campaign" not in rig.further:
        return None
    return rig.further["campaign"].loc[rig.recording].to_numpy(dtype=str)


def _splits(
    rig: Bunch, campaign: NDArray[Any] | None, protocol: str
) -> Iterator[tuple[NDArray[Any], NDArray[Any], float]]:
    """Yield windows of training and test, and the speed that is left in or out.

    Parts whose training lacks a condition are left out.
    """
    for speed in np.unique(rig.rpm):
        inside = rig.rpm == speed
        train, test = (inside, ~inside) if protocol == "in" else (~inside, inside)
        for each in [None] if campaign is None else np.unique(campaign):
            is_own = np.zeros(len(test), dtype=bool) if each is None else campaign == each
            learned = np.flatnonzero(train & ~is_own)
            tested = np.flatnonzero(test if each is None else test & is_own)
            if len(tested) > 0 and len(set(rig.target[learned])) == len(rig.target_names):
                yield learned, tested, float(speed)


def _makers(rig):
    return {
        "make_diagnoser": lambda: make_diagnoser(sampling_rate=float(rig.sampling_rate)),
        "log spectrum + LDA": lambda: _peer(log_spectrum, LinearDiscriminantAnalysis()),
        "band energies + forest": lambda: _peer(
            band_energies, RandomForestClassifier(random_state=0)
        ),
    }


def _peer(features, classifier) -> Pipeline:
    return make_pipeline(FunctionTransformer(features), classifier)


def log_spectrum(X: NDArray[Any]) -> NDArray[Any]:
    """Compute the log power spectrum of the output at unit RMS, by Welch's method."""
    return np.log(welch(_unit_rms(X), axis=1)[1][:, 1:] + np.finfo(float).tiny)


def band_energies(X: NDArray[Any]) -> NDArray[Any]:
    """Compute the log energy of the output at unit RMS in 32 bands of equal width."""
    power = np.abs(np.fft.rfft(_unit_rms(X), axis=1)[:, 1:]) ** 2
    bands = np.array_split(power, _N_BANDS, axis=1)
    return np.log(np.column_stack([band.sum(axis=1) for band in bands]) + np.finfo(float).tiny)


def _unit_rms(X):
    y = X if X.ndim == 2 else X[:, 0]
    y = y - y.mean(axis=1, keepdims=True)
    rms = np.sqrt(np.mean(y**2, axis=1, keepdims=True))
    return y / np.where(rms > 0, rms, 1.0)


def by_recording(verdicts: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each test of a recording, with the verdict of most of its windows."""
    keys = ["protocol", "diagnoser", "left", "test_rpm", "recording", "true"]
    groups = verdicts.groupby(keys, sort=False)["predicted"]
    return groups.agg(lambda values: values.mode().iloc[0]).reset_index()


def _report(args, rig, campaign, verdicts):
    speeds = ", ".join(f"{speed:g}" for speed in np.unique(rig.rpm))
    apart = "recording" if campaign is None else "recording and campaign"
    yield (
        f"{args.table}: {len(rig.target_names)} conditions ({', '.join(rig.target_names)}) at "
        f"{speeds} rpm, windows of {rig.data.shape[-1]} samples at {rig.sampling_rate:g} Hz. "
        f"Training and test differ in {apart}."
    )
    if campaign is None:
        yield (
            "The table has no column campaign. If the test was measured without remounting after "
            "the training, the accuracy may be too high."
        )
    recordings = by_recording(verdicts)
    for protocol, about in _PROTOCOLS.items():
        tables = {}
        for name, frame in (("windows", verdicts), ("recordings", recordings)):
            own = frame[frame["protocol"] == protocol]
            if own.empty:
                continue
            hits = (own["true"] == own["predicted"]).groupby([own["diagnoser"], own["test_rpm"]])
            accuracy = 100 * hits.mean().unstack()
            accuracy.columns = [f"{speed:g} rpm" for speed in accuracy.columns]
            tables[name] = accuracy.assign(mean=accuracy.mean(axis=1)).round(1)
        for name, table in tables.items():
            yield f"\nAccuracy of {name} in %, {about}, by speed of the test\n{table.to_string()}"
    own = recordings[recordings["diagnoser"] == "make_diagnoser"]
    matrix = matrix_text(confusion_table(own, rig.target_names))
    yield (
        "\nConfusion matrix of recordings, make_diagnoser, all tests; rows: true condition, "
        f"columns: verdict, corner: accuracy in %\n{matrix.to_string()}"
    )
