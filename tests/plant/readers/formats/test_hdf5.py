"""HDF5 files, MATLAB 7.3 among them, as h5py writes them."""

from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from skarxlag import list_channels, read_recording

from .reading import in_blocks, truncate

h5py = pytest.importorskip("h5py")

Y, U = np.random.default_rng(0).normal(size=(2, 103))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.h5"


def write(path, arrays, **attributes):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
        file.attrs.update(attributes)


@pytest.fixture
def bearing(path):
    pair = np.stack([Y, U], axis=1)[:50]
    flags = np.ones(5, dtype=bool)
    arrays = {"slow/pair": pair, "slow/sampling_rate": 20.0, "flags": flags}
    write(path, arrays | {"text": "a text"}, SampleRate=51200)
    with h5py.File(path, "a") as file:
        file.create_dataset("bearing/vibration", data=Y, chunks=(10,))
        file["bearing/vibration"].attrs["units"] = "m/s2"
        file["slow/torque"] = U[:20].astype("f4")
        file["slow/torque"].attrs.update(unit=b"Nm", fs=np.array([100.0]))
        file["again"] = h5py.SoftLink("/bearing/vibration")
    return path


def test_names_rates_and_units(bearing):
    channels = list_channels(bearing).set_index("channel")
    expected = ["bearing/vibration", "slow/pair[0]", "slow/pair[1]", "slow/torque"]
    assert channels.index.tolist() == expected
    assert channels["sampling_rate"].tolist() == [51200, 20, 20, 100]
    assert channels["unit"].tolist() == ["m/s2", None, None, "Nm"]


@pytest.mark.parametrize(("n_samples", "longest"), [(None, 103), (7, 7), (1000, 103)])
def test_samples(bearing, n_samples, longest):
    read = in_blocks(bearing, n_samples, channel="*vibration")
    np.testing.assert_array_equal(read[0], Y)
    assert read[1:] == (51200, longest)
    pair = in_blocks(bearing, n_samples, channel=["slow/pair[1]", "slow/pair[0]"])
    np.testing.assert_array_equal(pair[0], [U[:50], Y[:50]])
    assert pair[1] == 20


def test_data_in_other_files_is_not_followed(path):
    other = path.with_name("secret.bin")
    other.write_bytes(bytes(800))
    with h5py.File(path, "w") as file:
        file.create_dataset("y", (100,), "f8", external=[(str(other), 0, 800)])
    with pytest.raises(ValueError, match=r"run.h5: data set '/y' lies in other files"):
        read_recording(path)


def test_views_of_other_files_are_not_followed(path):
    """A missing source would read as zeros, an existing one by its absolute path."""
    write(path.with_name("secret.h5"), {"y": Y})
    layout = h5py.VirtualLayout((103,), "f8")
    layout[:] = h5py.VirtualSource(str(path.with_name("secret.h5")), "y", (103,))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("view", layout)
        file["signal"] = U
    np.testing.assert_array_equal(read_recording(path)[0], U)
    with pytest.raises(ValueError, match=r"'/view' lies in other files"):
        read_recording(path, channel="view")


@pytest.mark.parametrize("n_written", [0, 2**20])
def test_a_data_set_that_unpacks_to_gigabytes_is_refused_unread(path, n_written):
    packed = {"dtype": "f8", "chunks": (2**20,), "compression": "gzip"}
    with h5py.File(path, "w") as file:
        large = file.create_dataset("x", (2**29,), **packed)
        large[:n_written] = 0.0
    message = r"run.h5: \d+ bytes would unpack to 4294967296, expected at most"
    with pytest.raises(ValueError, match=message):
        list_channels(path)
    with h5py.File(path, "w") as file:
        file["x"] = np.arange(2**12)
        file.create_dataset("few", (2**20,), **packed)
    assert len(read_recording(path, channel="few")[0]) == 2**20


@pytest.mark.parametrize("where", ["/", "bearing", "bearing/y"])
@pytest.mark.parametrize(
    ("name", "value"),
    [("dt", 1 / 25600), ("Sampling interval (ms)", 1000 / 25600), ("fs", 25600)],
)
def test_steps_of_time_among_the_attributes(path, where, name, value):
    write(path, {"bearing/y": Y})
    with h5py.File(path, "a") as file:
        file[where].attrs[name] = value
    assert read_recording(path)[1] == 25600


@pytest.mark.parametrize("unit", ["kHz", np.bytes_("kHz")])
@pytest.mark.parametrize("of_channel", [True, False])
def test_units_of_the_sampling_rate(path, unit, of_channel):
    write(path, {"y": Y} if of_channel else {"y": Y, "fs": 25.6})
    with h5py.File(path, "a") as file:
        if of_channel:
            rate = {"sampling_rate": 25.6, "sampling_rate_unit": unit, "unit": "g"}
            file["y"].attrs.update(rate)
        else:
            file["fs"].attrs["units"] = unit
    assert read_recording(path, channel="y")[1] == 25_600


@pytest.mark.parametrize("kept", [0, 10, 700, 2000])
def test_truncated_files(bearing, kept):
    truncate(bearing, kept)
    with pytest.raises(ValueError, match=r"run.h5: .*damaged"):
        read_recording(bearing, channel=0)


@contextmanager
def matlab_file(path):
    """Lay out a file as MATLAB 7.3 does: a user block, columns as rows, structs as groups."""
    with h5py.File(path, "w", userblock_size=512) as file:
        yield file
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(head)


def test_matlab_7_3(tmp_path):
    path = tmp_path / "run.mat"
    with matlab_file(path) as file:
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
    assert list_channels(path)["channel"].tolist() == ["bearing.gs", "y"]
    signal, rate = read_recording(path, channel="bearing.gs")
    np.testing.assert_array_equal(signal, U)
    assert rate == 97656
    signal, rate, longest = in_blocks(path, 20, channel="y")
    np.testing.assert_array_equal(signal, Y)
    assert (rate, longest) == (None, 20)


def test_a_file_of_matlab_itself():
    """In SciPy's own test data; an early version that does not call itself 7.3."""
    folder = Path(scipy.io.matlab.__file__).parent / "tests" / "data"
    path = folder / "testhdf5_7.4_GLNX86.mat"
    if not path.is_file():
        pytest.skip("SciPy was installed without its test data")
    signal, _ = read_recording(path)
    np.testing.assert_allclose(signal, np.arange(9) * np.pi / 4)


def test_what_is_no_signal_of_matlab(tmp_path):
    """References, objects, sparse matrices and empty arrays are left out or refused."""
    path = tmp_path / "run.mat"
    with matlab_file(path) as file:
        stored = file.create_dataset("#refs#/a", data=Y)
        for name in ("runs", "object"):
            file.create_dataset(name, (1, 2), h5py.ref_dtype)[0, 1] = stored.ref
        file["runs"].attrs["MATLAB_class"] = np.bytes_(b"cell")
        file["object"].attrs["MATLAB_object_decode"] = 3
        file["empty"] = np.array([0, 7], dtype="u8")
        file["empty"].attrs["MATLAB_empty"] = 1
        file["sparse/data"] = Y
        file["sparse/ir"] = np.arange(103)
        file["sparse"].attrs["MATLAB_sparse"] = 200
        file["s/acc"] = U
        file["s/back"] = file["/"]
    assert list_channels(path)["channel"].tolist() == ["s.acc"]
    np.testing.assert_array_equal(read_recording(path)[0], U)
    for name, message in {"runs": "cell array", "object": "MATLAB object"}.items():
        with pytest.raises(ValueError, match=rf"run.mat: holds a {message}"):
            read_recording(path, channel=name)
