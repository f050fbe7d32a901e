import numpy as np
from sklearn.utils import Bunch

from benchmarks.cross_speed.rigs import (
    split_by_crack,
    windows_of,
)
from benchmarks.recipe.rigs import Recording, Rig


def test_split_by_crack_keeps_the_healthy_windows_in_each_part():
    rig = Bunch(
        data=np.arange(5.0)[:, None],
        target=np.array(["ok", "a", "b", "a", "ok"]),
        target_names=["ok", "a", "b"],
        rpm=np.full(5, 300.0),
        recording=np.array(list("vwxyz")),
        start=np.arange(5),
        crack_mm=np.array([0.0, 3.0, 3.0, 6.0, 0.0]),
    )
    parts = split_by_crack("simulated rig", rig)
    assert list(parts) == ["simulated rig, 3 mm crack", "simulated rig, 6 mm crack"]
    small, large = parts.values()
    assert small.data.ravel().tolist() == [0, 1, 2, 4]
    assert small.start.tolist() == [0, 1, 2, 4]
    assert small.target_names == ["ok", "a", "b"]
    assert large.recording.tolist() == ["v", "y", "z"]
    assert large.target_names == ["ok", "a"]


def test_recordings_are_cut_into_windows():
    speeds = {"b": 100.0, "a": 200.0}
    samples = {"b": np.arange(250.0), "a": np.zeros(100)}
    recordings = [
        Recording(samples[name], name, speed) for name, speed in speeds.items()
    ]
    rig = windows_of(Rig("mine", 1000.0, recordings), 100)
    assert rig.target.tolist() == ["b", "b", "a"] and rig.target_names == ["a", "b"]
    assert rig.start.tolist() == [0, 100, 0]
    assert rig.recording.tolist() == ["b, 100 rpm", "b, 100 rpm", "a, 200 rpm"]
    assert rig.rpm.tolist() == [100.0, 100.0, 200.0]
    assert rig.data[1].tolist() == list(range(100, 200))
