"""Rigs of the benchmark: one function each, from a window length to a Bunch of windows."""

import os
from functools import partial
from importlib import import_module

import numpy as np
from sklearn.utils import Bunch

from benchmarks.recipe.rigs import real_rigs
from benchmarks.recordings import FETCHERS, fetch_cwru, fetch_hit_sm
from skarxlag import make_windows
from skarxlag.datasets import simulate_rig

#: Names of rigs in tables, by the names of their fetchers.
NAMES = {"uestc": "UESTC", "hit_sm": "SpectraQuest"}
#: Rigs that are read from the folder of recordings, because there is no fetcher.
STORED = ("motor sound",)


def simulated(window_length):
    return simulate_rig(window_length=window_length, random_state=0)


def fetched(window_length, *, fetch, data_home=None):
    return fetch(window_length=window_length, data_home=data_home)


def stored(window_length, *, name, data_home=None):
    return windows_of(stored_rig(name, data_home), window_length)


def stored_rig(name, data_home=None):
    """Recordings of a rig in the folder `data_home`, or in ``$SKARXLAG_DATA``.

    Raises
    ------
    FileNotFoundError
        If the rig is not there.
    """
    home = data_home or os.environ.get("SKARXLAG_DATA", ".")
    for rig in real_rigs([name], home):
        return rig
    raise FileNotFoundError(
        f"{name}: {home} has no folder of this rig; name other rigs (--rig)."
    )


def windows_of(rig, window_length):
    """Cut the recordings of a rig into windows.

    Parameters
    ----------
    rig : Rig
        As `real_rigs` yields it.
    window_length : int
        Samples in a window.

    Returns
    -------
    Bunch
        With `data`, `target`, `target_names`, `rpm`, `recording`, `start` and
        `sampling_rate`.
    """
    windows = [make_windows(each.samples, window_length) for each in rig.recordings]
    counts = [len(each) for each in windows]
    conditions = [each.condition for each in rig.recordings]
    names = [f"{each.condition}, {each.rpm:g} rpm" for each in rig.recordings]
    return Bunch(
        data=np.concatenate(windows),
        target=np.repeat(conditions, counts),
        target_names=sorted(set(conditions)),
        rpm=np.repeat([each.rpm for each in rig.recordings], counts),
        recording=np.repeat(names, counts),
        start=np.concatenate([window_length * np.arange(n) for n in counts]),
        sampling_rate=rig.sampling_rate,
    )


RIGS = {
    **{
        NAMES.get(name, name): partial(fetched, fetch=fetch)
        for name, fetch in FETCHERS.items()
    },
    "self-built": partial(fetched, fetch=partial(fetch_hit_sm, rig="self-built")),
    "CWRU drive end": partial(fetched, fetch=partial(fetch_cwru, end="drive")),
    "CWRU fan end": partial(fetched, fetch=partial(fetch_cwru, end="fan")),
    **{name: partial(stored, name=name) for name in STORED},
    "simulated rig": simulated,
}


def find_rig(name, data_home=None):
    """Function of a rig, by its name in ``RIGS`` or as ``module:function``.

    Raises
    ------
    ValueError
        If `name` is neither.
    FileNotFoundError
        If it is a rig without a fetcher that is not there.
    """
    if name in STORED:
        # A rig that is not there is named before the first score, not after an hour.
        return partial(windows_of, stored_rig(name, data_home))
    if name in RIGS and RIGS[name] is not simulated:
        return partial(RIGS[name], data_home=data_home)
    return find(name, RIGS, "--rig")


def find(name, entries, option):
    """Entry of `known`, or the function that ``module:function`` names.

    Raises
    ------
    ValueError
        If `name` is neither.
    """
    if name in entries:
        return entries[name]
    module, colon, function = name.partition(":")
    if not colon:
        raise ValueError(
            f"{option} {name!r}: expected module:function or one of {list(entries)}."
        )
    entry = getattr(import_module(module), function, None)
    if not callable(entry):
        raise ValueError(
            f"{option} {name!r}: module {module!r} has no function {function!r}."
        )
    return entry


def split_by_crack(name, rig):
    """Make a rig of each crack size, each with all the healthy windows.

    Parameters
    ----------
    name : str
        Name of the rig.
    rig : Bunch
        Windows of a rig. Without ``crack_mm`` (size of the crack in mm, 0 when healthy)
        it is returned unchanged.

    Returns
    -------
    rigs : dict of str to Bunch
    """
    if "crack_mm" not in rig:
        return {name: rig}
    parts = {}
    for size in sorted(set(rig.crack_mm.tolist()) - {0.0}):
        keep = (rig.crack_mm == 0) | (rig.crack_mm == size)
        rows = ("data", "target", "rpm", "recording", "start")
        present = set(rig.target[keep])
        parts[f"{name}, {size:g} mm crack"] = Bunch(
            **{key: rig[key][keep] for key in rows},
            target_names=[
                condition for condition in rig.target_names if condition in present
            ],
        )
    return parts
