"""Lossless audio formats that libsndfile reads."""

import re
from pathlib import Path

from ._contents import Channel, Contents, Format

FORMAT = Format(
    "FLAC, W64, RF64, AIFF, CAF, AU",
    (".flac", ".w64", ".rf64", ".aif", ".aiff", ".caf", ".au"),
    library="soundfile",
    isolated=True,
    states="the rate",
)


def contents(path: Path) -> Contents:
    """Return the channels ``0``, ``1``, ...; integer samples are divided by full scale."""
    import soundfile

    with soundfile.SoundFile(path) as file:
        names = [str(i) for i in range(file.channels)]
        rate, n_total = float(file.samplerate), file.frames
        _check_whole(file.extra_info)

    def read(names, n_samples):
        with soundfile.SoundFile(path) as file:
            n_read = 0
            while n_read < n_total or n_read == 0:
                block = file.read(n_samples or n_total, dtype="float64", always_2d=True)
                yield [block[:, int(name)] for name in names]
                n_read += len(block)
                if not len(block):
                    break
        if n_read != n_total:
            raise ValueError(f"{n_read} samples of {n_total}")

    return Contents({name: Channel(sampling_rate=rate) for name in names}, read)


def _check_whole(log):
    """Refuse a truncated file, which libsndfile only reports in its log."""
    for stated, found in re.findall(r": (\d+) \(should be (\d+)\)", log):
        # Writers to a pipe state the largest length, because they do not know it.
        if int(found) < int(stated) < 0xFFFF_FFFF:
            raise ValueError(f"{found} bytes of {stated}")
