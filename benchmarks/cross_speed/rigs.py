"""Rigs of the benchmark: one function each, from a window length to a Bunch of windows."""

from functools import partial
from importlib import import_module

from sklearn.utils import Bunch

from skarxlag.datasets import FETCHERS, simulate_rig


def simulated(window_length):
    return simulate_rig(window_length=window_length, random_state=0)


def fetched(window_length, *, fetch, data_home=None):
    return fetch(window_length=window_length, data_home=data_home)


RIGS = {
    **{name: partial(fetched, fetch=fetch) for name, fetch in FETCHERS.items()},
    "simulated rig": simulated,
}


def find_rig(name, data_home=None):
    """Function of a rig, by its name in ``RIGS`` or as ``module:function``.

    Raises
    ------
    ValueError
        If `name` is neither.
    """
    if name in FETCHERS:
        return partial(RIGS[name], data_home=data_home)
    return find(name, RIGS, "--rig")


def find(name, known, option):
    """Entry of `known`, or the function that ``module:function`` names.

    Raises
    ------
    ValueError
        If `name` is neither.
    """
    if name in known:
        return known[name]
    module, colon, function = name.partition(":")
    if not colon:
        raise ValueError(f"{option} {name!r}: expected module:function or one of {list(known)}.")
    found = getattr(import_module(module), function, None)
    if not callable(found):
        raise ValueError(f"{option} {name!r}: module {module!r} has no function {function!r}.")
    return found


def split_by_crack(name, rig):
    """Make a rig of each crack size, each with all the healthy windows.

    Parameters
    ----------
    name : str
        Name of the rig.
    rig : Bunch
        Windows of a rig. Without ``crack_mm`` (size of the crack in mm, 0 when healthy) it is
        returned unchanged.

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
            target_names=[condition for condition in rig.target_names if condition in present],
        )
    return parts
