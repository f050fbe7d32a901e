import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from skarxlag import list_channels, read_recording
from skarxlag.plant.readers.files import recording_start

from .reading import in_blocks

Y, U = np.random.default_rng(0).normal(size=(2, 103))


@pytest.mark.parametrize("compression", ["lz4", "zstd", "uncompressed"])
@pytest.mark.parametrize("suffix", ["feather", "arrow"])
def test_feather(tmp_path, suffix, compression):
    path = tmp_path / f"run.{suffix}"
    frame = pd.DataFrame({"y": Y, "note": "x", "u": U.astype("f4")})
    frame.to_feather(path, compression=compression, chunksize=40)
    assert list_channels(path)["channel"].tolist() == ["y", "note", "u"]
    np.testing.assert_array_equal(read_recording(path, channel="u")[0], U.astype("f4"))
    signal, _, longest = in_blocks(path, 30, channel="y")
    np.testing.assert_array_equal(signal, Y)
    assert longest == 30
    message = "channel 'note' is not numeric: 'x' at sample 0"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="note")


@pytest.mark.parametrize("name", [None, "Timestamp", "recorded"])
@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Berlin"])
def test_an_index_of_dates(tmp_path, name, zone):
    path = tmp_path / "run.parquet"
    index = pd.date_range("2026-11-22", periods=len(Y), freq="40us", tz=zone, name=name)
    pd.DataFrame({"y": Y}, index=index).to_parquet(path)
    signal, rate = read_recording(path)
    np.testing.assert_array_equal(signal, Y)
    assert rate == 25_000
    assert recording_start(path) == index[0].timestamp()


def test_an_index_of_numbers_is_not_a_channel(tmp_path):
    path = tmp_path / "run.parquet"
    pd.DataFrame({"y": Y}, index=np.arange(len(Y))[::-1]).to_parquet(path)
    assert list_channels(path)["channel"].tolist() == ["y"]


PEAK_OF_MEMORY = """
import pathlib, sys
from skarxlag.plant.readers.formats import arrow
peaks = []
for path in sys.argv[1:]:
    for contents in arrow.contents(pathlib.Path(path)):
        n_rows = sum(len(block[0]) for block in contents.read(["acc"], 9999))
    status = pathlib.Path("/proc/self/status").read_text()
    peaks.append(int(status.split("VmHWM:")[1].split()[0]) * 1024)
print(n_rows, peaks[1] - peaks[0])
"""


@pytest.mark.slow
@pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="states no peak of memory"
)
def test_a_group_of_rows_is_not_loaded_whole(tmp_path):
    paths = [tmp_path / "few.parquet", tmp_path / "many.parquet"]
    signal = np.sin(np.arange(4e6))
    for path, n_rows in zip(paths, (60_000, len(signal)), strict=True):
        frame = pd.DataFrame({"acc": signal[:n_rows]})
        frame.to_parquet(path, row_group_size=n_rows)
    command = [sys.executable, "-c", PEAK_OF_MEMORY, *paths]
    n_read, more = map(int, subprocess.check_output(command).split())
    assert n_read == len(signal)
    assert more < signal.nbytes / 2
