"""Root-mean-square of the output error."""

from typing import Any

from numpy.typing import NDArray

from ..kernels.residual_levels import power_levels

TRAJECTORY = "error"


def levels(innovations: NDArray[Any], loop: Any, observer: Any) -> NDArray[Any]:
    """Root-mean-square of each error."""
    return power_levels(innovations, loop)
