"""Rigs whose recordings are long enough for stretches, with their bearings."""

import numpy as np

from benchmarks.cross_speed.rigs import find_rig, split_by_crack
from skarxlag.bearings import SKF_6205, BearingGeometry
from skarxlag.datasets import simulate_rig

#: Inserts of the series UC 204 have the inside of a bearing 6204.
_UC204 = BearingGeometry(n_elements=8, element_diameter=7.938, pitch_diameter=33.5)
#: Bearing of each rig, and the place of the fault by the first letters of a condition.
BEARINGS = {"hit_sm": SKF_6205, "uestc": _UC204, "simulated": SKF_6205}
_PLACES = {"IR": "inner", "I": "inner", "OR": "outer", "O": "outer", "B": "ball", "N": "healthy"}
#: Seconds of a recording of the simulated rig.
_SECONDS = 4


def rig_of_stretches(name, seconds, data_home=None, random_state=0):
    """Stretches of a rig.

    Parameters
    ----------
    name : str
        Of `BEARINGS`.
    seconds : float
        Length of a stretch.
    data_home : str or None, default=None
        Folder of the downloaded rigs.
    random_state : int, default=0
        Seed of the simulated rig.

    Returns
    -------
    Bunch
        As the rigs of ``benchmarks.cross_speed.rigs``.
    """
    if name != "simulated":
        make_rig = find_rig(name, data_home)
        rate = make_rig(1200).sampling_rate
        return make_rig(int(seconds * rate))
    rate = 250_000
    length = int(seconds * rate)
    rig = simulate_rig(
        crack_mm=3,
        n_samples=int(_SECONDS / seconds) * length,
        window_length=length,
        random_state=random_state,
    )
    (part,) = split_by_crack(name, rig).values()
    part.sampling_rate = float(rate)
    return part


def place_of(condition):
    """Place of the fault; compound faults have none that one word names.

    Examples
    --------
    >>> [place_of(name) for name in ("OR5", "I", "Normal", "IR-Ball")]
    ['outer', 'inner', 'healthy', None]
    """
    if "-" in condition:
        return None
    return next(place for start, place in _PLACES.items() if condition.startswith(start))


def places(target):
    """Place of each condition."""
    return np.array([place_of(name) for name in target])
