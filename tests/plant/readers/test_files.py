import pickle
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat, wavfile

from skarxlag import read_recording
from skarxlag.plant.readers.formats import isolation

RNG = np.random.default_rng(0)
# Multiples of 2**-10, which a decimal text holds exactly.
Y = RNG.integers(-3000, 3000, size=50) / 1024
U = RNG.integers(-3000, 3000, size=50) / 1024


def write(path, content):
    """Write channels by name in the format of the suffix."""
    if path.suffix == ".mat":
        savemat(path, content)
    elif path.suffix == ".npz":
        np.savez(path, **content)
    elif path.suffix == ".csv":
        pd.DataFrame(content).to_csv(path, index=False)
    else:
        pd.DataFrame(content).to_parquet(path)
    return path


NAMED = [".mat", ".npz", ".csv", ".parquet"]


@pytest.mark.parametrize("suffix", [*NAMED, ".CSV"])
@pytest.mark.parametrize("channel", ["u", 1, "1", np.int64(1)])
def test_one_channel_by_name_or_position(tmp_path, suffix, channel):
    path = write(tmp_path / f"run{suffix.lower()}", {"y": Y, "u": U}).rename(
        tmp_path / f"run{suffix}"
    )
    signal, sampling_rate = read_recording(path, channel=channel)
    np.testing.assert_array_equal(signal, U)
    assert signal.dtype == np.float64
    assert sampling_rate is None


@pytest.mark.parametrize("suffix", NAMED)
def test_several_channels_in_the_order_asked(tmp_path, suffix):
    path = write(tmp_path / f"run{suffix}", {"a": U, "b": Y, "c": 2 * U})
    signal, _ = read_recording(str(path), channel=["b", 0])
    np.testing.assert_array_equal(signal, [Y, U])
    one, _ = read_recording(path, channel=["c"])
    np.testing.assert_array_equal(one, [2 * U])


@pytest.mark.parametrize(
    ("suffix", "channel"),
    [(".csv", c) for c in ("x", 2, -1, "2", "-1", "")]
    + [(s, ["y", "x"]) for s in NAMED],
)
def test_unknown_channel_lists_those_available(tmp_path, suffix, channel):
    path = write(tmp_path / f"run{suffix}", {"y": Y, "u": U})
    message = rf"run{suffix}: no channel .*; available: 'y', 'u'"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel=channel)
    with pytest.raises(ValueError, match=rf"run{suffix}: several channels.*'y', 'u'"):
        read_recording(path)


def test_long_lists_are_shortened(tmp_path):
    path = write(tmp_path / "run.csv", {f"c{i:02}": Y for i in range(30)})
    with pytest.raises(ValueError, match=r"'c19' and 10 more$"):
        read_recording(path)


@pytest.mark.parametrize("channel", [["y", "y"], ["y", 0], ["y", "u", "*y"]])
def test_a_channel_that_is_chosen_twice(tmp_path, channel):
    path = write(tmp_path / "run.csv", {"y": Y, "u": U})
    message = r"run.csv: channel 'y' is chosen more than once"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel=channel)


