"""Leave one speed in: fit at one shaft speed, score at every other.

Every recording is cut in time. A method is fitted on the first halves of the recordings
of one speed and scored on the second halves of every speed, so nothing of another speed
and nothing of the second halves enters a fit. Pure functions on arrays; no files, no
printing.
"""

from collections import Counter
from time import process_time

import numpy as np
import pandas as pd
from sklearn.metrics import accuracy_score, recall_score

from skarxlag.model_selection import first_and_second_half

GROUP_SIZE = 10
SMALLEST_PROBABILITY = 1e-6


def consecutive_groups(recording, start, size=GROUP_SIZE):
    """Return all groups of `size` consecutive windows of one recording; groups overlap.

    Parameters
    ----------
    recording, start : arrays of shape (n_windows,)
        As in :func:`first_and_second_half`.
    size : int, default=10
        Windows in a group.

    Returns
    -------
    groups : array of int of shape (n_groups, size)
        Row numbers, in time order within a group. A recording with fewer than `size`
        windows gives no group.

    Examples
    --------
    >>> consecutive_groups(["a", "b", "a", "a"], [100, 0, 200, 0], size=2)
    array([[3, 0],
           [0, 2]])
    """
    recording = np.asarray(recording)
    start = np.asarray(start)
    groups = [np.empty((0, size), dtype=int)]
    for name in np.unique(recording):
        rows = np.flatnonzero(recording == name)
        rows = rows[np.argsort(start[rows], kind="stable")]
        if len(rows) >= size:
            groups.append(np.lib.stride_tricks.sliding_window_view(rows, size))
    return np.concatenate(groups)


def log_evidence(classifier, X, predicted):
    """Compute the evidence of each window for each class, which is summed over windows.

    Parameters
    ----------
    classifier : fitted classifier
    X : array of shape (n_windows, ...)
    predicted : array of shape (n_windows,)
        Result of ``classifier.predict`` for X.

    Returns
    -------
    evidence : array of shape (n_windows, n_classes)
        In the order of ``classifier.classes_``.
    rule : {"log-probability", "decision function", "vote"}
        ``predict_proba`` if the classifier has it, otherwise ``decision_function``,
        otherwise one vote for the predicted class. Probabilities are floored at 1e-6
        before the logarithm, so that one window on which, for example, no tree of a
        forest voted for a class does not veto that class for the group.
    """
    classes = np.asarray(classifier.classes_)
    if hasattr(classifier, "predict_proba"):
        probability = np.asarray(classifier.predict_proba(X), dtype=float)
        return np.log(np.maximum(probability, SMALLEST_PROBABILITY)), "log-probability"
    if hasattr(classifier, "decision_function"):
        decision = np.asarray(classifier.decision_function(X), dtype=float)
        if decision.ndim == 1:
            decision = np.column_stack([-decision, decision])
        return decision, "decision function"
    return (np.asarray(predicted)[:, None] == classes).astype(float), "vote"


def check_rig(rig, window_length):
    """Raise an error if the protocol cannot be applied to a rig.

    Parameters
    ----------
    rig : Bunch
        Windows of a rig, as the functions of ``rigs`` return them.
    window_length : int
        Samples in a window.

    Raises
    ------
    ValueError
        If there are fewer than two speeds, an array has another number of rows than
        `data`, or a condition has no window in the first half at one speed or in the
        second at another.
    """
    n_windows = len(rig.data)
    for name in ("target", "rpm", "recording", "start"):
        if len(rig[name]) != n_windows:
            raise ValueError(
                f"{name} has {len(rig[name])} rows, data has {n_windows} windows."
            )
    if rig.data.shape[-1] != window_length:
        raise ValueError(
            f"windows have {rig.data.shape[-1]} samples, window_length is {window_length}."
        )
    speeds = np.unique(rig.rpm)
    if len(speeds) < 2:
        raise ValueError(f"rpm must hold at least two speeds, got {speeds.tolist()}.")
    halves = first_and_second_half(rig.recording, rig.start, window_length)
    for half, mask in zip(("first", "second"), halves, strict=True):
        for speed in speeds:
            missing = set(rig.target_names) - set(rig.target[mask & (rig.rpm == speed)])
            if missing:
                raise ValueError(
                    f"conditions {sorted(missing)} have no window in the {half} half of the "
                    f"recordings at {speed:g} rpm; windows of {window_length} samples."
                )


