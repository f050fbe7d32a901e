"""Rigs of the benchmark on detection: rows of 4800 samples or of about a second."""

from functools import partial

from benchmarks.cross_speed.rigs import find
from benchmarks.recordings import FETCHERS, fetch_hit_sm
from skarxlag.datasets import simulate_rig

WINDOW = 4800
#: Windows of 4800 samples that make a row of about a second.
SECOND = {"UESTC": 4, "SpectraQuest": 10, "self-built": 10, "simulated rig, 3 mm": 52}


def simulated(window_length, data_home=None, random_state=0):
    """Single faults of the simulated rig, recordings of 4 s."""
    return simulate_rig(
        crack_mm=3,
        conditions=["Normal", "IR", "OR", "Ball"],
        n_samples=4 * 52 * WINDOW,
        window_length=window_length,
        random_state=random_state,
    )


def fetched(window_length, *, name, data_home=None):
    return FETCHERS[name](window_length=window_length, data_home=data_home)


def self_built(window_length, data_home=None):
    return fetch_hit_sm(
        rig="self-built", window_length=window_length, data_home=data_home
    )


RIGS = {
    "UESTC": partial(fetched, name="uestc"),
    "SpectraQuest": partial(fetched, name="hit_sm"),
    "self-built": self_built,
    "simulated rig, 3 mm": simulated,
}


def find_rig(name):
    """Function of a rig: from a row length and a data home to a Bunch of rows."""
    return find(name, RIGS, "--rig")


def row_lengths(name):
    """Names and samples of the rows that a rig is cut into."""
    return {"4800": WINDOW, "1 s": SECOND.get(name, 4) * WINDOW}
