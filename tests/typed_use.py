"""Calls that are right and wrong for a type checker; `checks.sh` runs one on this file.

A comment that ignores an error is an error itself where there is none.
"""

# pyright: basic, reportUnnecessaryTypeIgnoreComment=error

import numpy as np
from sklearn.utils import Bunch

from skarxlag import (
    ARXLaguerre,
    SpeedSplit,
    make_diagnoser,
    make_windows,
    read_recording,
)
from skarxlag.datasets import simulate_rig
from skarxlag.model_selection import evaluation_summary
from skarxlag.plotting import IdentificationDisplay


def right() -> tuple[float, int]:
    """Calls that are right pass, and types of their results are known."""
    signal, _ = read_recording("run.npy")
    windows = make_windows(signal, 1200, hop=600)
    diagnoser = make_diagnoser(healthy="Normal", verbose=True).fit(
        windows, sample_weight=[1.0]
    )
    found: Bunch = diagnoser.diagnose(windows, rpm=500)
    rows = ARXLaguerre(order=2).fit(windows).transform(windows)
    rig = simulate_rig(rpm=np.array([300.0, 500.0]), crack_mm=3)
    shown = IdentificationDisplay.from_estimator(
        diagnoser, windows[0], axes=np.array([None, None])
    )
    table = evaluation_summary(rig.verdicts)
    return diagnoser.score(
        windows, found.verdict
    ) + shown.fit_percentage, rows.ndim + len(table)


def wrong() -> None:
    """Calls that are wrong do not pass."""
    make_windows(np.zeros(9), "1200")  # pyright: ignore[reportArgumentType]
    SpeedSplit(train_rmp=500)  # pyright: ignore[reportCallIssue]
    ARXLaguerre(2)  # pyright: ignore[reportCallIssue]
    SpeedSplit(train_rpm="500")  # pyright: ignore[reportArgumentType]
    windows = make_windows(np.zeros(9), 3)
    windows.lower()  # pyright: ignore[reportAttributeAccessIssue]
