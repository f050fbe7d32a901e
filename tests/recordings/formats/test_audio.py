"""Sound as the soundfile library writes it."""

import numpy as np
import pytest
from scipy.io import wavfile

from skarxlag import read_recording
from tests.recordings.blocks import recording_blocks

soundfile = pytest.importorskip("soundfile")

# Multiples of 2**-10, which 16 bits hold exactly.
Y, U = np.random.default_rng(0).integers(-1000, 1000, size=(2, 103)) / 1024


@pytest.mark.parametrize("suffix", ["flac", "w64", "rf64", "aiff", "aif", "caf", "au"])
@pytest.mark.parametrize("n_samples", [None, 10, 1000])
def test_samples_and_rate(tmp_path, suffix, n_samples):
    path = tmp_path / f"run.{suffix}"
    kind = "AIFF" if suffix == "aif" else None
    soundfile.write(
        path, np.stack([Y, U], axis=1), 48_000, subtype="PCM_16", format=kind
    )
    blocks, rates = zip(*recording_blocks(path, n_samples, channel=[1, 0]), strict=True)
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), [U, Y])
    assert set(rates) == {48_000}
    assert max(block.shape[1] for block in blocks) <= (n_samples or 103)


@pytest.mark.parametrize("subtype", ["PCM_24", "PCM_32", "FLOAT", "DOUBLE"])
@pytest.mark.parametrize("suffix", ["w64", "wav"])
def test_widths_of_samples(tmp_path, suffix, subtype):
    path = tmp_path / f"run.{suffix}"
    soundfile.write(path, Y, 8000, subtype=subtype)
    np.testing.assert_array_equal(read_recording(path)[0], Y)


def test_wav_of_24_bit_and_two_channels_in_parts(tmp_path):
    samples = np.random.default_rng(0).uniform(-1, 1, size=(103, 2))
    soundfile.write(tmp_path / "run.wav", samples, 51_200, subtype="PCM_24")
    _, expected = wavfile.read(tmp_path / "run.wav")
    blocks = [b for b, _ in recording_blocks(tmp_path / "run.wav", 10, channel=[0, 1])]
    assert len(blocks) == 11
    np.testing.assert_array_equal(np.concatenate(blocks, axis=1), expected.T / 2.0**31)


@pytest.mark.parametrize("suffix", ["flac", "w64", "rf64", "aiff", "caf", "au"])
@pytest.mark.parametrize("kept", [0, 10, 0.6])
def test_truncated_files(tmp_path, suffix, kept):
    path = tmp_path / f"run.{suffix}"
    soundfile.write(path, np.random.default_rng(0).uniform(-1, 1, size=9000), 48_000)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept if kept != 0.6 else 0.6 * len(whole))])
    # Without a header, libsndfile takes some suffixes for raw sound of no samples.
    with pytest.raises(ValueError, match=rf"run.{suffix}: .*(damaged|is empty)"):
        read_recording(path)
