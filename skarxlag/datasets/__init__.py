"""The simulated rig, and public rigs that the package bearing-datasets has built."""

from .public import load_public_rig
from .simulated import simulate_rig

__all__ = ["load_public_rig", "simulate_rig"]
