"""Speeds at which healthy limits hold, and what they promise for a recording."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..core.capabilities import Capabilities
from ..kernels import evidence
from ..kernels.speed_references import SAME_LOG_SPEED, UNIT_DISTANCE
from .windows import HOLD

#: Entry of the column ``limits`` for a recording that resembles no recorded specimen
#: closely.
HOLD_FOR_RECORDED = "hold for the recorded bearing, load and mounting only"
#: Entry of a recording if fewer than `LEAST_HEALTHY` healthy rows were learned.
FEW_HEALTHY = "too few healthy rows"
LEAST_HEALTHY = 9
#: Column with the probability that a window is of a recorded specimen.
RECORDED = "probability of a recorded specimen"
#: Without p-values, a recording exceeds the limits if more than this share of its
#: windows does.
MOST_WINDOWS = 0.5
_NO_COLUMN = pd.Series(dtype=float)


class HealthyLimits:
    """Healthy limits of a detector, or of a classifier with a detection threshold.

    Parameters
    ----------
    described : Capabilities
        Description of the model that has the limits.
    train_rpm : sequence of float
        Training speeds. Empty if they are not known.
    same_speed : bool
        Whether windows without a stated speed are taken to be of a training speed.

    Attributes
    ----------
    exist : bool
        Whether there are healthy limits.
    rate : float or None
        Share of healthy windows that may exceed them.
    """

    def __init__(
        self, described: Capabilities, train_rpm: Sequence[float], same_speed: bool
    ) -> None:
        self.exist: bool = described.alarm
        self.rate: float | None = described.stated_rate
        self._described = described
        self._is_detector = described.conditions is None
        self._train_rpm = train_rpm
        self._same_speed = same_speed
        n_healthy = described.n_healthy
        self._are_weak = n_healthy is not None and n_healthy < LEAST_HEALTHY

    def at(self, rpm: NDArray[Any] | None, n_windows: int) -> NDArray[Any]:
        """Return for each window `HOLD`, or why the limits do not hold at its speed."""
        speeds = ", ".join(f"{speed:g}" for speed in self._train_rpm)
        reason = f"healthy limits hold at {speeds} rpm only"
        holds = np.zeros(n_windows, dtype=bool)
        if not self.exist:
            reason = "no healthy limits were learned"
        elif rpm is None:
            holds[:] = self._hold_without_speed()
            reason = f"the speed is not stated{f', and {reason}' if speeds else ''}"
        elif self._is_detector and (self._described.takes_rpm or not speeds):
            # These limits widen with the distance in speed.
            holds[:] = True
        elif not speeds:
            reason = "the training speeds are not known"
        else:
            holds = self._are_near(rpm)
        return np.where(holds, HOLD, reason).astype(object)

    def _hold_without_speed(self):
        if self._is_detector:
            return not self._described.needs_rpm
        return self._same_speed

    def _are_near(self, rpm):
        """Return which speeds are near enough to a training speed."""
        # A detector without speeds has limits for speeds that differ by the factor 1.3.
        tolerance = UNIT_DISTANCE if self._is_detector else SAME_LOG_SPEED
        with np.errstate(invalid="ignore", divide="ignore"):
            ratios = np.log(np.divide.outer(rpm, self._train_rpm))
        return np.abs(ratios).min(axis=1) <= tolerance + 1e-9

    def of_recording(self, usable: pd.DataFrame) -> dict[str, Any]:
        """Return alarm, p-value and limits of a recording.

        Parameters
        ----------
        usable : DataFrame
            Windows of the recording that were diagnosed, as `window_verdicts` returns
            them.

        Returns
        -------
        dict
            These columns of `recording_verdicts`.
        """
        within = usable[usable["limits"] == HOLD]
        if within.empty:
            reason = "" if usable.empty else usable["limits"].mode()[0]
            return {"alarm": "-", "p-value": np.nan, "limits": reason}
        p_value = evidence.combined_p_value(within.get("p-value", _NO_COLUMN))
        if np.isnan(p_value):
            exceeds = within["alarm"].astype(float).mean() > MOST_WINDOWS
        else:
            exceeds = p_value < self.rate
        limits = HOLD
        if self._are_weak:
            limits = FEW_HEALTHY
        elif within.get(RECORDED, _NO_COLUMN).median() < MOST_WINDOWS:
            limits = HOLD_FOR_RECORDED
        alarm = "yes" if exceeds else "no"
        return {"alarm": alarm, "p-value": p_value, "limits": limits}
