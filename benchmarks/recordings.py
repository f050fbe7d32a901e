"""Recordings of public rigs in a folder, in the layout of their original repositories.

``--data-home`` or the environment variable ``SKARXLAG_DATA`` name the folder. Nothing is
downloaded. To load the rigs from the data sets that bearing-datasets builds, use
`skarxlag.datasets.load_public_rig`.
"""

import os
from pathlib import Path

import numpy as np
from sklearn.utils import Bunch

from skarxlag import BearingGeometry, read_recording
from skarxlag.bearings import SKF_6205

MM_PER_INCH = 25.4
#: Bearings of the rigs, as far as their authors state them.
FAN_END = BearingGeometry(8, 6.746, 28.499)
NICE = BearingGeometry(8, 0.235 * MM_PER_INCH, 1.245 * MM_PER_INCH)
_HIT_SM = {
    "spectraquest": ("SpectraQuest MFS dataset", SKF_6205),
    "self-built": ("Self-built dataset", None),
}


def _rig(paths, facts, sampling_rate, window_length, *, channel=None, bearing=None):
    """Cut recordings into windows.

    Parameters
    ----------
    paths : list of Path
        Files, those of the healthy condition first.
    facts : callable
        Returns condition, speed and load of a path.
    sampling_rate : float
        In Hz.
    window_length : int
        Samples in a window.
    channel : str or None, default=None
        Array of a file with several.
    bearing : BearingGeometry or None, default=None
        The bearing.
    """
    if not paths:
        raise FileNotFoundError("The folder of the recordings holds none of this rig.")
    parts = []
    rows = []
    for path in paths:
        signal = np.asarray(read_recording(path, channel=channel)[0], dtype=np.float64)
        n_windows = len(signal) // window_length
        parts.append(signal[: n_windows * window_length].reshape(-1, window_length))
        rows += [(*facts(path), path.stem, i * window_length) for i in range(n_windows)]
    condition, rpm, load, recording, start = map(np.array, zip(*rows, strict=True))
    return Bunch(
        data=np.concatenate(parts),
        target=condition,
        target_names=list(dict.fromkeys(condition.tolist())),
        specimen=condition,
        rpm=rpm,
        load=load,
        recording=recording,
        start=start,
        sampling_rate=sampling_rate,
        bearing=bearing,
    )


def data_folder(data_home=None):
    """Return the folder of the recordings."""
    home = data_home or os.environ.get("SKARXLAG_DATA")
    if home is None:
        raise FileNotFoundError(
            "The folder of the recordings is not known: pass --data-home, or set SKARXLAG_DATA."
        )
    return Path(home)


def _of_name(path):
    condition, rpm = path.stem.split("_")[:2]
    return condition, float(rpm), np.nan


def fetch_uestc(*, data_home=None, window_length=1200):
    """Return windows of the UESTC rig: N, B, I and O at 800 to 1400 rpm."""
    found = sorted((data_folder(data_home) / "uestc").rglob("*.mat"))
    paths = sorted(found, key=lambda path: ("NBIO".index(path.stem[0]), path.stem))
    return _rig(paths, _of_name, 20_000.0, window_length, channel="Data")


def fetch_hit_sm(*, rig="spectraquest", data_home=None, window_length=1200):
    """Return windows of a rig of HIT-SM: seven conditions at 600, 900 and 1200 rpm."""
    folder, bearing = _HIT_SM[rig]
    found = (data_folder(data_home) / "hit_sm" / folder).rglob("*.mat")
    paths = sorted(found, key=lambda path: (path.stem[0] != "N", path.stem))
    return _rig(paths, _of_name, 51_200.0, window_length, bearing=bearing)


def fetch_cwru(*, end="drive", data_home=None, window_length=1200):
    """Return windows of one end of the CWRU rig: nine faults at loads of 0 to 3 hp."""
    speeds = [1797.0, 1772.0, 1750.0, 1730.0]

    def facts(path):
        condition, rpm = path.stem.split("_")
        return condition, float(rpm), float(speeds.index(float(rpm)))

    folder = data_folder(data_home) / f"cwru_{end}_end"
    bearing = {"drive": SKF_6205, "fan": FAN_END}[end]
    options = {"channel": "acceleration", "bearing": bearing}
    return _rig(sorted(folder.glob("*.npz")), facts, 12_000.0, window_length, **options)


def fetch_mfpt(*, data_home=None, window_length=1200):
    """Return windows of the MFPT data: two faults at seven loads and 1500 rpm."""

    def facts(path):
        condition, load = path.stem.split("_load")
        return condition, 1500.0, float(load)

    paths = sorted((data_folder(data_home) / "mfpt").glob("*.npz"))
    options = {"channel": "acceleration", "bearing": NICE}
    return _rig(paths, facts, 48_828.0, window_length, **options)


#: Rigs with healthy recordings and several speeds.
FETCHERS = {"uestc": fetch_uestc, "hit_sm": fetch_hit_sm}
