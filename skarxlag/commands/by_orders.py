"""``skarxlag diagnose --bearing`` without a model: places of faults by the bearing's orders."""

import argparse
import zipfile
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from ..diagnosers import make_fault_order_classifier
from ..fault_places import HEALTHY
from ..quality import signal_quality
from ..recordings.listing import ListedRecording
from ..verdicts import NO_SIGNAL
from .diagnosis import Diagnosis
from .messages import CommandError, Progress


def is_model(path: Path) -> bool:
    """Return whether a path is that of a saved model; a missing file is one if its name says so."""
    return path.suffix == ".skops" or (path.is_file() and zipfile.is_zipfile(path)
                                       and path.suffix != ".npz")  # fmt: skip


def diagnose_by_orders(
    args: argparse.Namespace, recordings: list[ListedRecording]
) -> list[Diagnosis]:
    """Name the place of a fault in each recording.

    Parameters
    ----------
    args : argparse.Namespace
        With ``bearing``, ``quiet`` and ``verbose``.
    recordings : list of ListedRecording
        Recordings with their speeds.

    Returns
    -------
    list of Diagnosis
        One for each recording, in order. The evidence is its remark.
    """
    found = []
    with Progress(len(recordings), "recordings", args) as progress:
        for recording in recordings:
            try:
                found.append(_diagnosed(recording, args.bearing))
            except (OSError, ValueError, ImportError, MemoryError, CommandError) as error:
                found.append(Diagnosis.failed(error))
            verdict = found[-1].verdict["verdict"]
            progress.step(f"{recording.name}: {found[-1].error or verdict}")
    return found


def _diagnosed(recording, bearing):
    recording = recording.with_speed()
    if recording.rpm is None:
        raise ValueError(
            f"{recording.name}: the speed of the shaft is not stated; expected --rpm, a column "
            "rpm, or a speed in the file."
        )
    ((signal, sampling_rate),) = recording.blocks()
    rate = sampling_rate or recording.sampling_rate
    if rate is None:
        raise ValueError(f"{recording.name}: the sampling rate is not stated; expected "
                         "--sampling-rate.")  # fmt: skip
    X = np.asarray(signal)[np.newaxis]
    quality = signal_quality(X)[0]
    row = partial(pd.DataFrame, index=[0])
    if quality != "good":
        windows = row({"start": 0, "verdict": NO_SIGNAL, "alarm": False, "quality": quality})
        verdict = {"verdict": NO_SIGNAL, "probability": np.nan, "alarm": "-", "p-value": np.nan}
        return Diagnosis(verdict | {"windows": 1, "no signal": 1}, windows, rate)
    classifier = make_fault_order_classifier(bearing=bearing, sampling_rate=rate).fit(X)
    found = classifier.diagnose(X, rpm=recording.rpm)
    classes, probabilities = classifier.classes_, found.probability[0]
    verdict, alarm = found.named[0], bool(found.alarm[0])
    is_class = classes == verdict
    answer = {
        "verdict": verdict,
        "probability": float(probabilities[is_class][0]) if is_class.any() else np.nan,
        "alarm": "yes" if alarm else "no",
        "p-value": float(found.p_value[0]),
        "windows": 1,
        "no signal": 0,
    }
    each = {f"probability of {name}": p for name, p in zip(classes, probabilities, strict=True)}
    windows = row({"start": 0, "verdict": verdict, "alarm": alarm, "quality": quality} | each)
    evidence = found.evidence[0]
    return Diagnosis(answer, windows, rate, (evidence[0].upper() + evidence[1:] + ".",))


def heading(bearing: str) -> str:
    """Return the first line of the output."""
    return (
        f"No model: places of faults by the orders of bearing {bearing}. {HEALTHY} means that no "
        "comb exceeds the limit of healthy recordings of other machines."
    )
