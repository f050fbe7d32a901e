"""HDF5 files, MATLAB 7.3 among them, as h5py writes them."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from skarxlag import list_channels, read_recording
from tests.recordings.blocks import recording_blocks

h5py = pytest.importorskip("h5py")

RNG = np.random.default_rng(0)
Y, U = RNG.normal(size=(2, 103))


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file.attrs["SampleRate"] = 51200
        vibration = file.create_dataset("bearing/vibration", data=Y, chunks=(10,))
        vibration.attrs["units"] = "m/s2"
        slow = file.create_dataset("slow/torque", data=U.astype("f4"))
        slow.attrs["unit"] = b"Nm"
        slow.attrs["fs"] = np.array([100.0])
        file["slow/pair"] = np.stack([Y, U], axis=1)
        file["slow/sampling_rate"] = 20.0
        file["text"] = "a text"
        file["flags"] = np.ones(5, dtype=bool)
        file["again"] = h5py.SoftLink("/bearing/vibration")
    return path


def test_names_rates_and_units(path):
    channels = list_channels(path).set_index("channel")
    expected = ["bearing/vibration", "slow/pair[0]", "slow/pair[1]", "slow/torque"]
    assert channels.index.tolist() == expected
    assert channels["sampling_rate"].tolist() == [51200, 20, 20, 100]
    assert channels["unit"].tolist() == ["m/s2", None, None, "Nm"]


@pytest.mark.parametrize("n_samples", [None, 7, 1000])
def test_samples(path, n_samples):
    blocks, rates = zip(
        *recording_blocks(path, n_samples, channel="*vibration"), strict=True
    )
    np.testing.assert_array_equal(np.concatenate(blocks), Y)
    assert set(rates) == {51200}
    assert max(map(len, blocks)) <= (n_samples or 103)
    pair, rate = read_recording(path, channel=["slow/pair[1]", "slow/pair[0]"])
    np.testing.assert_array_equal(pair, [U, Y])
    assert rate == 20


def test_data_in_other_files_is_not_followed(tmp_path):
    (tmp_path / "secret.bin").write_bytes(bytes(800))
    with h5py.File(tmp_path / "run.h5", "w") as file:
        external = [(str(tmp_path / "secret.bin"), 0, 800)]
        file.create_dataset("y", shape=(100,), dtype="f8", external=external)
    with pytest.raises(ValueError, match=r"run.h5: data set '/y' lies in another file"):
        read_recording(tmp_path / "run.h5")


def test_views_of_other_files_are_not_followed(tmp_path):
    """A missing source would read as zeros, an existing one by its absolute path."""
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["y"] = Y
    layout = h5py.VirtualLayout((103,), "f8")
    layout[:] = h5py.VirtualSource(str(tmp_path / "secret.h5"), "y", (103,))
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_virtual_dataset("view", layout)
        file["own"] = U
    np.testing.assert_array_equal(read_recording(tmp_path / "run.h5")[0], U)
    with pytest.raises(
        ValueError, match=r"run.h5: data set '/view' is a view of other files"
    ):
        read_recording(tmp_path / "run.h5", channel="view")


@pytest.mark.parametrize("n_written", [0, 2**20])
def test_a_data_set_that_unpacks_to_gigabytes_is_refused_unread(tmp_path, n_written):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        large = file.create_dataset(
            "x", (2**29,), "f8", chunks=(2**20,), compression="gzip"
        )
        large[:n_written] = 0.0
    message = r"run.h5: \d+ bytes would unpack to 4294967296, expected at most"
    with pytest.raises(ValueError, match=message):
        list_channels(tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["x"] = np.arange(2**12)
        file.create_dataset("few", (2**20,), "f8", chunks=(2**20,), compression="gzip")
    assert len(read_recording(tmp_path / "run.h5", channel="few")[0]) == 2**20


def test_the_depth_of_groups_is_bounded(tmp_path):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        group = file
        for _ in range(400):
            group = group.create_group("g")
        group["y"] = Y
    with pytest.raises(
        ValueError, match=r"run.h5: groups are nested more than 20 deep"
    ):
        read_recording(tmp_path / "run.h5")


@pytest.mark.parametrize("where", ["/", "bearing", "bearing/y"])
@pytest.mark.parametrize(
    ("name", "value"),
    [("dt", 1 / 25600), ("Sampling interval (ms)", 1000 / 25600), ("fs", 25600)],
)
def test_steps_of_time_among_the_attributes(tmp_path, where, name, value):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["bearing/y"] = Y
        file[where].attrs[name] = value
    assert read_recording(tmp_path / "run.h5")[1] == 25600


@pytest.mark.parametrize("unit", ["kHz", np.bytes_("kHz")])
def test_units_of_the_sampling_rate(tmp_path, unit):
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["y"] = Y
        file["fs"] = 25.6
        file["fs"].attrs["units"] = unit
    assert read_recording(tmp_path / "run.h5", channel="y")[1] == 25_600
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["y"] = Y
        file["y"].attrs.update(sampling_rate=25.6, sampling_rate_unit=unit, unit="g")
    assert read_recording(tmp_path / "run.h5")[1] == 25_600


@pytest.fixture
def matlab(tmp_path):
    """Laid out as MATLAB 7.3 does: a user block, columns as rows, structs as groups."""
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values, kind in (
            ("y", Y[np.newaxis], b"double"),
            ("note", np.array([[104], [105]], dtype="u2"), b"char"),
            ("flags", np.ones((1, 5), dtype="u1"), b"logical"),
            ("bearing/gs", U[np.newaxis], b"double"),
            ("bearing/sr", np.array([[97656.0]]), b"double"),
            ("#refs#/a", np.zeros((1, 50)), b"double"),
        ):
            file[name] = values
            file[name].attrs["MATLAB_class"] = np.bytes_(kind)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(head)
    return path


def test_matlab_7_3(matlab):
    assert list_channels(matlab)["channel"].tolist() == ["bearing.gs", "y"]
    signal, rate = read_recording(matlab, channel="bearing.gs")
    np.testing.assert_array_equal(signal, U)
    assert rate == 97656
    assert read_recording(matlab, channel="y")[1] is None
    blocks = [block for block, _ in recording_blocks(matlab, 20, channel="y")]
    assert len(blocks) == 6
    np.testing.assert_array_equal(np.concatenate(blocks), Y)


@pytest.mark.parametrize("kept", [0, 10, 700, 2000])
def test_truncated_files(path, kept):
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ValueError, match=r"run.h5: .*damaged"):
        read_recording(path, channel=0)


def test_a_file_of_matlab_itself():
    """In SciPy's own test data; an early version that does not call itself 7.3."""
    path = (
        Path(scipy.io.matlab.__file__).parent
        / "tests"
        / "data"
        / "testhdf5_7.4_GLNX86.mat"
    )
    if not path.is_file():
        pytest.skip("SciPy was installed without its test data")
    signal, _ = read_recording(path)
    np.testing.assert_allclose(signal, np.arange(9) * np.pi / 4)


