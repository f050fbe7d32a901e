"""Recordings read block by block, for tests of the formats."""

from skarxlag.plant.readers.files import open_file


def recording_blocks(path, n_samples=None, *, channel=None, **options):
    """Blocks of a file, each with its sampling rate."""
    facts, blocks = open_file(path, n_samples, choices=[channel], **options)
    for signal in blocks:
        yield signal, facts.sampling_rate
