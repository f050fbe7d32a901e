"""Rigs with recordings that are long enough for stretches, with their bearings."""

import numpy as np

from benchmarks.cross_speed.rigs import find_rig, split_by_crack
from skarxlag.bearings import SKF_6205, BearingGeometry
from skarxlag.datasets import simulate_rig

#: Inserts of the series UC 204 have the inside of a bearing 6204.
_UC204 = BearingGeometry(n_elements=8, element_diameter=7.938, pitch_diameter=33.5)
#: Bearing of each rig, and the location of the fault by the first letters of a condition.
BEARINGS = {"SpectraQuest": SKF_6205, "UESTC": _UC204, "simulated": SKF_6205}
_LOCATIONS = {
    "IR": "inner",
    "I": "inner",
    "OR": "outer",
    "O": "outer",
    "B": "ball",
    "N": "healthy",
}
#: Seconds of a recording of the simulated rig, its sampling rate in Hz, and its cracks
#: in mm.
_SECONDS = 4
_RATE = 250_000
_CRACKS = (3, 6)


def rigs_of_stretches(name, seconds, data_home=None, seed=0):
    """Return the stretches of a rig; of the simulated rig, one rig for each size of crack.

    Parameters
    ----------
    name : str
        Of `BEARINGS`.
    seconds : float
        Length of a stretch.
    data_home : str or None, default=None
        Folder of the downloaded rigs.
    seed : int, default=0
        Of the simulated rig.

    Yields
    ------
    str, Bunch
        Name and rig, as those of ``benchmarks.cross_speed.rigs``.
    """
    if name != "simulated":
        make_rig = find_rig(name, data_home)
        rate = make_rig(1200).sampling_rate
        yield name, make_rig(int(seconds * rate))
        return
    for crack_mm in _CRACKS:
        rig = simulated_stretches(seconds, seed, crack_mm=crack_mm)
        ((label, part),) = split_by_crack(name, rig).items()
        del rig
        part.sampling_rate = float(_RATE)
        yield label, part


def simulated_stretches(seconds, seed, **options):
    """Recordings of 4 s of the simulated rig, cut into stretches.

    Parameters
    ----------
    seconds : float
        Length of a stretch.
    seed : int
        Of the rig.
    **options
        Of `simulate_rig`, such as ``crack_mm`` and ``rpm``.

    Returns
    -------
    Bunch
        What `simulate_rig` returns.
    """
    length = int(seconds * _RATE)
    return simulate_rig(
        n_samples=int(_SECONDS / seconds) * length,
        window_length=length,
        random_state=seed,
        **options,
    )


def location_of(condition):
    """Return the fault location; compound faults have no single location.

    Examples
    --------
    >>> [location_of(name) for name in ("OR5", "I", "Normal", "IR-Ball")]
    ['outer', 'inner', 'healthy', None]
    """
    if "-" in condition:
        return None
    return next(
        location
        for start, location in _LOCATIONS.items()
        if condition.startswith(start)
    )


def locations(target):
    """Return the location of each condition."""
    return np.array([location_of(name) for name in target])