def test_empty_sequence_of_channels(tmp_path):
    path = write(tmp_path / "run.csv", {"y": Y})
    message = r"run.csv: channel is an empty sequence; available: 'y'"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel=[])


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".parquet"])
def test_a_name_made_of_digits_wins_over_the_position(tmp_path, suffix):
    path = write(tmp_path / f"run{suffix}", {"1": Y, "u": U})
    np.testing.assert_array_equal(read_recording(path, channel="1")[0], Y)
    np.testing.assert_array_equal(read_recording(path, channel=1)[0], U)


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_single_numbers_texts_and_flags_are_no_channels(tmp_path, suffix):
    content = {
        "rate": 20_000,
        "text": "a text",
        "flags": np.ones(50, dtype=bool),
        "y": Y,
    }
    if suffix == ".mat":
        del content[
            "flags"
        ]  # MATLAB has no boolean arrays on disk, only flagged integers
    path = write(tmp_path / f"run{suffix}", content)
    np.testing.assert_array_equal(read_recording(path)[0], Y)
    with pytest.raises(ValueError, match=r"no channel 'text'; available: 'y'$"):
        read_recording(path, channel="text")


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_file_without_any_channel(tmp_path, suffix):
    path = write(tmp_path / f"run{suffix}", {"rate": 20_000, "text": "a text"})
    with pytest.raises(ValueError, match=rf"run{suffix}: holds no numeric array"):
        read_recording(path)


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".npy"])
@pytest.mark.parametrize("transposed", [False, True])
def test_matrix_is_split_along_its_shorter_side(tmp_path, suffix, transposed):
    path = tmp_path / f"run{suffix}"
    matrix = np.stack([Y, U]).T if transposed else np.stack([Y, U])
    if suffix == ".npy":
        np.save(path, matrix)
        names = ["0", "1"]
    else:
        write(path, {"x": matrix})
        names = ["x[0]", "x[1]"]
    np.testing.assert_array_equal(read_recording(path, channel=names)[0], [Y, U])
    with pytest.raises(ValueError, match="several channels"):
        read_recording(path)


@pytest.mark.parametrize("shape", [(50,), (50, 1), (1, 50), (1, 1, 50)])
def test_vector_of_any_orientation(tmp_path, shape):
    np.save(tmp_path / "run.npy", Y.reshape(shape))
    np.testing.assert_array_equal(read_recording(tmp_path / "run.npy")[0], Y)


@pytest.mark.parametrize("shape", [(5, 5), (2, 3, 50)])
def test_arrays_without_a_time_axis_are_refused(tmp_path, shape):
    np.save(tmp_path / "run.npy", np.zeros(shape))
    with pytest.raises(ValueError, match=r"run.npy: .*expected a vector, or a matrix"):
        read_recording(tmp_path / "run.npy")


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_channels_of_different_length(tmp_path, suffix):
    path = write(tmp_path / f"run{suffix}", {"y": Y, "u": U[:-1]})
    with pytest.raises(ValueError, match=rf"run{suffix}: .*: y 50, u 49"):
        read_recording(path, channel=["y", "u"])
    np.testing.assert_array_equal(read_recording(path, channel="u")[0], U[:-1])


@pytest.mark.parametrize("dtype", ["i2", "u4", "f4", ">f4", "i8"])
def test_every_type_becomes_float64(tmp_path, dtype):
    values = np.arange(50).astype(dtype)
    np.save(tmp_path / "run.npy", values)
    signal, _ = read_recording(tmp_path / "run.npy")
    assert signal.dtype == np.float64
    assert signal.dtype.isnative
    np.testing.assert_array_equal(signal, np.arange(50))


@pytest.mark.parametrize("suffix", NAMED)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite(tmp_path, suffix, bad):
    values = Y.copy()
    values[[17, 30]] = bad
    path = write(tmp_path / f"run{suffix}", {"y": values})
    message = rf"run{suffix}: channel 'y' has missing, NaN or infinite.*at sample 17"
    with pytest.raises(ValueError, match=message):
        read_recording(path)


def test_missing_values_of_nullable_columns(tmp_path):
    frame = pd.DataFrame({"y": pd.array([1, None, 3], dtype="Int64")})
    frame.to_parquet(tmp_path / "run.parquet")
    with pytest.raises(ValueError, match=r"missing, NaN or infinite.*at sample 1"):
        read_recording(tmp_path / "run.parquet")
    frame.fillna(2).to_parquet(tmp_path / "run.parquet")
    np.testing.assert_array_equal(
        read_recording(tmp_path / "run.parquet")[0], [1, 2, 3]
    )


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".npy"])
def test_complex_values(tmp_path, suffix):
    path = tmp_path / f"run{suffix}"
    if suffix == ".npy":
        np.save(path, Y + 1j * U)
    else:
        write(path, {"y": Y + 1j * U})
    message = rf"run{suffix}: channel .* of type complex128"
    with pytest.raises(ValueError, match=message):
        read_recording(path)


