"""Vallen's databases of transients: acoustic emission that was recorded without a gap."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .contents import Channel, ContentError, Contents, DamagedError, Format, slices

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
            str(number): Channel(
                length, {"one record": float(least), "another": float(most)}, "V"
            )
            for number, length, least, most in database.connection().execute(_SUMMARY)
        }

        def read(names, n_samples):
            streams = [
                _records(database, name, channels[name].rates["one record"])
                for name in names
            ]
            if n_samples is None:
                yield [np.concatenate(list(records)) for records in streams]
            else:
                # Channels of one rate have records of one length.
                for records in zip(*streams, strict=True):
                    for part in slices(len(records[0]), n_samples):
                        yield [samples[part] for samples in records]

        yield Contents(channels, read)


def _records(database, name, rate):
    """Samples of consecutive records, which must follow each other without a gap."""
    end = None
    n_read = 0
    for record in database.iread(channel=int(name)):
        if len(record.data) != record.samples:
            raise DamagedError(
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
