"""Parse shaft speeds with a tolerance or as a range."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

_NUMBER = r"\s*(\d+(?:\.\d+)?)\s*"
_SPEED = re.compile(rf"{_NUMBER}(?:\.\.{_NUMBER}|(?:\+-|\+/-|±){_NUMBER}(%?)\s*)?")


@dataclass(frozen=True)
class SpeedRange:
    """Range of shaft speeds.

    Parameters
    ----------
    low, high : float
        Its ends, which belong to it, in rev/min.

    Examples
    --------
    >>> from skarxlag.recordings.speeds import SpeedRange
    >>> SpeedRange.parse("1797+-30").contains([1750, 1772, 1797])
    array([False,  True,  True])
    >>> SpeedRange.parse("1700..1800")
    SpeedRange(low=1700.0, high=1800.0)
    """

    low: float
    high: float

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a range from a text.

        Parameters
        ----------
        text : str
            ``1797`` (this speed alone), ``1797+-30`` or ``1797+-2%`` (with a tolerance; ``±`` and
            ``+/-`` do as well) or ``1700..1800``.

        Returns
        -------
        SpeedRange

        Raises
        ------
        ValueError
            If the text is nothing of this, or the range is empty or holds no speed above 0.
        """
        low = high = np.nan
        if match := _SPEED.fullmatch(text):
            speed, width = float(match[1]), float(match[3] or 0)
            width *= speed / 100 if match[4] else 1
            low, high = speed - width, float(match[2] or speed + width)
        if not (np.isfinite(high) and high > 0 and low <= high):
            raise ValueError(f"{text!r}, expected a speed such as 1797, 1797+-30 or 1700..1800")
        return cls(max(low, 0.0), high)

    def contains(self, rpm: ArrayLike) -> NDArray[Any]:
        """Return which speeds lie in the range.

        Parameters
        ----------
        rpm : array-like of float
            Speeds, rev/min.

        Returns
        -------
        ndarray of bool, shape as `rpm`
        """
        rpm = np.asarray(rpm, dtype=np.float64)
        return (rpm >= self.low) & (rpm <= self.high)

    def __str__(self) -> str:
        ends = [f"{self.low:g}"] if self.low == self.high else [f"{self.low:g}", f"{self.high:g}"]
        return "..".join(ends)