def test_array_of_text(tmp_path):
    np.save(tmp_path / "run.npy", np.array(["1", "2"]))
    message = r"run.npy: channel '0' is of type <U1, expected real numbers"
    with pytest.raises(ValueError, match=message):
        read_recording(tmp_path / "run.npy")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_columns_of_text_and_flags(tmp_path, suffix):
    content = {"y": ["1.5", "2,5", "x"], "flag": [True, False, True]}
    path = write(tmp_path / f"run{suffix}", content)
    message = "channel 'y' is not numeric: '2,5' at sample 1"
    if suffix == ".csv":
        message = "line 4: 'x' in column 'y' is no number"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="y")
    with pytest.raises(ValueError, match="channel 'flag' is of type bool"):
        read_recording(path, channel="flag")


def test_csv_keeps_all_digits(tmp_path):
    path = write(tmp_path / "run.csv", {"y": RNG.normal(size=2000) * 1e-7})
    expected = [float(line) for line in path.read_text().split()[1:]]
    # The parser of pandas before 3 is a few units in the last place off.
    np.testing.assert_allclose(read_recording(path)[0], expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("y\n1\n\n3\n", "has missing, NaN or infinite values, the first at sample 1"),
        ("y,u\n1,2\n3\n", "line 3 has 1 fields, expected 2"),
        ("y,u\n1,2,3\n4,5,6\n", "2 names for the 3 fields of a sample"),
        ("y,u\n0,2,3\n1,5,6\n", "2 names for the 3 fields of a sample"),
        ("y,u\n1,2\n4,5,6\n", "line 3"),
        ("", "No columns to parse"),
    ],
)
def test_broken_lines_of_csv(tmp_path, text, message):
    (tmp_path / "run.csv").write_text(text)
    with pytest.raises(ValueError, match=rf"run.csv: .*{message}"):
        read_recording(tmp_path / "run.csv", channel="u" if "u" in text else 0)


@pytest.mark.parametrize(
    ("dtype", "full_scale", "offset"),
    [("u1", 128, 128), ("i2", 2**15, 0), ("i4", 2**31, 0), ("f4", 1, 0), ("f8", 1, 0)],
)
def test_wav_is_scaled_to_full_scale(tmp_path, dtype, full_scale, offset):
    values = np.clip(Y, -1, 0.9) * full_scale + offset
    samples = np.append(values, [offset - full_scale, offset]).astype(dtype)
    wavfile.write(tmp_path / "run.wav", 8000, samples)
    signal, sampling_rate = read_recording(tmp_path / "run.wav")
    assert sampling_rate == 8000
    assert signal.min() == -1
    assert signal[-1] == 0
    np.testing.assert_array_equal(signal, (samples.astype(float) - offset) / full_scale)


def savers():
    return {
        "compressed.mat": lambda path: savemat(path, {"y": Y}, do_compression=True),
        "plain.mat": lambda path: savemat(path, {"y": Y}),
        "version4.mat": lambda path: savemat(path, {"y": Y}, format="4"),
        "run.npy": lambda path: np.save(path, Y),
        "run.npz": lambda path: np.savez(path, y=Y),
        "compressed.npz": lambda path: np.savez_compressed(path, y=Y),
        "run.parquet": lambda path: pd.DataFrame({"y": Y}).to_parquet(path),
        "run.feather": lambda path: pd.DataFrame({"y": Y}).to_feather(path),
    }


