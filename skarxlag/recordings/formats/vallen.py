"""Vallen's databases of transients: acoustic emission that was recorded without a gap."""

from pathlib import Path

from ._contents import ContentError, Contents, common_length, joined_streams

TITLE = "Vallen tradb"
SUFFIXES = (".tradb",)
LIBRARY, EXTRA = "vallenae", "formats"
ISOLATED = True
IN_PARTS = True
STATES = "rate and unit (V)"

_SUMMARY = """
SELECT Chan, SUM(Samples), MIN(SampleRate), MAX(SampleRate) FROM tr_data
WHERE Chan IS NOT NULL GROUP BY Chan ORDER BY Chan
"""


def contents(path: Path) -> Contents:
    """Return the channels by their number, which counts from 1."""
    from vallenae.io import TraDatabase

    with TraDatabase(str(path)) as database:
        rows = database.connection().execute(_SUMMARY).fetchall()
    lengths = {str(channel): length for channel, length, *_ in rows}
    rates = {str(row[0]): float(row[2]) for row in rows if row[2] == row[3]}

    def read(names, n_samples):
        n_total = common_length(lengths, names)
        with TraDatabase(str(path)) as database:
            streams = [_records(database, name, rates) for name in names]
            yield from joined_streams(streams, n_samples or max(n_total, 1))

    return Contents(list(lengths), read, rates, dict.fromkeys(lengths, "V"), lengths)


def _records(database, name, rates):
    """Samples of consecutive records, which must follow each other without a gap."""
    if name not in rates:
        raise ContentError(f"channel {name!r} changes its sampling rate")
    rate, end, n_read = rates[name], None, 0
    for record in database.iread(channel=int(name)):
        if len(record.data) != record.samples:
            raise ValueError(f"{len(record.data)} samples of {record.samples} in a record")
        start = record.time - record.pretrigger / rate
        # Times are counted in ticks of 0.1 microseconds or so.
        if end is not None and abs(start - end) > 1.5 / rate + 2e-7:
            raise ContentError(
                f"channel {name!r} holds single transients: {start - end:g} s lie between sample "
                f"{n_read - 1} and the next; expected a recording without a gap"
            )
        end, n_read = start + record.samples / rate, n_read + record.samples
        yield record.data
