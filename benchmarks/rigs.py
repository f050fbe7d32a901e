"""Recordings of the rigs in one folder, which ``$SKARXLAG_DATA`` or ``--data-home`` names.

`docs/data.md` describes the rigs. Those that are not in the folder are left out.
"""

import os
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io

from skarxlag import BearingGeometry
from skarxlag.core.fault_locations import location_of_label
from skarxlag.datasets import simulate_rig


class Recording(NamedTuple):
    """One recording: samples of shape (n_samples,) or (n_channels, n_samples), and labels.

    The specimen is a bearing, or one damage of a bearing.
    """

    samples: np.ndarray
    condition: str
    rpm: float
    specimen: str
    load: str = ""

    @property
    def location(self):
        """Return the fault location, or the condition if it is no bearing's."""
        return location_of_label(self.condition) or self.condition


class Rig(NamedTuple):
    """Recordings of one machine, with their sampling rate in Hz and the bearing."""

    name: str
    sampling_rate: float
    bearing: Any
    recordings: list


class Rows(NamedTuple):
    """Rows of equal length with the labels of their recordings."""

    X: np.ndarray
    condition: np.ndarray
    location: np.ndarray
    rpm: np.ndarray
    specimen: np.ndarray
    load: np.ndarray
    recording: np.ndarray
    is_late: np.ndarray

    def __getitem__(self, rows):
        return Rows(*(column[rows] for column in self._asdict().values()))


def rows_of(rig, length):
    """Cut both halves of all recordings of a rig into rows.

    Parameters
    ----------
    rig : Rig
        A rig.
    length : int
        Samples of a row.

    Returns
    -------
    Rows
        `is_late` is true for the rows of second halves.
    """
    samples = []
    labels = []
    for number, recording in enumerate(rig.recordings):
        middle = recording.samples.shape[-1] // 2
        n_rows = middle // length
        for is_late, start in ((False, 0), (True, middle)):
            part = recording.samples[..., start : start + n_rows * length]
            part = part.reshape(*part.shape[:-1], n_rows, length)
            samples.append(np.moveaxis(part, -2, 0))
            facts = (recording.condition, recording.location, recording.rpm)
            facts += (recording.specimen, recording.load, number, is_late)
            labels += n_rows * [facts]
    columns = [np.array(column) for column in zip(*labels, strict=True)]
    return Rows(np.concatenate(samples), *columns)


def _matlab(folder):
    for path in sorted(folder.rglob("*.mat")):
        content = scipy.io.loadmat(path)
        arrays = [np.asarray(array) for array in content.values()]
        samples = max(arrays, key=np.size)
        condition, rpm = path.stem.split("_")[:2]
        yield Recording(samples.astype(float).ravel(), condition, float(rpm), condition)


def _arrays(folder):
    for path in sorted(folder.glob("*.npz")):
        condition, setting = path.stem.rsplit("_", 1)
        with np.load(path) as content:
            samples = content["acceleration"].astype(float).ravel()
            rpm = float(content["rpm"])
        load = setting if setting.startswith("load") else ""
        # The speed of the name is nominal, as that of the other rigs.
        speed = rpm if load else float(setting)
        yield Recording(samples, condition, speed, condition, load)


def _sound(folder):
    import soundfile

    for path in sorted(folder.glob("*.flac")):
        condition, rpm = path.stem.rsplit("_", 1)
        yield Recording(soundfile.read(path)[0], condition, float(rpm), condition)


def _paderborn(folder):
    for path in sorted(folder.glob("*.npz")):
        condition, specimen = path.stem.split("_")
        with np.load(path) as content:
            names = ("signal", "rpm", "torque_nm", "radial_force_n")
            for signal, rpm, torque, force in zip(
                *(content[name] for name in names), strict=True
            ):
                load = f"{torque:g} Nm, {force:g} N"
                samples = signal.astype(float)
                yield Recording(samples, condition, float(rpm), specimen, load)


#: Folder, sampling rate, bearing and reader of each rig. Two bearings are not stated by
#: the authors: housings UCP 204 hold inserts UC 204, and the orders of the self-built
#: rig are those of a 6205.
_RIGS = {
    "UESTC": ("uestc", 20_000, "UC204", _matlab),
    "SpectraQuest": ("hit_sm/SpectraQuest MFS dataset", 51_200, "6205", _matlab),
    "self-built": ("hit_sm/Self-built dataset", 51_200, "6205", _matlab),
    "CWRU drive end": ("cwru_drive_end", 12_000, "6205", _arrays),
    "CWRU fan end": ("cwru_fan_end", 12_000, "6203", _arrays),
    "motor sound": ("motor_sound", 44_100, None, _sound),
    "Paderborn": ("paderborn", 64_000, "6203", _paderborn),
    "MFPT": (
        "mfpt",
        48_828,
        BearingGeometry(n_elements=8, element_diameter=0.235, pitch_diameter=1.245),
        _arrays,
    ),
}
#: Rigs with one specimen of each condition, recorded at several speeds.
SIX_RIGS = tuple(_RIGS)[:6]
#: Rigs with recordings of several specimens of a fault location.
SPECIMEN_RIGS = (*SIX_RIGS[1:5], "Paderborn")
#: Rigs whose bearing is known.
BEARING_RIGS = (*SIX_RIGS[:5], "Paderborn", "MFPT")


def read_rigs(names, home=None):
    """Yield the rigs of these names that are in the folder, with all their recordings."""
    home = Path(home or os.environ.get("SKARXLAG_DATA", "."))
    for name in names:
        if name.startswith("simulated"):
            yield simulated_rig(float(name.split()[1]))
            continue
        folder, rate, bearing, read = _RIGS[name]
        if (home / folder).is_dir():
            yield Rig(name, float(rate), bearing, list(read(home / folder)))


@cache
def simulated_rig(crack_mm, n_samples=60_000, random_state=0):
    """Return the simulated rig with one size of crack; its torque is the second channel."""
    rig = simulate_rig(
        crack_mm=crack_mm,
        n_samples=n_samples,
        window_length=n_samples,
        random_state=random_state,
    )
    recordings = [
        Recording(samples, str(condition), float(rpm), str(condition))
        for samples, condition, rpm in zip(rig.data, rig.target, rig.rpm, strict=True)
    ]
    return Rig(f"simulated {crack_mm:g} mm", rig.sampling_rate, None, recordings)