@pytest.mark.parametrize("name", savers())
def test_truncated_files(tmp_path, name):
    path = tmp_path / name
    savers()[name](path)
    whole = path.read_bytes()
    read_recording(path, channel=0)
    for kept in (0, 4, 60, len(whole) // 2, len(whole) - 9, len(whole) - 1):
        path.write_bytes(whole[:kept])
        with pytest.raises(ValueError, match=rf"{name}: .*damaged"):
            read_recording(path, channel=0)


@pytest.mark.parametrize("suffix", [".mat", ".npz", ".npy", ".parquet", ".wav"])
def test_foreign_content(tmp_path, suffix):
    (tmp_path / f"run{suffix}").write_text("time,y\n0,1\n" * 100)
    with pytest.raises(ValueError, match=rf"run{suffix}: .*damaged"):
        read_recording(tmp_path / f"run{suffix}")


class Trap:
    def __reduce__(self):
        return (sys.exit, ("the trap was sprung",))


@pytest.mark.parametrize("name", ["array.npy", "archive.npz", "plain.npy", "plain.npz"])
def test_pickles_are_refused_and_never_run(tmp_path, name):
    path = tmp_path / name
    trap = np.array([Trap()], dtype=object)
    if name == "array.npy":
        np.save(path, trap, allow_pickle=True)
    elif name == "archive.npz":
        np.savez(path, y=Y, trap=trap)
    else:
        path.write_bytes(pickle.dumps(Trap()))
    message = rf"{name}: holds pickled objects, which are refused"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel=0)


@pytest.mark.parametrize("suffix", [".mat", ".csv", ".npy", ".npz", ".wav", ".parquet"])
def test_missing_file(tmp_path, suffix):
    for path in (tmp_path / f"run{suffix}", tmp_path / f"folder{suffix}"):
        if path.stem == "folder":
            path.mkdir()
        with pytest.raises(FileNotFoundError, match=rf"{path.name}: no such file"):
            read_recording(path)


@pytest.mark.parametrize("name", ["run.log", "run", "run.pkl", "run.gz"])
def test_unknown_suffix(tmp_path, name):
    (tmp_path / name).write_text("1\n2\n")
    message = rf"{name}: unknown suffix .* expected one of .mat, .npy"
    with pytest.raises(ValueError, match=message):
        read_recording(tmp_path / name)


@pytest.mark.parametrize(
    ("library", "name", "extra"),
    [
        ("pyarrow", "run.parquet", "io"),
        ("h5py", "run.h5", "formats"),
        ("h5py", "v73.mat", "formats"),
    ],
)
def test_a_missing_library_is_named_with_its_extra(
    tmp_path, monkeypatch, library, name, extra
):
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    (tmp_path / name).write_bytes(head.ljust(600, b"\0"))
    # A module that cannot be imported, in a fresh process of the reader.
    (tmp_path / f"{library}.py").write_text(f"raise ImportError('x', name={library!r})")
    monkeypatch.syspath_prepend(tmp_path)
    isolation.end_readers()
    message = rf"{name}: .*needs {library}: pip install 'skarxlag\[{extra}\]'"
    with pytest.raises(ImportError, match=message):
        read_recording(tmp_path / name)
    isolation.end_readers()


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_arrays_without_a_time_axis_do_not_hide_the_others(tmp_path, suffix):
    path = write(tmp_path / f"run{suffix}", {"square": np.eye(3), "y": Y})
    np.testing.assert_array_equal(read_recording(path)[0], Y)
    message = rf"run{suffix}: array 'square' of shape \(3, 3\)"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="square")


def test_a_file_is_opened_once(tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("acc,rpm\n" + "".join(f"{y},900\n" for y in Y))
    code = (
        "import sys, pathlib\n"
        "from skarxlag.plant.readers.listing import ListedRecording\n"
        "names = []\n"
        "sys.addaudithook(lambda event, args: event == 'open' and names.append(args[0]))\n"
        "entry = ListedRecording(None, 'run', pathlib.Path(sys.argv[1]))\n"
        "opened = entry.open(25, reads_speed=True)\n"
        "assert opened.entry.rpm == 900 and opened.channels == [('acc', None)]\n"
        "assert len(list(opened.blocks)) == 2\n"
        "print(names.count(sys.argv[1]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, check=True
    )
    assert done.stdout == "1\n"
