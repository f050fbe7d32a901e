"""Root-mean-square of the output error."""

from ..kernels.residual_levels import power_levels

TRAJECTORY = "error"


def levels(innovations, loop, observer):
    """Root-mean-square of each error."""
    return power_levels(innovations, loop)