def test_cells_and_arrays_of_structs_of_matlab(tmp_path):
    """References, columns first, named as those of version 7; what is no signal is left out."""
    path = tmp_path / "cells.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        stored = file.create_group("#refs#")

        def refer(*arrays):
            for array in arrays:
                name = f"r{len(stored)}"
                stored[name] = np.asarray(array)
                stored[name].attrs["MATLAB_class"] = np.bytes_(b"double")
                yield stored[name].ref

        def put(name, references, **attributes):
            references = np.array(references, dtype=object)
            file.create_dataset(name, references.shape, h5py.ref_dtype)[...] = (
                references
            )
            file[name].attrs.update(attributes)

        cell = {"MATLAB_class": np.bytes_(b"cell")}
        # Two rows and two columns, which MATLAB writes as [[1, 2], [3, 4]].
        put("runs", np.reshape([*refer(Y, 2 * Y, 3 * Y, 4 * Y)], (2, 2)), **cell)
        put("one", [[*refer(U)]], **cell)
        put("s/acc", [[*refer(Y, U)]])
        put("s/fs", [[*refer([[100.0]], [[200.0]])]])
        put("text", [[*refer(Y)]], MATLAB_object_decode=3)
        file["empty"] = np.array([0, 7], dtype="u8")
        file["empty"].attrs["MATLAB_empty"] = 1
        file["sparse/data"], file["sparse/ir"] = Y, np.arange(103)
        file["sparse"].attrs["MATLAB_sparse"] = 200
        file["s"].attrs["MATLAB_class"] = np.bytes_(b"struct")
        file["s/back"] = file["/"]
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(head)
    channels = list_channels(path).set_index("channel")["sampling_rate"]
    assert channels.dropna().to_dict() == {"s[0].acc": 100, "s[1].acc": 200}
    names = ["one", "runs[0]", "runs[1]", "runs[2]", "runs[3]", "s[0].acc", "s[1].acc"]
    assert sorted(channels.index) == names
    for name, expected in zip(names, [U, Y, 3 * Y, 2 * Y, 4 * Y, Y, U], strict=True):
        for n_samples in (None, 20):
            blocks = [
                block for block, _ in recording_blocks(path, n_samples, channel=name)
            ]
            np.testing.assert_array_equal(np.concatenate(blocks), expected)
