"""WAV files. Samples of 24 bit are unpacked block by block."""

import struct
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from ._contents import Channel, Contents, Format, slices

FORMAT = Format("WAV", (".wav",), states="the rate")


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels ``0``, ``1``, ...; integer samples are divided by full scale."""
    sampling_rate, samples = _map(path)
    n_total, n_channels = samples.shape[:2]
    del samples

    def read(names, n_samples):
        for part in slices(n_total, n_samples):
            # Mapped anew for each block, as in npy.
            block = _scaled(_map(path)[1][part])
            yield [block[:, int(name)] for name in names]

    channels = {str(i): Channel(sampling_rate=float(sampling_rate)) for i in range(n_channels)}
    yield Contents(channels, read)


def _map(path):
    """Return the sampling rate, and the samples of shape (n_samples, n_channels[, 3 bytes])."""
    with warnings.catch_warnings():
        # SciPy warns of metadata, which is harmless, and of truncated files.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        try:
            sampling_rate, samples = wavfile.read(path, mmap=True)
        except ValueError as error:
            if "mmap=True not compatible" not in str(error):
                raise
            return _map_24_bit(path)
    return sampling_rate, samples.reshape(len(samples), -1)


def _map_24_bit(path):
    with path.open("rb") as file:
        order = ">" if file.read(12)[:4] == b"RIFX" else "<"
        while True:
            name, n_bytes = struct.unpack(f"{order}4sI", file.read(8))
            if name == b"data":
                break
            start = file.tell()
            if name == b"fmt ":
                _, n_channels, rate, _, _, bits = struct.unpack(f"{order}HHIIHH", file.read(16))
            # Chunks of odd length are padded.
            file.seek(start + n_bytes + n_bytes % 2)
        offset = file.tell()
    if order == ">" or bits != 24 or n_bytes > path.stat().st_size - offset:
        raise ValueError(f"{bits} bit in three bytes, {n_bytes} bytes of samples stated")
    shape = (n_bytes // (3 * n_channels), n_channels, 3)
    return rate, np.memmap(path, np.uint8, "r", offset, shape)


def _scaled(block):
    if block.ndim == 3:
        # In the upper bytes of 32 bit, the sign is in its place.
        wide = np.zeros((*block.shape[:2], 4), dtype=np.uint8)
        wide[..., 1:] = block
        block = wide.view("<i4")[..., 0]
    if block.dtype == np.uint8:
        return (block - 128.0) / 128.0
    if block.dtype.kind == "i":
        return block / -float(np.iinfo(block.dtype).min)
    return block
