"""The protocol behind Tables 2-9 of Piltan and Kim (2019)."""

import numpy as np
import pandas as pd
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch

from benchmarks.paper.printed_tables import load_tables
from skarxlag.core.capabilities import capabilities, requests
from skarxlag.model_selection import SpeedSplit

#: "Dataset 4 is used as a training dataset to adjust the threshold" (section 5).
CALIBRATION_RPM = 500.0


def run_protocol(load, diagnosers, *, progress=lambda text: None):
    """Compute verdicts under the paper's protocol.

    Each crack size is diagnosed separately, together with the normal windows. A
    diagnoser is fitted on all windows at 500 rpm and scored on all windows at 300, 400,
    450 and 500 rpm. At 500 rpm, it is thus scored on the windows that it was fitted on,
    as in the paper's Table 5. This score is optimistic. To measure by how much, a
    second diagnoser is fitted on the first halves of the recordings at 500 rpm and
    scored on the second halves.

    Parameters
    ----------
    load : callable
        Function of a crack size in mm and a speed in rpm. It returns a Bunch with the
        windows of all conditions, as `skarxlag.datasets.simulate_rig` does. It is
        called once for each pair, and only one rig is in memory at a time.
    diagnosers : dict of str to callable
        Names, and functions that return an unfitted classifier and take the name of the
        healthy condition as ``healthy``. A classifier that requests ``rpm`` is given
        the speeds.
    progress : callable, default: ignore it
        Function that receives messages about the progress.

    Returns
    -------
    Bunch
        - ``verdicts``: DataFrame with a row for each window, with
          ``crack_mm``, in ascending order of crack size and test speed.
        - ``halves``: DataFrame of the same kind for the second halves at 500 rpm.
        - ``fitted``: dict from (crack_mm, name) to the classifier that gave
          ``verdicts``.

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
    printed = load_tables().tables
    verdicts = []
    halves = []
    fitted = {}
    for crack_mm in printed[2].frame.columns.unique("crack_mm"):
        progress(f"crack {crack_mm:g} mm: {CALIBRATION_RPM:g} rpm,")
        rig = load(crack_mm, CALIBRATION_RPM)
        splitter = SpeedSplit(train_rpm=CALIBRATION_RPM, same_speed=True)
        groups = np.column_stack([rig.rpm, rig.recording])
        ((first, second),) = splitter.split(rig.data, groups=groups)
        constants = {
            name: {
                "diagnoser": name,
                "crack_mm": crack_mm,
                "train_rpm": CALIBRATION_RPM,
            }
            for name in diagnosers
        }
        for name, make in diagnosers.items():
            progress(f" {name},")
            half = _fitted(make, rig, first)
            halves.append(scored_windows(half, rig, second, constants[name]))
            everything = np.arange(len(rig.data))
            fitted[crack_mm, name] = _fitted(make, rig, everything)
            whole = fitted[crack_mm, name]
            verdicts.append(scored_windows(whole, rig, everything, constants[name]))
        for number in (2, 3, 4):
            rpm = float(printed[number].rpm)
            progress(f" {rpm:g} rpm,")
            del rig  # Only one rig is in memory at a time.
            rig = load(crack_mm, rpm)
            for name in diagnosers:
                rows = np.arange(len(rig.data))
                whole = fitted[crack_mm, name]
                verdicts.append(scored_windows(whole, rig, rows, constants[name]))
        del rig
        progress(" done\n")
    verdicts = pd.concat(verdicts).sort_values(["crack_mm", "test_rpm"], kind="stable")
    return Bunch(
        verdicts=verdicts.reset_index(drop=True),
        halves=pd.concat(halves, ignore_index=True),
        fitted=fitted,
    )


def _fitted(make, rig, rows):
    """Return a classifier that is fitted on some rows of a rig."""
    classifier = make(healthy=rig.target_names[0])
    # Pipelines of scikit-learn pass metadata on only if metadata routing is enabled.
    takes_rpm = type(classifier) is not Pipeline and requests(classifier, "fit", "rpm")
    speeds = {"rpm": rig.rpm[rows]} if takes_rpm else {}
    return classifier.fit(rig.data[rows], rig.target[rows], **speeds)


def scored_windows(diagnoser, rig, test, constants):
    """Predict the conditions of some windows of a rig.

    Parameters
    ----------
    diagnoser : classifier
        Fitted. If it takes ``rpm``, it gets the speeds of the rig.
    rig : Bunch
        As `skarxlag.datasets` returns it.
    test : ndarray of int of shape (n_test,)
        Rows of the windows.
    constants : dict of str to scalar
        Columns that hold one value, such as ``train_rpm``.

    Returns
    -------
    DataFrame
        The constants, then ``test_rpm``, ``recording``, ``start``, ``true``,
        ``predicted``.
    """
    speeds = {"rpm": rig.rpm[test]} if capabilities(diagnoser).takes_rpm else {}
    return pd.DataFrame(
        constants
        | {
            "test_rpm": rig.rpm[test],
            "recording": rig.recording[test],
            "start": rig.start[test],
            "true": rig.target[test],
            "predicted": diagnoser.predict(rig.data[test], **speeds),
        }
    )
