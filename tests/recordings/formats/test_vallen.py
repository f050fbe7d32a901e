"""Vallen tradb files as vallenae writes them."""

import numpy as np
import pytest

from skarxlag import list_channels, read_recording
from tests.recordings.blocks import recording_blocks

vallenae = pytest.importorskip("vallenae")

RATE, N = 500_000, 64
# Volts in steps of the converter, in records of 64 samples.
STEP = 0.1e-3
COUNTS = np.random.default_rng(0).integers(-3000, 3000, size=(2, 4 * N))


def write(path, *, gap=0.0, compression=False, pretrigger=0, n_records=(4, 4)):
    with vallenae.io.TraDatabase(
        str(path), mode="rwc", compression=compression
    ) as database:
        with database.connection() as connection:
            columns = '("ID", "SetupID", "Chan", "ADC_µV", "TR_mV")'
            connection.execute(
                f"INSERT INTO tr_params {columns} VALUES (1, 1, 1, 1.0, 0.1)"
            )
        trai = 0
        for i in range(max(n_records)):
            for channel in (1, 2):
                if i >= n_records[channel - 1]:
                    continue
                trai += 1
                record = vallenae.io.TraRecord(
                    time=1 + (i * N + pretrigger) / RATE + (gap if i > 1 else 0),
                    channel=channel,
                    param_id=1,
                    pretrigger=pretrigger,
                    threshold=1e-3,
                    samplerate=RATE,
                    samples=N,
                    data=(COUNTS[channel - 1, i * N : (i + 1) * N] * STEP).astype("f4"),
                    trai=trai,
                )
                database.write(record)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("compression", [False, True])
@pytest.mark.parametrize("n_samples", [None, 50, N, 1000])
def test_records_without_a_gap_are_one_recording(tmp_path, compression, n_samples):
    path = write(tmp_path / "run.tradb", compression=compression, pretrigger=5)
    channels = list_channels(path)
    assert channels["channel"].tolist() == ["1", "2"]
    assert channels["sampling_rate"].tolist() == [RATE, RATE]
    assert channels["unit"].tolist() == ["V", "V"]
    blocks, rates = zip(
        *recording_blocks(path, n_samples, channel=["2", "1"]), strict=True
    )
    signal = np.concatenate(blocks, axis=1)
    np.testing.assert_allclose(signal, COUNTS[::-1] * STEP, atol=STEP, rtol=1e-6)
    assert set(rates) == {RATE}
    assert max(block.shape[1] for block in blocks) <= (n_samples or 4 * N)


@pytest.mark.parametrize("gap", [1e-5, 0.2, -1e-4])
def test_single_transients_are_refused(tmp_path, gap):
    path = write(tmp_path / "run.tradb", gap=gap)
    with pytest.raises(
        ValueError, match=r"run.tradb: channel '1' holds single transients.* 127"
    ):
        read_recording(path, channel="1")


def test_channels_of_different_length(tmp_path):
    path = write(tmp_path / "run.tradb", n_records=(4, 3))
    with pytest.raises(
        ValueError, match=r"different lengths, in samples: 1 256, 2 192"
    ):
        read_recording(path, channel=["1", "2"])


@pytest.mark.parametrize("kept", [0, 100, 9000])
def test_truncated_files(tmp_path, kept):
    path = write(tmp_path / "run.tradb")
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(ValueError, match=r"run.tradb: "):
        read_recording(path, channel="1")
