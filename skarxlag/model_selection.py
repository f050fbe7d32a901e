"""Cross-validation splits across shaft speeds."""

import numpy as np
from sklearn.utils import check_array, check_consistent_length, column_or_1d


def speed_splits(rpm, *, train_rpm=None, recording=None, same_speed=False):
    """Splits that train at one speed and test at another.

    Parameters
    ----------
    rpm : array-like of shape (n_windows,)
        Nominal shaft speed of each window.
    train_rpm : float or None, default=None
        The speed to train at. None: every speed in turn.
    recording : array-like of shape (n_windows,) or None, default=None
        Recording of each window, in time order. Given, the first half of every recording is for
        training and the second half for testing, so that nothing of the second halves enters a
        fit; the middle window of an odd number belongs to neither. None: all windows are used.
    same_speed : bool, default=False
        Whether the training speed is among the test speeds. It needs `recording`: without halves
        a window would be on both sides.

    Returns
    -------
    list of tuple of ndarray
        Pairs (train indices, test indices), one for each ordered pair of speeds, in ascending
        order of the training speed, then of the test speed.

    Raises
    ------
    ValueError
        If there are not two speeds, `train_rpm` is not in `rpm`, `same_speed` is asked for
        without `recording`, or halves leave no window at a speed.

    Examples
    --------
    >>> for train, test in speed_splits([300, 300, 400, 500], train_rpm=300):
    ...     print(train, test)
    [0 1] [2]
    [0 1] [3]
    """
    rpm = column_or_1d(check_array(rpm, ensure_2d=False, input_name="rpm"))
    speeds = np.unique(rpm)
    if same_speed and recording is None:
        raise ValueError("same_speed=True needs `recording`, to split each recording in time.")
    if len(speeds) < 2 and not same_speed:
        raise ValueError(f"rpm has one speed, {speeds.tolist()}, expected at least two.")
    if train_rpm is not None and train_rpm not in speeds:
        raise ValueError(f"train_rpm={train_rpm!r} is not in rpm, which has {speeds.tolist()}.")
    first, second = _halves(rpm, recording)
    splits = [
        (np.flatnonzero(first & (rpm == train)), np.flatnonzero(second & (rpm == test)))
        for train in (speeds if train_rpm is None else [train_rpm])
        for test in speeds
        if same_speed or test != train
    ]
    if not all(len(train) and len(test) for train, test in splits):
        raise ValueError(
            "Halves of each `recording` leave no window at some speed, expected recordings of at "
            "least two windows."
        )
    return splits


def _halves(rpm, recording):
    if recording is None:
        everything = np.ones(len(rpm), dtype=bool)
        return everything, everything
    recording = column_or_1d(recording)
    check_consistent_length(rpm, recording)
    first = np.zeros(len(rpm), dtype=bool)
    second = np.zeros(len(rpm), dtype=bool)
    for name in np.unique(recording):
        windows = np.flatnonzero(recording == name)
        half = len(windows) // 2
        first[windows[:half]] = True
        second[windows[len(windows) - half :]] = True
    return first, second
