"""The protocol behind Tables 2-9 of Piltan and Kim (2019)."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from sklearn.utils import Bunch
from sklearn.utils.metadata_routing import get_routing_for_object

from ..accuracy_tables import scored_windows
from ..model_selection import speed_splits
from .tables import load_tables

#: "Dataset 4 is used as a training dataset to adjust the threshold" (section 5).
CALIBRATION_RPM = 500.0


def run_protocol(
    load: Callable[..., Any],
    diagnosers: dict[str, Any],
    *,
    progress: Callable[[str], object] = lambda text: None,
) -> Bunch:
    """Compute verdicts under the paper's protocol.

    Each crack size is diagnosed separately, together with the normal windows. A diagnoser is fitted
    on all windows at 500 rpm and scored on all windows at 300, 400, 450 and 500 rpm. At 500 rpm, it
    is thus scored on the windows that it was fitted on, as in the paper's Table 5. This score is
    optimistic. To measure by how much, a second diagnoser is fitted on the first halves of the
    recordings at 500 rpm and scored on the second halves.

    Parameters
    ----------
    load : callable
        Function of a crack size in mm and a speed in rpm. It returns a Bunch with the windows of
        all conditions, as `skarxlag.datasets.simulate_rig` does. It is called once for each pair,
        and only one rig is in memory at a time.
    diagnosers : dict of str to callable
        Names, and functions that return an unfitted classifier and take the name of the healthy
        condition as ``healthy``. A classifier that requests ``rpm`` is given the speeds.
    progress : callable, default: ignore it
        Function that receives messages about the progress.

    Returns
    -------
    Bunch
        - ``verdicts``: DataFrame as `skarxlag.accuracy_tables` describes it, with ``crack_mm``,
          in ascending order of crack size and test speed.
        - ``halves``: DataFrame of the same kind for the second halves at 500 rpm.
        - ``fitted``: dict from (crack_mm, name) to the classifier that gave ``verdicts``.

    Examples
    --------
    >>> from skarxlag import make_alpio
    >>> from skarxlag.datasets import simulate_rig
    >>> def load(crack_mm, rpm):
    ...     return simulate_rig(crack_mm=crack_mm, rpm=rpm, n_samples=2400, window_length=400)
    >>> outcome = run_protocol(load, {"ALPIO": make_alpio})
    >>> len(outcome.verdicts), len(outcome.halves)  # 2 cracks, 4 speeds, 8 conditions, 6 windows
    (384, 48)
    """
    cracks = load_tables().tables[2].frame.columns.unique("crack_mm")
    return joined_outcomes([score_crack(load, mm, diagnosers, progress=progress) for mm in cracks])


def score_crack(
    load: Callable[[float, float], Bunch],
    crack_mm: float,
    diagnosers: dict[str, Callable[..., Any]],
    *,
    progress: Callable[[str], object] = lambda text: None,
) -> Bunch:
    """The protocol for one crack size.

    Parameters
    ----------
    load, diagnosers, progress
        As for `run_protocol`.
    crack_mm : float
        Crack size in mm.

    Returns
    -------
    Bunch
        As of `run_protocol`, for this crack size, in the order of the work.
    """
    frames, halves, fitted = [], [], {}
    printed = load_tables().tables
    progress(f"crack {crack_mm:g} mm: {CALIBRATION_RPM:g} rpm,")
    rig = load(crack_mm, CALIBRATION_RPM)
    ((first, second),) = speed_splits(
        rig.rpm, train_rpm=CALIBRATION_RPM, recording=rig.recording, same_speed=True
    )
    constants = {
        name: {"diagnoser": name, "crack_mm": crack_mm, "train_rpm": CALIBRATION_RPM}
        for name in diagnosers
    }
    for name, make in diagnosers.items():
        progress(f" {name},")
        half = _fitted(make, rig, first)
        halves.append(scored_windows(half, rig, second, constants[name]))
        everything = np.arange(len(rig.data))
        whole = _fitted(make, rig, everything)
        frames.append(scored_windows(whole, rig, everything, constants[name]))
        fitted[crack_mm, name] = whole
    for number in (2, 3, 4):
        rpm = float(printed[number].rpm)
        progress(f" {rpm:g} rpm,")
        del rig  # before the next one is made
        rig = load(crack_mm, rpm)
        for name in diagnosers:
            diagnoser = fitted[crack_mm, name]
            frames.append(scored_windows(diagnoser, rig, np.arange(len(rig.data)), constants[name]))
    progress(" done\n")
    return Bunch(verdicts=pd.concat(frames), halves=pd.concat(halves), fitted=fitted)


def joined_outcomes(outcomes: Sequence[Bunch]) -> Bunch:
    """What `run_protocol` returns, of parts of its work.

    Parameters
    ----------
    outcomes : sequence of Bunch
        As `score_crack` returns them: all diagnosers of one crack size, then those of the next.

    Returns
    -------
    Bunch
        All of them.
    """
    verdicts = pd.concat([outcome.verdicts for outcome in outcomes])
    verdicts = verdicts.sort_values(["crack_mm", "test_rpm"], kind="stable")
    return Bunch(
        verdicts=verdicts.reset_index(drop=True),
        halves=pd.concat([outcome.halves for outcome in outcomes], ignore_index=True),
        fitted={key: each for outcome in outcomes for key, each in outcome.fitted.items()},
    )


def _fitted(make, rig, rows):
    """A classifier that is fitted on some rows of a rig, with their speeds if it requests them."""
    classifier = make(healthy=rig.target_names[0])
    wanted = get_routing_for_object(classifier).consumes("fit", ["rpm"])
    return classifier.fit(
        rig.data[rows], rig.target[rows], **({"rpm": rig.rpm[rows]} if wanted else {})
    )
