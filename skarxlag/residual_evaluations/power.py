"""Root-mean-square of the output error."""

from typing import Any

from ..kernels.residual_levels import power_levels

TRAJECTORY = "error"


def levels(innovations: Any, loop: Any, observer: Any) -> Any:
    """Root-mean-square of each error."""
    return power_levels(innovations, loop)
