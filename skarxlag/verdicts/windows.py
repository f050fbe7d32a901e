"""State of windows before a verdict, and the results of all models for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .names import NO_SIGNAL, no_verdict

#: Entry of the column ``limits`` if healthy limits hold. Other entries are reasons.
HOLD = "hold"


@dataclass(eq=False)
class WindowStatus:
    """Speeds, quality and limits of windows, and why some get no verdict.

    Parameters
    ----------
    rpm : ndarray of shape (n_windows,) or (n_windows, n_samples), or None
        Speeds; None if they are not stated.
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
    usable : ndarray of bool of shape (n_windows,)
        Which windows can be diagnosed.
    within_limits : ndarray of bool of shape (n_windows,)
        For which of these windows healthy limits hold.
    """

    rpm: NDArray[Any] | None
    quality: NDArray[Any]
    share: NDArray[Any]
    limits: NDArray[Any]
    refusal: NDArray[Any]

    def __post_init__(self) -> None:
        self.usable: NDArray[Any] = (self.quality == "good") & (self.refusal == "")
        self.within_limits: NDArray[Any] = self.usable & (self.limits == HOLD)

    def refuse(self, reasons: NDArray[Any]) -> None:
        """Refuse usable windows for these reasons, of which some are empty."""
        self.refusal[self.usable] = reasons
        self.__post_init__()

    def verdicts(self) -> NDArray[Any]:
        """Return the verdict on each window that cannot be diagnosed; others are overwritten."""
        verdicts = np.full(len(self.quality), NO_SIGNAL, dtype=object)
        for row in np.flatnonzero((self.quality == "good") & (self.refusal != "")):
            verdicts[row] = no_verdict(self.refusal[row])
        return verdicts


@dataclass(eq=False)
class WindowResults:
    """Results of all models for windows, which the models fill in one after another.

    Parameters
    ----------
    columns : dict of str to ndarray
        Columns of `window_verdicts`, in which ``alarm`` is 1, 0, or NaN if healthy
        limits do not hold.
    refusal : ndarray of str of shape (n_windows,)
        As in `WindowStatus`.
    evidence : ndarray of shape (n_windows, n_values)
        Evidence of each window for the conditions, of which a recording has the mean.
        NaN for windows that cannot be diagnosed.
    """

    columns: dict[str, NDArray[Any]]
    refusal: NDArray[Any]
    evidence: NDArray[Any]

    @classmethod
    def of_status(cls, status: WindowStatus) -> Self:
        """Return results without those of any model."""
        columns = {
            "verdict": status.verdicts(),
            "alarm": np.full(len(status.quality), np.nan),
            "quality": status.quality,
            "quality share": status.share,
            "limits": status.limits,
        }
        return cls(columns, status.refusal, np.empty((len(status.quality), 0)))

    def table(self) -> pd.DataFrame:
        """Return a row for each window, as `window_verdicts` does."""
        table = pd.DataFrame(self.columns)
        return table if table["alarm"].isna().any() else table.astype({"alarm": bool})
