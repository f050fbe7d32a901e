"""Words that three users read: healthy recordings only, faults at one speed, and a bearing's name.

The machine is a real rig in the folder SKARXLAG_DATA, or a simulated one.
"""

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from skarxlag.plant.commands.diagnose import diagnose
from skarxlag.plant.commands.fit import fit
from skarxlag.plant.commands.models import SavedModel, bearing_model
from skarxlag.plant.readers.listing import list_files

from ...bearing_rows import RATE, row

pytestmark = pytest.mark.filterwarnings(
    "ignore:.* lie more than the factor:UserWarning"
)
#: Folder, sampling rate and speeds of the rig, and its files by place. Fits have the
#: first halves of recordings, and verdicts are on the second.
FOLDER, RIG_RATE = "hit_sm/SpectraQuest MFS dataset", 51_200
FILES = {"healthy": "Normal_{}.mat", "inner": "IR8_{}.mat", "outer": "OR8_{}.mat"}
SPEEDS = (600, 900, 1200)
BEARING = "6205"
PLACES = ("healthy", "inner", "outer")
PATTERN = r"(?P<condition>[a-z]+)_(?P<rpm>\d+)\."


def signal_of(path, place, rpm):
    """The samples of a file, or of the simulated rig."""
    if path.is_file():
        return max(
            map(np.asarray, scipy.io.loadmat(path).values()), key=np.size
        ).ravel()
    return np.concatenate([row(place, rpm, seed=seed) for seed in range(rpm, rpm + 12)])


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Recordings of the first and of the second halves."""
    home = Path(os.environ.get("SKARXLAG_DATA", "")) / FOLDER
    parts = [tmp_path_factory.mktemp(name) for name in ("before", "after")]
    for place in PLACES:
        for rpm in SPEEDS:
            signal = signal_of(home / FILES[place].format(rpm), place, rpm)
            for part, samples in zip(parts, np.array_split(signal, 2), strict=True):
                np.save(part / f"{place}_{rpm}.npy", samples)
    rate = RIG_RATE if home.is_dir() else RATE
    return [list_files(part, pattern=PATTERN, sampling_rate=rate) for part in parts]


def of(recordings, places=PLACES, speeds=None):
    return [
        each
        for each in recordings
        if each.condition in places and (speeds is None or each.rpm in speeds)
    ]


def check_confidence(rows):
    """A verdict with a probability of .9 or more is right, or no condition."""
    stated = rows[rows["probability"].fillna(0) >= 0.9]
    assert (stated["verdict"] == stated["condition"]).all()


def test_healthy_recordings_only(machine, tmp_path):
    before, after = machine
    model = tmp_path / "m.skops"
    printed = "\n".join(fit(of(before, ["healthy"]), model))
    assert "Healthy: healthy\n" in printed
    assert "False alarms: " in printed and "Missed faults: " not in printed
    rows, diagnoses = diagnose(after, SavedModel(model))
    is_healthy = rows["condition"] == "healthy"
    assert set(rows["verdict"][is_healthy]) == {"healthy"}
    assert set(rows["alarm"][is_healthy]) == {"no"}
    assert set(rows["verdict"][~is_healthy]) == {"changed"}
    assert set(rows["alarm"][~is_healthy]) == {"yes"}
    remarks = " ".join(diagnoses[-1].remarks)
    assert "Changed: a new fault, or another load, mounting or sensor," in remarks


@pytest.mark.parametrize("has_bearing", [True, False])
def test_faults_at_one_speed(machine, tmp_path, has_bearing):
    before, after = machine
    model = tmp_path / "m.skops"
    options = {"bearing": BEARING} if has_bearing else {}
    printed = "\n".join(fit(of(before, speeds=SPEEDS[1:2]), model, **options))
    assert "Healthy: healthy\n" in printed
    assert "of recorded faults are within the healthy limits." in printed
    rows, _ = diagnose(after, SavedModel(model))
    check_confidence(rows)
    at_speed = rows[rows["rpm"] == SPEEDS[1]]
    assert at_speed["verdict"].tolist() == at_speed["condition"].tolist()
    assert at_speed["alarm"].tolist() == ["no", "yes", "yes"]
    is_fault = rows["condition"] != "healthy"
    assert "healthy" not in set(rows["verdict"][is_fault])


def test_bearing_and_speed_only(machine):
    _, after = machine
    model = bearing_model(BEARING)
    assert "no recording is called healthy" in model.heading
    rows, diagnoses = diagnose(after, model)
    check_confidence(rows)
    by_place = rows.groupby("condition")["verdict"].agg(set)
    assert by_place["healthy"] == {"no fault pattern found"}
    assert "inner" in by_place["inner"] and "outer" in by_place["outer"]
    remark = diagnoses[0].remarks[-1]
    assert remark == "No fault pattern was found. Most ball faults show none."
