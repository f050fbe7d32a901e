"""Lossless audio formats that libsndfile reads."""

import re
from collections.abc import Iterator
from pathlib import Path

from .contents import Channel, Contents, DamagedError, Format, check_unpacked, slices

FORMAT = Format(
    (".wav", ".flac", ".w64", ".rf64", ".aif", ".aiff", ".caf", ".au"),
    library="soundfile",
    isolated=True,
)

#: Lengths from here on are stated by recorders that do not know them.
_NO_LENGTH = 0x7FFF_0000


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels ``0``, ``1``, ...; integer samples are divided by full scale."""
    import soundfile

    with soundfile.SoundFile(path) as file:
        _check_whole(file)
        # Silence takes no space in a file: a small file can hold any number of samples.
        check_unpacked(path.stat().st_size, 8 * file.frames * file.channels)

        def read(names, n_samples):
            for part in slices(file.frames, n_samples):
                file.seek(part.start)
                block = file.read(
                    part.stop - part.start, dtype="float64", always_2d=True
                )
                if len(block) != part.stop - part.start:
                    raise DamagedError(
                        f"{part.start + len(block)} samples of {file.frames}"
                    )
                yield [block[:, int(name)] for name in names]

        rates = {"the header": float(file.samplerate)}
        yield Contents(
            {str(i): Channel(rates=rates) for i in range(file.channels)}, read
        )


def _check_whole(file):
    """Refuse a truncated file, which libsndfile only reports in its log or takes for raw sound."""
    if file.format == "RAW":
        raise DamagedError("no header")
    for stated, present in re.findall(r": (\d+) \(should be (\d+)\)", file.extra_info):
        if int(present) < int(stated) < _NO_LENGTH:
            raise DamagedError(f"{present} bytes of {stated}")
    if file.frames == 0:
        raise DamagedError(
            "the header states no samples; was the recorder stopped before it wrote the "
            "length?"
        )
