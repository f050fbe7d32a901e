import numpy as np

from benchmarks.recipe.rigs import real_rigs


def write_bearing(folder, name, seed):
    signal = np.random.default_rng(seed).normal(size=(2, 40)).astype(np.float32)
    facts = {
        "rpm": [900, 1500],
        "torque_nm": [0.7, 0.1],
        "radial_force_n": [1000.0, 400.0],
    }
    np.savez(folder / f"{name}.npz", signal=signal, sampling_rate=64_000.0, **facts)
    return signal


def test_each_setting_of_a_paderborn_bearing_is_a_recording_of_its_specimen(tmp_path):
    folder = tmp_path / "paderborn"
    folder.mkdir()
    inner = write_bearing(folder, "inner_KI04", 1)
    write_bearing(folder, "outer_KA04", 2)
    (rig,) = real_rigs(["Paderborn"], tmp_path)
    assert (rig.name, rig.sampling_rate) == ("Paderborn", 64_000)
    assert [each[1:] for each in rig.recordings] == [
        ("inner", 900.0, "KI04", "0.7 Nm, 1000 N"),
        ("inner", 1500.0, "KI04", "0.1 Nm, 400 N"),
        ("outer", 900.0, "KA04", "0.7 Nm, 1000 N"),
        ("outer", 1500.0, "KA04", "0.1 Nm, 400 N"),
    ]
    np.testing.assert_array_equal(rig.recordings[1].samples, inner[1])
