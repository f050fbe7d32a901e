"""WAV files. Those of 24 bit are read whole, because their samples must be unpacked."""

import io
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .contents import Channel, Contents, Format, slices

FORMAT = Format((".wav",))

#: Lengths from here on are stated by recorders that do not know them.
_NO_LENGTH = 0x7FFF_0000


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

    rates = {"the header": float(sampling_rate)}
    yield Contents({str(i): Channel(rates=rates) for i in range(n_channels)}, read)


def _map(path):
    """Return the sampling rate, and the samples of shape (n_samples, n_channels)."""
    from scipy.io import wavfile

    with warnings.catch_warnings():
        # SciPy warns of metadata, which is harmless, and of truncated files.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        content = _with_length(path)
        try:
            sampling_rate, samples = wavfile.read(content or path, mmap=not content)
        except ValueError as error:
            if "mmap=True not compatible" not in str(error):
                raise
            sampling_rate, samples = wavfile.read(path)
    return sampling_rate, samples.reshape(len(samples), -1)


def _with_length(path):
    """Return a file whose header states no length with its true length, else None.

    A recorder writes the length when it stops. Before that, it is zero or the largest
    number.
    """
    frame = 1
    name = b""
    with path.open("rb") as file:
        file.seek(12)
        while len(head := file.read(8)) == 8:
            name, size = struct.unpack("<4sI", head)
            if name == b"data":
                break
            start = file.tell()
            if name == b"fmt ":
                frame = max(int.from_bytes(file.read(16)[12:14], "little"), 1)
            file.seek(start + size + size % 2)
        start = file.tell()
        file.seek(0)
        n_bytes = path.stat().st_size - start
        if name != b"data" or n_bytes <= 0 or 0 < size < max(_NO_LENGTH, n_bytes):
            return None
        content = bytearray(file.read(start + n_bytes // frame * frame))
    struct.pack_into("<I", content, 4, len(content) - 8)
    struct.pack_into("<I", content, start - 4, len(content) - start)
    return io.BytesIO(content)
