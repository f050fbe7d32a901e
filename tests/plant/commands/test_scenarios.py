"""Words that three users read: healthy recordings only, faults at one speed, and a bearing's name.

The machines are two real rigs in the folder SKARXLAG_DATA. Each that is not there is
replaced by a simulated one.
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
#: Folder and sampling rate of each rig, its files by place and speed, its bearing, and
#: its speeds. Fits have the first halves of recordings, and verdicts are on the second.
RIGS = {
    "SpectraQuest": (
        "hit_sm/SpectraQuest MFS dataset",
        51_200,
        {"healthy": "Normal_{}.mat", "inner": "IR8_{}.mat", "outer": "OR8_{}.mat"},
        "6205",
        (600, 900, 1200),
    ),
    "UESTC": (
        "uestc/Data",
        20_000,
        {
            "healthy": "N_{0}/N_{0}_1.mat",
            "inner": "I_{0}/I_{0}_1.mat",
            "outer": "O_{0}/O_{0}_1.mat",
        },
        "UC204",
        (800, 1000, 1200),
    ),
}
PLACES = ("healthy", "inner", "outer")
PATTERN = r"(?P<condition>[a-z]+)_(?P<rpm>\d+)\."


def signal_of(path, place, rpm):
    """The samples of a file, or of the simulated rig."""
    if path.is_file():
        return max(
            map(np.asarray, scipy.io.loadmat(path).values()), key=np.size
        ).ravel()
    return np.concatenate([row(place, rpm, seed=seed) for seed in range(rpm, rpm + 12)])


@pytest.fixture(scope="module", params=RIGS)
def machine(request, tmp_path_factory):
    """Folders of first and of second halves, the bearing, the rate, and the speeds."""
    folder, rate, names, bearing, speeds = RIGS[request.param]
    home = Path(os.environ.get("SKARXLAG_DATA", "")) / folder
    is_real = home.is_dir()
    parts = [tmp_path_factory.mktemp(name) for name in ("before", "after")]
    for place in PLACES:
        for rpm in speeds:
            signal = signal_of(home / names[place].format(rpm), place, rpm)
            for part, samples in zip(parts, np.array_split(signal, 2), strict=True):
                np.save(part / f"{place}_{rpm}.npy", samples)
    facts = {"pattern": PATTERN, "sampling_rate": rate if is_real else RATE}
    before, after = (list_files(part, **facts) for part in parts)
    return before, after, bearing if is_real else "6205", speeds


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
    before, after, _, _ = machine
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
    before, after, bearing, speeds = machine
    model = tmp_path / "m.skops"
    options = {"bearing": bearing} if has_bearing else {}
    printed = "\n".join(fit(of(before, speeds=speeds[1:2]), model, **options))
    assert "Healthy: healthy\n" in printed
    assert "of recorded faults are within the healthy limits." in printed
    rows, _ = diagnose(after, SavedModel(model))
    check_confidence(rows)
    at_speed = rows[rows["rpm"] == speeds[1]]
    assert at_speed["verdict"].tolist() == at_speed["condition"].tolist()
    assert at_speed["alarm"].tolist() == ["no", "yes", "yes"]
    is_fault = rows["condition"] != "healthy"
    assert "healthy" not in set(rows["verdict"][is_fault])


def test_bearing_and_speed_only(machine):
    _, after, bearing, _ = machine
    model = bearing_model(bearing)
    assert "no recording is called healthy" in model.heading
    rows, diagnoses = diagnose(after, model)
    check_confidence(rows)
    by_place = rows.groupby("condition")["verdict"].agg(set)
    assert by_place["healthy"] == {"no fault pattern found"}
    assert "inner" in by_place["inner"] and "outer" in by_place["outer"]
    remark = diagnoses[0].remarks[-1]
    assert remark == "No fault pattern was found. Most ball faults show none."
