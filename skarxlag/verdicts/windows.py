"""Results of all models for windows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .names import NO_SIGNAL, no_verdict

#: Entry of the column ``limits`` if healthy limits hold. Other entries are reasons.
HOLD = "hold"


class WindowResults:
    """Results for windows, which the models fill in one after another.

    Parameters
    ----------
    quality : ndarray of str of shape (n_windows,)
        "good", or why a window carries no signal.
    share : ndarray of shape (n_windows,)
        Share of the window that this affects.
    limits : ndarray of str of shape (n_windows,)
        `HOLD`, or why healthy limits do not hold.
    refusal : ndarray of str of shape (n_windows,)
        Why a window gets no verdict; empty if it gets one.

    Attributes
    ----------
    columns : dict of str to ndarray
        Columns of `window_verdicts`, in which ``alarm`` is 1, 0, or NaN if healthy
        limits do not hold.
    refusal : ndarray of str of shape (n_windows,)
        Reasons for which windows with a signal get no verdict.
    usable, within_limits : ndarray of bool of shape (n_windows,)
        Windows that can be diagnosed, and for which of them healthy limits hold.
    evidence : ndarray of shape (n_windows, n_values)
        Evidence of each window for the conditions, of which a recording has the mean.
        NaN for windows that cannot be diagnosed.
    """

    def __init__(
        self,
        quality: NDArray[Any],
        share: NDArray[Any],
        limits: NDArray[Any],
        refusal: NDArray[Any],
    ) -> None:
        n_windows = len(quality)
        self.columns: dict[str, NDArray[Any]] = {
            "verdict": np.full(n_windows, NO_SIGNAL, dtype=object),
            "alarm": np.full(n_windows, np.nan),
            "quality": quality,
            "quality share": share,
            "limits": limits,
        }
        self.refusal: NDArray[Any] = np.full(n_windows, "", dtype=object)
        self.usable: NDArray[Any] = quality == "good"
        self.evidence: NDArray[Any] = np.empty((n_windows, 0))
        self.refuse(refusal[self.usable])

    def refuse(self, reasons: NDArray[Any]) -> None:
        """Refuse usable windows for these reasons, of which some are empty."""
        self.refusal[self.usable] = reasons
        is_refused = self.refusal != ""
        for row in np.flatnonzero(is_refused):
            self.columns["verdict"][row] = no_verdict(self.refusal[row])
        self.usable = self.usable & ~is_refused
        self.within_limits: NDArray[Any] = self.usable & (
            self.columns["limits"] == HOLD
        )

    def everywhere(
        self, values: NDArray[Any], rows: NDArray[np.bool_] | None = None
    ) -> NDArray[Any]:
        """Return values of some windows, or of all usable ones, for all; others are NaN."""
        rows = self.usable if rows is None else rows
        all_values = np.full((len(rows), *values.shape[1:]), np.nan, values.dtype)
        all_values[rows] = values
        return all_values

    def table(self) -> pd.DataFrame:
        """Return a row for each window, as `window_verdicts` does."""
        table = pd.DataFrame(self.columns)
        return table if table["alarm"].isna().any() else table.astype({"alarm": bool})
