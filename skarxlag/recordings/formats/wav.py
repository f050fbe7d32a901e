"""WAV files. Samples of 24 bit are unpacked block by block."""

import struct
import warnings
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from ._contents import Channel, Contents, Format, slices

FORMAT = Format("WAV", (".wav",), states="the rate")


def contents(path: Path) -> Contents:
    """Return the channels ``0``, ``1``, ...; integer samples are divided by full scale."""
    try:
        sampling_rate, samples = _map(path)
        n_channels = 1 if samples.ndim == 1 else samples.shape[1]
        n_total, part_of = len(samples), _mapped_part
        del samples
    except _ThreeBytes:
        sampling_rate, n_channels, offset, n_bytes = _find_samples(path)
        n_total = n_bytes // (3 * n_channels)

        def part_of(path, part):
            return _unpacked_part(path, part, offset, n_channels)

    def read(names, n_samples):
        for part in slices(n_total, n_samples):
            block = part_of(path, part)
            by_channel = block[:, np.newaxis] if block.ndim == 1 else block
            yield [by_channel[:, int(name)] for name in names]

    channels = {str(i): Channel(sampling_rate=float(sampling_rate)) for i in range(n_channels)}
    return Contents(channels, read)


class _ThreeBytes(Exception):
    """Samples of three bytes, which cannot be mapped as an array."""


def _map(path):
    with warnings.catch_warnings():
        # SciPy warns of metadata, which is harmless, and of truncated files.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        try:
            return wavfile.read(path, mmap=True)
        except ValueError as error:
            if "mmap=True not compatible" in str(error):
                raise _ThreeBytes from None
            raise


def _mapped_part(path, part):
    # Mapped anew for each block, as in npy.
    block = _map(path)[1][part]
    if block.dtype == np.uint8:
        return (block - 128.0) / 128.0
    if block.dtype.kind == "i":
        return block / -float(np.iinfo(block.dtype).min)
    return block


def _find_samples(path):
    """Return sampling rate, number of channels, and offset and length of the samples in bytes."""
    with path.open("rb") as file:
        order = ">" if file.read(12)[:4] == b"RIFX" else "<"
        rate = n_channels = None
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
    return rate, n_channels, offset, n_bytes


def _unpacked_part(path, part, offset, n_channels):
    first, stop = part.start, part.stop
    width = 3 * n_channels
    packed = np.fromfile(path, np.uint8, (stop - first) * width, offset=offset + first * width)
    # Placed in the upper bytes of 32 bit, so that the sign is in its place.
    wide = np.zeros((stop - first, n_channels, 4), dtype=np.uint8)
    wide[..., 1:] = packed.reshape(stop - first, n_channels, 3)
    return wide.view("<i4")[..., 0] / 2.0**31
