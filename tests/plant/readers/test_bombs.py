"""Small files that hold any number of samples, in every compressed format."""

import gzip
import zipfile

import numpy as np
import pytest

from skarxlag.plant.readers.files import read_recording
from tests.plant.readers.blocks import recording_blocks

#: More than the 268 megabytes of samples that every format may hold.
TOO_MANY = 2**25 + 2**22


def text(path, n_samples):
    """Lines of 1024 bytes. The end of the file states the length of its last member alone."""
    member = gzip.compress((b"0" * 1023 + b"\n") * 2**15, compresslevel=1)
    path.write_bytes(member * (8 * n_samples // 2**25))


def archive(path, n_samples):
    """An archive of one array of zeros, written in parts."""
    header = {"descr": "<f8", "fortran_order": False, "shape": (n_samples,)}
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file,
        file.open("y.npy", "w", force_zip64=True) as member,
    ):
        np.lib.format.write_array_header_1_0(member, header)
        for _ in range(n_samples // 2**22):
            member.write(bytes(8 * 2**22))


def parquet(path, n_samples):
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    table = pa.table({"y": np.zeros(2**22)})
    with pq.ParquetWriter(path, table.schema) as file:
        for _ in range(n_samples // 2**22):
            file.write_table(table)


def feather(path, n_samples):
    pa = pytest.importorskip("pyarrow")
    table = pa.table({"y": np.zeros(2**22)})
    options = pa.ipc.IpcWriteOptions(compression="zstd")
    with (
        pa.OSFile(str(path), "wb") as sink,
        pa.ipc.new_file(sink, table.schema, options=options) as file,
    ):
        for _ in range(n_samples // 2**22):
            file.write_table(table)


def flac(path, n_samples):
    soundfile = pytest.importorskip("soundfile")
    with soundfile.SoundFile(path, "w", 48_000, 1, "PCM_16") as file:
        for _ in range(n_samples // 2**22):
            file.write(np.zeros(2**22, dtype=np.int16))


def hdf5(path, n_samples):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset(
            "y", shape=(n_samples,), dtype="f8", chunks=(2**16,), compression=1
        )


WRITERS = {
    "bomb.csv.gz": text,
    "bomb.npz": archive,
    "bomb.parquet": parquet,
    "bomb.feather": feather,
    "bomb.flac": flac,
    "bomb.h5": hdf5,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
def test_a_small_file_that_unpacks_to_gigabytes_is_refused(tmp_path, name, monkeypatch):
    """Whole and in blocks: a command that reads in blocks would otherwise not end."""
    path = tmp_path / name
    # Formats that are read in this process need no large file.
    monkeypatch.setattr(
        "skarxlag.plant.readers.formats.contents._ALWAYS_ALLOWED", 2**24
    )
    WRITERS[name](path, 2**23 if WRITERS[name] in (text, archive) else TOO_MANY)
    message = rf"{name}: \d+ bytes would unpack to \d{{8,}}, expected at most \d+ bytes"
    with pytest.raises(ValueError, match=message):
        read_recording(path)
    with pytest.raises(ValueError, match=message):
        for _ in recording_blocks(path, 2**20):
            pass
