"""Diagnosis of the windows of several monitors at the same time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..measures.levels import signal_levels
from .verdict import MonitorVerdict

#: Largest number of windows that are diagnosed together.
_BATCH = 256


class CutBlock(NamedTuple):
    """Windows of a monitor that are complete and not yet diagnosed.

    Parameters
    ----------
    monitor : ConditionMonitor
        The monitor.
    start : int
        Number of samples before the first window.
    rows : ndarray of shape (n_windows[, n_channels], window_length)
        The windows.
    middle : ndarray of shape (n_windows,)
        Speed in the middle of each; NaN if it is not stated.
    rpm : ndarray of shape (n_windows,) or (n_windows, window_length), or None
        Speeds of the windows.
    """

    monitor: Any
    start: int
    rows: NDArray[Any]
    middle: NDArray[Any]
    rpm: NDArray[Any] | None


def diagnose_together(cuts: Sequence[CutBlock]) -> list[list[MonitorVerdict]]:
    """Diagnose windows of several monitors; those of the same models in one batch.

    Parameters
    ----------
    cuts : sequence of CutBlock
        Results of `ConditionMonitor.cut`, each of another monitor.

    Returns
    -------
    list of list of MonitorVerdict
        As `ConditionMonitor.update` returns them, for each of the monitors.

    Examples
    --------
    >>> from skarxlag import ConditionMonitor, make_detector
    >>> X = np.random.default_rng(0).normal(size=(100, 1200))
    >>> import warnings
    >>> with warnings.catch_warnings(action="ignore"):  # the speed is not known
    ...     detector = make_detector().fit(X)
    >>> monitors = [ConditionMonitor(None, 20e3, detector=detector) for _ in range(2)]
    >>> signals = np.random.default_rng(1).normal(size=(2, 2400))
    >>> cuts = [one.cut(signal) for one, signal in zip(monitors, signals)]
    >>> [[verdict.verdict for verdict in of_one] for of_one in diagnose_together(cuts)]
    [['healthy', 'healthy'], ['healthy', 'healthy']]
    """
    alike = defaultdict(list)
    for number, cut in enumerate(cuts):
        alike[cut.monitor._models, np.ndim(cut.rpm)].append(number)
    verdicts: list[list[MonitorVerdict]] = [[] for _ in cuts]
    for numbers in alike.values():
        owners = [(i, row) for i in numbers for row in range(len(cuts[i].rows))]
        for first in range(0, len(owners), _BATCH):
            batch = owners[first : first + _BATCH]
            for number, verdict in _of_batch(cuts, batch):
                verdicts[number].append(verdict)
    return verdicts


def _of_batch(cuts, owners):
    """Yield the number of the monitor and the verdict of each window of a batch."""
    first = cuts[owners[0][0]]
    judge = first.monitor._judge
    rows = np.stack([cuts[i].rows[row] for i, row in owners])
    rpm = None
    if first.rpm is not None:
        rpm = np.stack([cuts[i].rpm[row] for i, row in owners])
    counted = []
    for (i, row), result in zip(owners, _results(judge, rows, rpm), strict=True):
        counted.append(cuts[i].monitor._count(cuts[i], row, result))
    means = [mean for _, mean, _ in counted if mean is not None]
    named = iter(())
    if means:
        named = iter(judge.named(*map(np.array, zip(*means, strict=True))))
    for (i, _), (fields, mean, is_active) in zip(owners, counted, strict=True):
        if mean is not None:
            cuts[i].monitor._named(fields, is_active, next(named))
        yield i, MonitorVerdict(**fields)


def _results(judge, rows, rpm):
    """Yield the results of the models for each window."""
    results = judge.window_results(rows, rpm)
    levels = signal_levels(rows if rows.ndim == 2 else rows[:, 0])
    columns = {"p-value": np.full(len(rows), np.nan)}
    columns |= results.columns | levels._asdict() | {"refusal": results.refusal}
    values = [column.tolist() for column in columns.values()]
    for evidence, *of_window in zip(results.evidence, *values, strict=True):
        yield dict(zip(columns, of_window, strict=True)) | {"evidence": evidence}
