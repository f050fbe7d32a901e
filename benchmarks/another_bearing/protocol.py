"""Training and test rows for another bearing: specimens of each location are left out.

The rows of a recording are stretches of 1 s. A fold leaves one specimen of each location
out of the training: a size of a fault (CWRU), an arc (HIT-SM) or a bearing of each
class (Paderborn). A location with one specimen is never left out. The rest is trained at
one setting, a speed and a load, on the first halves of the recordings. Asked is the
location of the rows of the specimens that are left out.
"""

from typing import NamedTuple

import numpy as np

from skarxlag.core.fault_locations import location_of_label

#: Names of the protocols: what training and test rows share.
SAME_BEARING = "same bearing, other speed"
ANOTHER = "another bearing, same speed"
ANOTHER_SPEED = "another bearing, other speed"
ANOTHER_LOAD = "another bearing, other load"
#: Bearing of each rig. The authors of UESTC and of the self-built rig do not state
#: theirs; see benchmarks/fault_orders/rigs.py.
BEARINGS = {
    "SpectraQuest": "6205",
    "self-built": "6205",
    "CWRU drive end": "6205",
    "CWRU fan end": "6203",
    "Paderborn": "6203",
    "UESTC": "UC204",
}


class Rows(NamedTuple):
    """Rows of 1 s and what is known of each."""

    X: np.ndarray
    condition: np.ndarray
    location: np.ndarray
    specimen: np.ndarray
    rpm: np.ndarray
    load: np.ndarray

    def __getitem__(self, rows):
        return Rows(*(each[rows] for each in self._asdict().values()))


class Fold(NamedTuple):
    """Training rows, and test rows by protocol."""

    train: Rows
    tests: dict


def rows_of(rig, recordings, half=None):
    """Rows of some recordings, or of one half of each.

    Parameters
    ----------
    rig : Rig
        As ``benchmarks.recipe.rigs.real_rigs`` yields it.
    recordings : list of Recording
        Recordings of the rig.
    half : {0, 1} or None, default=None
        First or second half; None: all.
    """
    length = int(rig.sampling_rate)
    samples = []
    facts = []
    for recording in recordings:
        signal = recording.samples
        if half is not None:
            middle = len(signal) // 2
            signal = signal[middle * half : middle * (half + 1)]
        n = len(signal) // length
        samples.append(signal[: n * length].reshape(n, length))
        specimen = recording.specimen or recording.condition
        location = location_of_label(recording.condition) or recording.condition
        load = recording.load or ""
        label = (
            f"{recording.condition} {specimen}"
            if recording.specimen
            else recording.condition
        )
        facts += n * [(label, location, specimen, recording.rpm, load)]
    columns = [np.array(column) for column in zip(*facts, strict=True)]
    return Rows(np.concatenate(samples), *columns)


def specimens_by_location(rig):
    """Return the specimens of each location of a bearing, sorted."""
    specimens = {}
    for recording in rig.recordings:
        location = location_of_label(recording.condition)
        if location is not None:
            specimens.setdefault(location, set()).add(
                recording.specimen or recording.condition
            )
    return {location: sorted(names) for location, names in specimens.items()}


def left_out_sets(rig):
    """Return the specimens that each fold leaves out: one of each location with several."""
    several = [names for names in specimens_by_location(rig).values() if len(names) > 1]
    n_folds = max(map(len, several), default=0)
    return [{names[k] for names in several if k < len(names)} for k in range(n_folds)]


def folds(rig):
    """Yield the folds of a rig: all specimens at one setting, then without those left out.

    Parameters
    ----------
    rig : Rig
        A real rig.

    Yields
    ------
    Fold
        Rows that train, and rows that test.
    """
    settings = sorted({(each.rpm, each.load or "") for each in rig.recordings})
    for left in [set(), *left_out_sets(rig)]:
        kept = []
        out = []
        for recording in rig.recordings:
            is_left = (recording.specimen or recording.condition) in left
            (out if is_left else kept).append(recording)
        for rpm, load in settings:
            at = [each for each in kept if (each.rpm, each.load or "") == (rpm, load)]
            train = rows_of(rig, at, half=0)
            if left:
                tested = rows_of(rig, out)
                is_speed = tested.rpm == rpm
                is_load = tested.load == load
                tests = {
                    ANOTHER: is_speed & is_load,
                    ANOTHER_SPEED: ~is_speed,
                    ANOTHER_LOAD: is_speed & ~is_load,
                }
            else:
                tested = rows_of(rig, kept, half=1)
                tests = {SAME_BEARING: tested.rpm != rpm}
            parts = {name: tested[rows] for name, rows in tests.items() if rows.any()}
            yield Fold(train, parts)
