"""WAV files, which state their sampling rate."""

import warnings

import numpy as np
from scipy.io import wavfile

from ._channels import slices

SUFFIXES = (".wav",)


def blocks(path, n_samples):
    """Blocks of the channels; integer samples are divided by full scale."""
    sampling_rate, samples = _map_wav(path)
    if not isinstance(samples, np.memmap):
        n_samples = None
    for part in slices(len(samples), n_samples):
        # Mapped anew for each block, as in npy.
        block = (_map_wav(path)[1] if n_samples else samples)[part]
        if block.dtype == np.uint8:
            block = (block - 128.0) / 128.0
        elif block.dtype.kind == "i":
            # SciPy left-justifies odd widths (24 bit in int32), so full scale is the type's.
            block = block / -float(np.iinfo(block.dtype).min)
        by_channel = block[:, np.newaxis] if block.ndim == 1 else block
        yield {str(i): column for i, column in enumerate(by_channel.T)}, float(sampling_rate)


def _map_wav(path):
    with warnings.catch_warnings():
        # SciPy skips chunks of metadata with a warning, and warns of a truncated file alike.
        warnings.simplefilter("ignore", wavfile.WavFileWarning)
        warnings.filterwarnings("error", "Reached EOF", wavfile.WavFileWarning)
        try:
            return wavfile.read(path, mmap=True)
        except ValueError:  # 24 bit cannot be mapped
            return wavfile.read(path)
