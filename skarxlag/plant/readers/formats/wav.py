"""WAV files. Those of 24 bit are read whole, because their samples must be unpacked."""

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .contents import Channel, Contents, Format, slices

FORMAT = Format((".wav",))


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels ``0``, ``1``, ...; integer samples are divided by full scale."""
    sampling_rate, samples = _map(path)
    n_total, n_channels = samples.shape
    unpacked = None if isinstance(samples, np.memmap) else samples
    del samples

    def read(names, n_samples):
        for part in slices(n_total, n_samples):
            # Mapped anew for each block, as in npy.
            block = (_map(path)[1] if unpacked is None else unpacked)[part]
            if block.dtype == np.uint8:
                block = block / 128.0 - 1
            elif block.dtype.kind == "i":
                block = block / -float(np.iinfo(block.dtype).min)
            yield [block[:, int(name)] for name in names]

    channels = {
        str(i): Channel(sampling_rate=float(sampling_rate)) for i in range(n_channels)
    }
    yield Contents(channels, read)


def _map(path):
    """Return the sampling rate, and the samples of shape (n_samples, n_channels)."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        # SciPy warns of metadata, which is harmless, and of truncated files.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        try:
            sampling_rate, samples = wavfile.read(path, mmap=True)
        except ValueError as error:
            if "mmap=True not compatible" not in str(error):
                raise
            sampling_rate, samples = wavfile.read(path)
    return sampling_rate, samples.reshape(len(samples), -1)
