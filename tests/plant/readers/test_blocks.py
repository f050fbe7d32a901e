"""Recordings that are read part by part are those that are read at once."""

import os
import re
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat, wavfile

from skarxlag import iter_windows, make_windows, read_recording
from skarxlag.plant.readers.cutting import cut_blocks, thin_windows
from tests.plant.readers.blocks import recording_blocks

RNG = np.random.default_rng(0)
N_SAMPLES = 103
Y, U = RNG.integers(-3000, 3000, size=(2, N_SAMPLES)) / 1024


def frame():
    return pd.DataFrame({"y": Y, "u": U})


WRITERS = {
    "vector.npy": lambda path: np.save(path, Y),
    "rows.npy": lambda path: np.save(path, np.stack([Y, U])),
    "columns.npy": lambda path: np.save(path, np.stack([Y, U], axis=1).astype("f4")),
    "fortran.npy": lambda path: np.save(path, np.asfortranarray(np.stack([Y, U]))),
    "run.npz": lambda path: np.savez(path, y=Y, u=U),
    "run.mat": lambda path: savemat(path, {"y": Y, "u": U}),
    "run.csv": lambda path: frame().to_csv(path, index=False),
    "bare.csv": lambda path: frame().to_csv(path, index=False, header=False),
    # The first block is integers.
    "mixed.csv": lambda path: pd.DataFrame({"y": ["1"] * 60 + ["0.5"] * 43}).to_csv(
        path, index=False
    ),
    "run.parquet": lambda path: frame().to_parquet(path),
    "run.feather": lambda path: frame().to_feather(path, chunksize=40),
    "run.csv.gz": lambda path: frame().to_csv(path, index=False),
    "run.bin": lambda path: Y.tofile(path),
    "groups.parquet": lambda path: frame().to_parquet(path, row_group_size=13),
    "two.wav": lambda path: wavfile.write(path, 8000, np.stack([Y, U], axis=1)),
}


@pytest.fixture
def small_blocks(monkeypatch):
    monkeypatch.setattr("skarxlag.plant.readers.cutting._BLOCK", 25)


@pytest.mark.slow
@pytest.mark.parametrize("n_samples", [1, 20, N_SAMPLES, 1000])
@pytest.mark.parametrize("name", WRITERS)
def test_blocks_are_the_recording(tmp_path, name, n_samples):
    path = tmp_path / name
    WRITERS[name](path)
    dtype = "<f8" if name == "run.bin" else None
    whole, sampling_rate = read_recording(path, channel=0, dtype=dtype)
    read = recording_blocks(path, n_samples, channel=0, dtype=dtype)
    blocks, rates = zip(*read, strict=True)
    np.testing.assert_array_equal(np.concatenate(blocks), whole)
    assert set(rates) == {sampling_rate}
    assert all(block.dtype == np.float64 for block in blocks)
    assert len(blocks) >= -(-N_SAMPLES // n_samples)
    assert max(map(len, blocks)) <= n_samples


@pytest.mark.parametrize(
    "name", ["columns.npy", "run.npz", "run.csv", "run.parquet", "two.wav"]
)
def test_windows_are_those_of_the_whole_recording(tmp_path, small_blocks, name):
    path = tmp_path / name
    WRITERS[name](path)
    for channel in (1, [1, 0]):
        for window_length in (1, 7, 25, 30, N_SAMPLES):
            expected = make_windows(
                read_recording(path, channel=channel)[0], window_length
            )
            parts = list(iter_windows(str(path), window_length, channel=channel))
            np.testing.assert_array_equal(np.concatenate(parts), expected)
            assert max(map(len, parts)) == max(25 // window_length, 1)


@pytest.mark.parametrize("cuts", [[], [1, 2, 3], [30, 31, 95], range(5, 100, 5)])
def test_windows_of_blocks_are_those_of_the_whole(monkeypatch, cuts):
    monkeypatch.setattr("skarxlag.plant.readers.cutting._BLOCK", 20)
    recording = np.random.default_rng(0).normal(size=(2, 103))
    parts = list(cut_blocks(np.split(recording, cuts, axis=1), "run", 7))
    np.testing.assert_array_equal(np.concatenate(parts), make_windows(recording, 7))
    assert max(map(len, parts)) <= 2


@pytest.mark.parametrize("max_windows", [1, 5, 100])
def test_thinned_windows_do_not_depend_on_the_parts(max_windows):
    windows = np.arange(64.0)[:, np.newaxis]
    kept, position, n_available = thin_windows([windows], max_windows)
    assert n_available == 64
    np.testing.assert_array_equal(kept[:, 0], position)
    assert len(kept) == {1: 1, 5: 4, 100: 64}[max_windows]
    in_parts, same, _ = thin_windows(np.split(windows, [1, 2, 30]), max_windows)
    np.testing.assert_array_equal(in_parts, kept)
    np.testing.assert_array_equal(same, position)


def test_default_window_length_is_1200(tmp_path):
    np.save(tmp_path / "run.npy", np.zeros(2500))
    assert [windows.shape for windows in iter_windows(tmp_path / "run.npy")] == [
        (2, 1200)
    ]


def test_mapped_file_is_let_go(tmp_path):
    np.save(tmp_path / "run.npy", Y)
    blocks = recording_blocks(tmp_path / "run.npy", 10)
    block, _ = next(blocks)
    blocks.close()
    assert block.base is None and block.flags.writeable


@pytest.mark.parametrize("suffix", [".npy", ".csv", ".parquet", ".wav"])
def test_bad_samples_are_counted_from_the_start_of_the_recording(
    tmp_path, small_blocks, suffix
):
    path = tmp_path / f"run{suffix}"
    bad = Y.copy()
    bad[60] = np.inf
    writer = {
        ".npy": lambda: np.save(path, bad),
        ".csv": lambda: pd.DataFrame({"y": bad}).to_csv(path, index=False),
        ".parquet": lambda: pd.DataFrame({"y": bad}).to_parquet(path),
        ".wav": lambda: wavfile.write(path, 8000, bad),
    }
    writer[suffix]()
    windows = iter_windows(path, 5)
    assert [next(windows).shape, next(windows).shape] == [(5, 5), (5, 5)]
    with pytest.raises(ValueError, match=rf"run{suffix}: .* infinite .*at sample 60"):
        next(windows)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("x", "line 62: 'x' in column 'y' is no number"),
        ("1,2", "line 62 has 2 fields, expected 1"),
        ("True", "line 62: 'True' in column 'y' is no number"),
    ],
)
def test_bad_lines_in_the_middle_of_a_csv_file(tmp_path, small_blocks, line, message):
    lines = [f"{value}" for value in Y]
    lines[60] = line
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["y", *lines]))
    with pytest.raises(ValueError, match=re.escape(f"{path}: {message}")):
        list(iter_windows(path, 5))


