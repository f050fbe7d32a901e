"""Vallen tradb files as vallenae writes them."""

import numpy as np
import pytest

from skarxlag import list_channels, read_recording

from .reading import in_blocks, truncate

vallenae = pytest.importorskip("vallenae")

RATE, N = 500_000, 64
# Volts in steps of the converter, in records of 64 samples.
STEP = 0.1e-3
COUNTS = np.random.default_rng(0).integers(-3000, 3000, size=(2, 4 * N))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.tradb"


def write(path, *, gap=0.0, compression=False, pretrigger=0, n_records=(4, 4)):
    """Write records of two channels in turn, with a gap before the third of each."""
    options = {"mode": "rwc", "compression": compression}
    with vallenae.io.TraDatabase(str(path), **options) as database:
        with database.connection() as connection:
            connection.execute(
                'INSERT INTO tr_params ("ID", "SetupID", "Chan", "ADC_µV", "TR_mV") '
                "VALUES (1, 1, 1, 1.0, 0.1)"
            )
        records = [
            (i, channel)
            for i in range(max(n_records))
            for channel in (1, 2)
            if i < n_records[channel - 1]
        ]
        for trai, (i, channel) in enumerate(records, start=1):
            counts = COUNTS[channel - 1, i * N : (i + 1) * N]
            record = vallenae.io.TraRecord(
                time=1 + (i * N + pretrigger) / RATE + (gap if i > 1 else 0),
                channel=channel,
                param_id=1,
                pretrigger=pretrigger,
                threshold=1e-3,
                samplerate=RATE,
                samples=N,
                data=(counts * STEP).astype("f4"),
                trai=trai,
            )
            database.write(record)


@pytest.mark.parametrize("compression", [False, True])
def test_records_without_a_gap_are_one_recording(path, compression):
    write(path, compression=compression, pretrigger=5)
    channels = list_channels(path)
    assert channels["channel"].tolist() == ["1", "2"]
    assert channels["sampling_rate"].tolist() == [RATE, RATE]
    assert channels["unit"].tolist() == ["V", "V"]
    for n_samples, longest in ((None, 256), (50, 50), (N, N), (1000, N)):
        read = in_blocks(path, n_samples, channel=["2", "1"])
        np.testing.assert_allclose(read[0], COUNTS[::-1] * STEP, atol=STEP, rtol=1e-6)
        assert read[1:] == (RATE, longest)


@pytest.mark.parametrize("gap", [1e-5, 0.2, -1e-4])
def test_single_transients_are_refused(path, gap):
    write(path, gap=gap)
    message = r"run.tradb: channel '1' holds single transients.* 127"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel="1")


def test_channels_of_different_length(path):
    write(path, n_records=(4, 3))
    message = r"different lengths, in samples: 1 256, 2 192"
    with pytest.raises(ValueError, match=message):
        read_recording(path, channel=["1", "2"])


@pytest.mark.parametrize("kept", [0, 100, 9000])
def test_truncated_files(path, kept):
    write(path)
    truncate(path, kept)
    with pytest.raises(ValueError, match=r"run.tradb: "):
        read_recording(path, channel="1")
