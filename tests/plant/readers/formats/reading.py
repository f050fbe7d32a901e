"""Helpers that the tests of formats share."""

import numpy as np

from tests.plant.readers.blocks import recording_blocks


def in_blocks(path, n_samples=None, **options):
    """Return the signal of a file that is read block by block, its rate, and the longest block."""
    blocks, rates = zip(*recording_blocks(path, n_samples, **options), strict=True)
    (rate,) = set(rates)
    longest = max(block.shape[-1] for block in blocks)
    return np.concatenate(blocks, axis=-1), rate, longest


def truncate(path, kept):
    """Keep some bytes of a file, or a share of them."""
    content = path.read_bytes()
    path.write_bytes(content[: int(kept if kept >= 1 else kept * len(content))])
