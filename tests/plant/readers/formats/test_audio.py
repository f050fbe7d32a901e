"""Sound as the soundfile library writes it."""

import numpy as np
import pytest

from skarxlag import read_recording

from .reading import in_blocks, truncate

soundfile = pytest.importorskip("soundfile")

# Multiples of 2**-10, which 16 bits hold exactly.
Y, U = np.random.default_rng(0).integers(-1000, 1000, size=(2, 103)) / 1024


@pytest.mark.parametrize(
    "suffix", ["wav", "flac", "w64", "rf64", "aiff", "aif", "caf", "au"]
)
def test_samples_and_rate(tmp_path, suffix):
    path = tmp_path / f"run.{suffix}"
    kind = "AIFF" if suffix == "aif" else None
    both = np.stack([Y, U], axis=1)
    soundfile.write(path, both, 48_000, subtype="PCM_16", format=kind)
    for n_samples, longest in ((None, 103), (10, 10), (1000, 103)):
        read = in_blocks(path, n_samples, channel=[1, 0])
        np.testing.assert_array_equal(read[0], [U, Y])
        assert read[1:] == (48_000, longest)


@pytest.mark.parametrize("subtype", ["PCM_24", "PCM_32", "FLOAT", "DOUBLE"])
@pytest.mark.parametrize("suffix", ["w64", "wav"])
def test_widths_of_samples(tmp_path, suffix, subtype):
    path = tmp_path / f"run.{suffix}"
    soundfile.write(path, Y, 8000, subtype=subtype)
    np.testing.assert_array_equal(read_recording(path)[0], Y)


@pytest.mark.parametrize("suffix", ["wav", "flac", "w64", "rf64", "aiff", "caf", "au"])
@pytest.mark.parametrize("kept", [0, 10, 0.6])
def test_truncated_files(tmp_path, suffix, kept):
    path = tmp_path / f"run.{suffix}"
    soundfile.write(path, np.random.default_rng(0).uniform(-1, 1, size=9000), 48_000)
    truncate(path, kept)
    # Without a header, libsndfile takes some suffixes for raw sound of no samples.
    with pytest.raises(ValueError, match=rf"run.{suffix}: .*(damaged|is empty)"):
        read_recording(path)
