"""Base of the displays that draw the thresholds of a ladder."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import KW_ONLY, dataclass
from operator import itemgetter
from typing import Any

import numpy as np

from ..decisions.ladder import ThresholdLadder
from ._fitted import ordered_conditions
from ._style import LINE, AxesDisplay, condition_styles, ink


def isolation_thresholds(decide: ThresholdLadder) -> dict[str, float]:
    r"""Return the isolation threshold :math:`\Delta` of each condition of a fitted ladder.

    For a single residual the thresholds ascend: each is the upper end of the range of
    levels that is assigned to its condition, and the highest is infinite.
    """
    if decide._is_bank():
        names = decide.classes_
        deltas = decide.isolation_thresholds_
    else:
        names = decide.rungs_
        deltas = np.append(decide.isolation_thresholds_, np.inf)
    return dict(zip(names.astype(str).tolist(), deltas.tolist(), strict=True))


@dataclass(repr=False, eq=False)
class ThresholdDisplay(AxesDisplay):
    """Base of the displays with a detection threshold and isolation thresholds."""

    _: KW_ONLY
    detection_threshold: float | None = None
    isolation_thresholds: dict[Any, float] | None = None
    conditions: Sequence[Any] | None = None

    def _name_conditions(self, drawn: Sequence[Any]) -> None:
        """Convert names to text, and determine the order of the conditions."""
        deltas = self.isolation_thresholds or {}
        self.isolation_thresholds = {
            str(name): float(delta) for name, delta in deltas.items()
        }
        self.conditions = ordered_conditions([*deltas, *drawn], self.conditions)

    def _thresholds(self) -> Iterator[tuple[str | None, float, dict[str, Any]]]:
        r"""Yield condition, value and style of :math:`\Gamma`, and of each :math:`\Delta` upwards.

        A threshold that is infinite, or that equals :math:`\Gamma`, is left out.
        """
        gamma = self.detection_threshold
        styles = condition_styles(self.conditions)
        if gamma is not None:
            yield None, gamma, {"color": ink(), "linestyle": "--", "label": r"$\Gamma$"}
        for name, delta in sorted(self.isolation_thresholds.items(), key=itemgetter(1)):
            if np.isfinite(delta) and delta != gamma:
                style = {key: styles[name][key] for key in LINE}
                yield name, delta, style | {"label": rf"$\Delta$ {name}"}
