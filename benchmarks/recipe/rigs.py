"""Recordings of all rigs in one folder, for the choice of constants.

The folder is ``$SKARXLAG_DATA``; its README describes the rigs. Rigs that are not there
are left out.
"""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.io

from skarxlag.datasets import simulate_rig

#: Samples of a recording of the simulated rig.
_SIMULATED_SAMPLES = 60_000


class Recording(NamedTuple):
    """One recording of a rig: samples, of shape (n_samples,) or (n_channels, n_samples).

    The specimen and the load are None if all recordings of a condition share the
    specimen, and if the load is not stated.
    """

    samples: np.ndarray
    condition: str
    rpm: float
    specimen: str | None = None
    load: str | None = None


class Rig(NamedTuple):
    """Recordings of one machine, with their sampling rate in Hz."""

    name: str
    sampling_rate: float
    recordings: list


def _hit_sm(folder):
    for path in sorted(folder.glob("*.mat")):
        condition, rpm = path.stem.split("_")
        content = scipy.io.loadmat(path)
        (samples,) = (
            each for name, each in content.items() if not name.startswith("__")
        )
        yield Recording(np.asarray(samples, dtype=float).ravel(), condition, float(rpm))


def _uestc(folder):
    for path in sorted(folder.rglob("*.mat")):
        samples = scipy.io.loadmat(path)["Data"]
        condition, rpm = _uestc_name(path)
        yield Recording(np.asarray(samples, dtype=float).ravel(), condition, rpm)


def _uestc_name(path):
    digits = "".join(c if c.isdigit() else " " for c in path.stem).split()
    rpm = next(float(d) for d in digits if float(d) in (800, 1000, 1200, 1400))
    return "".join(c for c in path.stem if c.isalpha())[:1].upper(), rpm


def _npz(folder):
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as content:
            samples = content["acceleration"].astype(float).ravel()
        condition, rpm = path.stem.rsplit("_", 1)
        yield Recording(samples, condition, float(rpm))


def _sound(folder):
    import soundfile

    for path in sorted(folder.glob("*.flac")):
        condition, rpm = path.stem.rsplit("_", 1)
        yield Recording(soundfile.read(path)[0], condition, float(rpm))


def _paderborn(folder):
    for path in sorted(folder.glob("*.npz")):
        condition, specimen = path.stem.split("_")
        with np.load(path) as content:
            settings = zip(
                content["signal"].astype(float),
                content["rpm"].tolist(),
                content["torque_nm"].tolist(),
                content["radial_force_n"].tolist(),
                strict=True,
            )
            for samples, rpm, torque, force in settings:
                load = f"{torque:g} Nm, {force:g} N"
                yield Recording(samples, condition, float(rpm), specimen, load)


#: Folder, sampling rate and reader of each rig.
_REAL = {
    "UESTC": ("uestc", 20_000, _uestc),
    "SpectraQuest": ("hit_sm/SpectraQuest MFS dataset", 51_200, _hit_sm),
    "self-built": ("hit_sm/Self-built dataset", 51_200, _hit_sm),
    "CWRU drive end": ("cwru_drive_end", 12_000, _npz),
    "CWRU fan end": ("cwru_fan_end", 12_000, _npz),
    "motor sound": ("motor_sound", 44_100, _sound),
    "Paderborn": ("paderborn", 64_000, _paderborn),
}
#: Rigs with one specimen of each condition, recorded at several speeds. They serve the
#: protocol in which the bearing is the same and the speed is another one.
SAME_BEARING = [name for name in _REAL if name != "Paderborn"]


def real_rigs(names=None, home=None):
    """Yield the real rigs that are there, each with all its recordings in memory.

    Without names, these are the rigs of `SAME_BEARING`.
    """
    home = Path(home or os.environ["SKARXLAG_DATA"])
    names = SAME_BEARING if names is None else names
    for name, (folder, rate, read) in _REAL.items():
        if name in names and (home / folder).is_dir():
            yield Rig(name, float(rate), list(read(home / folder)))


def simulated_rigs(seed=0):
    """Yield the simulated rig with each size of crack, with its torque as a second channel."""
    rig = simulate_rig(
        n_samples=_SIMULATED_SAMPLES,
        window_length=_SIMULATED_SAMPLES,
        random_state=seed,
    )
    for size in sorted(set(rig.crack_mm.tolist()) - {0.0}):
        keep = np.flatnonzero((rig.crack_mm == 0) | (rig.crack_mm == size))
        recordings = [
            Recording(rig.data[i], str(rig.target[i]), float(rig.rpm[i])) for i in keep
        ]
        yield Rig(f"simulated, {size:g} mm", 250_000.0, recordings)