def score(y_true, y_pred):
    """Accuracy, balanced accuracy and counts of one set of verdicts.

    Returns
    -------
    scores : dict
        ``accuracy`` and ``balanced_accuracy`` (mean recall of the conditions in
        `y_true`), NaN when there is no verdict; ``verdicts``, how many; ``confusion``,
        a Counter of (true, predicted).
    """
    y_true = np.asarray(y_true)
    y_pred = np.asarray(y_pred)
    scores = {
        "accuracy": np.nan,
        "balanced_accuracy": np.nan,
        "verdicts": len(y_true),
        "confusion": Counter(zip(y_true.tolist(), y_pred.tolist(), strict=True)),
    }
    if len(y_true):
        scores["accuracy"] = accuracy_score(y_true, y_pred)
        scores["balanced_accuracy"] = recall_score(
            y_true, y_pred, labels=np.unique(y_true), average="macro"
        )
    return scores


def by_recording(recording, right):
    """Count windows and right verdicts of each recording.

    Examples
    --------
    >>> by_recording(["a", "b", "a"], [True, True, False]).to_numpy().tolist()
    [['a', 2, 1], ['b', 1, 1]]
    """
    verdicts = pd.DataFrame(
        {"recording": recording, "right": np.asarray(right, dtype=int)}
    )
    counts = verdicts.groupby("recording").right.agg(windows="size", right="sum")
    return counts.reset_index()


def leave_one_speed_in(make_classifier, rig, window_length):
    """Fit at each speed, score at every speed.

    Parameters
    ----------
    make_classifier : callable
        Returns a new classifier.
    rig : Bunch
        Windows of a rig, as the functions of ``rigs`` return them.
    window_length : int
        Samples in a window.

    Yields
    ------
    pair : dict
        ``train_rpm`` and ``test_rpm``; ``fit_seconds`` and ``predict_seconds``,
        processor time, so that a busy machine does not count; ``evidence``, the rule of
        :func:`log_evidence`; ``window`` and ``group``, the :func:`score` of single
        windows and of groups of 10; ``recordings``, for each test recording the number
        of windows and of right verdicts. The pairs of equal speeds are among them.
    """
    check_rig(rig, window_length)
    first, second = first_and_second_half(rig.recording, rig.start, window_length)
    speeds = np.unique(rig.rpm)
    for train_rpm in speeds:
        train = first & (rig.rpm == train_rpm)
        clock = process_time()
        classifier = make_classifier().fit(rig.data[train], rig.target[train])
        fit_seconds = process_time() - clock
        for test_rpm in speeds:
            test = second & (rig.rpm == test_rpm)
            X = rig.data[test]
            y = rig.target[test]
            clock = process_time()
            predicted = classifier.predict(X)
            predict_seconds = process_time() - clock
            evidence, rule = log_evidence(classifier, X, predicted)
            groups = consecutive_groups(rig.recording[test], rig.start[test])
            verdicts = np.asarray(classifier.classes_)[
                evidence[groups].sum(axis=1).argmax(axis=1)
            ]
            yield {
                "train_rpm": float(train_rpm),
                "test_rpm": float(test_rpm),
                "fit_seconds": fit_seconds,
                "predict_seconds": predict_seconds,
                "evidence": rule,
                "window": score(y, predicted),
                "group": score(y[groups[:, 0]], verdicts),
                "recordings": by_recording(rig.recording[test], predicted == y),
            }
