"""The simulated rig, and functions that fetch the recordings of real rigs."""

from .cwru import fetch_cwru
from .hit_sm import fetch_hit_sm
from .mfpt import fetch_mfpt
from .simulated import simulate_rig
from .uestc import fetch_uestc

#: Fetchers of the rigs with healthy recordings and several speeds, by their names in
#: the commands.
FETCHERS = {"uestc": fetch_uestc, "hit_sm": fetch_hit_sm}

__all__ = ["fetch_cwru", "fetch_hit_sm", "fetch_mfpt", "fetch_uestc", "simulate_rig"]
