"""The simulated rig, and functions that fetch the recordings of real rigs."""

from .hit_sm import fetch_hit_sm
from .simulated import simulate_rig
from .uestc import fetch_uestc

#: Fetchers of the real rigs, by the names that the commands use for the rigs.
FETCHERS = {"uestc": fetch_uestc, "hit_sm": fetch_hit_sm}

__all__ = ["fetch_hit_sm", "fetch_uestc", "simulate_rig"]
