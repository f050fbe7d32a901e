import numpy as np
import pytest

from skarxlag import iter_windows, list_channels, read_recording

Y = np.arange(24)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.bin"


@pytest.mark.parametrize("dtype", ["<i2", ">i2", "u1", "<f4", ">f8", "int32"])
@pytest.mark.parametrize("name", ["run.bin", "run.RAW", "run.dat"])
def test_one_channel(tmp_path, dtype, name):
    Y.astype(dtype).tofile(tmp_path / name)
    signal, rate = read_recording(tmp_path / name, dtype=dtype)
    np.testing.assert_array_equal(signal, Y)
    assert rate is None
    (windows,) = iter_windows(tmp_path / name, 10, dtype=dtype)
    np.testing.assert_array_equal(windows, Y[:20].reshape(2, 10))


def test_interleaved_channels(path):
    Y.astype("<i2").tofile(path)
    signal, _ = read_recording(path, channel=[2, 0], dtype="(3,)<i2")
    np.testing.assert_array_equal(signal, [Y[2::3], Y[::3]])


def test_fields(path):
    fields = np.zeros(5, dtype="<f8,<i2")
    fields["f1"] = np.arange(5)
    fields.tofile(path)
    assert list_channels(path, dtype="<f8,<i2")["channel"].tolist() == ["f0", "f1"]
    signal, _ = read_recording(path, channel="f1", dtype="<f8,<i2")
    np.testing.assert_array_equal(signal, range(5))


@pytest.mark.parametrize(
    ("dtype", "message"),
    [
        (None, "raw binary states no type; expected dtype"),
        ("<i7", "dtype is '<i7'"),
        ("O", "dtype is 'O'"),
        ("U3", "dtype is 'U3'"),
        ("M8[s]", "dtype is"),
        ("<i2,O", "dtype is"),
        ("", "dtype is ''"),
        ("V0", "dtype is"),
        ("(99999,)<i2", "dtype is"),
        ("(2,2)<i2,<f4", "dtype is"),
        ("<f4", "25 bytes are no multiple of the 4 bytes of dtype '<f4'"),
    ],
)
def test_wrong_types(path, dtype, message):
    path.write_bytes(bytes(25))
    with pytest.raises(ValueError, match=rf"run.bin: {message}"):
        read_recording(path, dtype=dtype)


def test_empty_file(path):
    path.touch()
    with pytest.raises(ValueError, match=r"run.bin: channel '0' is empty"):
        read_recording(path, dtype="<i2")
