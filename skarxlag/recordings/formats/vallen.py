"""Vallen's databases of transients: acoustic emission that was recorded without a gap."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ._contents import Channel, ContentError, Contents, Format

FORMAT = Format((".tradb",), library="vallenae", isolated=True)

_SUMMARY = """
SELECT Chan, SUM(Samples), MIN(SampleRate), MAX(SampleRate) FROM tr_data
WHERE Chan IS NOT NULL GROUP BY Chan ORDER BY Chan
"""


def contents(path: Path) -> Iterator[Contents]:
    """Return the channels by their number, which counts from 1."""
    from vallenae.io import TraDatabase

    with TraDatabase(str(path)) as database:
        channels = {
            str(number): Channel(length, float(least) if least == most else None, "V")
            for number, length, least, most in database.connection().execute(_SUMMARY)
        }

        def read(names, n_samples):
            n_samples = n_samples or max(channels[names[0]].length, 1)
            records = [
                _records(database, name, channels[name].sampling_rate) for name in names
            ]
            streams = [_rechunked(arrays, n_samples) for arrays in records]
            yield from map(list, zip(*streams, strict=True))

        yield Contents(channels, read)


def _rechunked(arrays, n_samples):
    """Yield arrays of equal length from arrays of any length."""
    waiting = []
    count = 0
    for array in arrays:
        while len(array):
            part = array[: n_samples - count]
            waiting.append(part)
            array = array[len(part) :]
            count = count + len(part)
            if count == n_samples:
                yield np.concatenate(waiting)
                waiting = []
                count = 0
    if count:
        yield np.concatenate(waiting)


def _records(database, name, rate):
    """Samples of consecutive records, which must follow each other without a gap."""
    if rate is None:
        raise ContentError(f"channel {name!r} changes its sampling rate")
    end = None
    n_read = 0
    for record in database.iread(channel=int(name)):
        if len(record.data) != record.samples:
            raise ValueError(
                f"{len(record.data)} samples of {record.samples} in a record"
            )
        start = record.time - record.pretrigger / rate
        # Times are counted in ticks of 0.1 microseconds or so.
        if end is not None and abs(start - end) > 1.5 / rate + 2e-7:
            raise ContentError(
                f"channel {name!r} holds single transients: a gap of {start - end:g} s "
                f"after sample {n_read - 1}; expected none"
            )
        end = start + record.samples / rate
        n_read = n_read + record.samples
        yield record.data
