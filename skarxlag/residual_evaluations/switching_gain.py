"""Adapted gain of the sliding-mode residual (equations 21 and 22)."""

from typing import Any

from numpy.typing import NDArray

from ..kernels.residual_levels import switching_gain_levels

TRAJECTORY = "residual"


def levels(innovations: NDArray[Any], loop: Any, observer: Any) -> NDArray[Any]:
    """Gain at which the size of the sliding surface lies above and below equally often."""
    slope, step = float(observer.sliding_slope), float(observer.adaptation_step)
    return switching_gain_levels(innovations, loop, slope, step)