def test_recording_shorter_than_a_window_is_named(tmp_path, small_blocks):
    path = tmp_path / "run.csv"
    frame().to_csv(path, index=False)
    with pytest.raises(ValueError, match=r"run.csv: recording has 103 samples, .*=104"):
        list(iter_windows(path, N_SAMPLES + 1, channel="y"))


def test_wrong_window_lengths_are_named(tmp_path):
    np.save(tmp_path / "run.npy", Y)
    for length, error in ((0, ValueError), (2.5, TypeError)):
        with pytest.raises(error, match="window_length"):
            next(iter_windows(tmp_path / "run.npy", length))


PEAK = """
import sys
from pathlib import Path
import numpy as np
import skarxlag.plant.readers.cutting
from skarxlag import iter_windows

def peak():
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024

before = peak()
n_windows = sum(len(windows) for windows in iter_windows(sys.argv[1], 1200))
print(n_windows, peak() - before)
"""


@pytest.mark.slow
@pytest.mark.skipif(
    not os.path.exists("/proc/self/status"), reason="memory is read as on Linux"
)
def test_memory_does_not_grow_with_the_recording(tmp_path):
    path, n_samples = tmp_path / "run.npy", 8_000_000
    with path.open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": (n_samples,)}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + 8 * n_samples)
    command = [sys.executable, "-c", PEAK, path]
    n_windows, megabytes = map(float, subprocess.check_output(command).split())
    assert n_windows == n_samples // 1200
    assert megabytes < 45  # the samples are 61


@pytest.mark.parametrize("suffix", [".parquet", ".feather", ".csv", ".npy", ".bin"])
def test_no_samples_block_by_block(tmp_path, suffix):
    path = tmp_path / f"run{suffix}"
    empty = pd.DataFrame({"y": np.zeros(0)})
    writer = {
        ".parquet": lambda: empty.to_parquet(path),
        ".feather": lambda: empty.to_feather(path),
        ".csv": lambda: empty.to_csv(path, index=False),
        ".npy": lambda: np.save(path, np.zeros(0)),
        ".bin": path.touch,
    }
    writer[suffix]()
    with pytest.raises(ValueError, match=rf"run{suffix}: channel '.' is"):
        list(iter_windows(path, 5, dtype="<f8" if suffix == ".bin" else None))
