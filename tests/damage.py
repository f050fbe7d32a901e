"""Damage to the bytes of a file, as hypothesis draws it."""

import os

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

EXAMPLES = os.environ.get("SKARXLAG_EXAMPLES")
some_examples = settings(
    max_examples=int(EXAMPLES or 8),
    derandomize=EXAMPLES is None,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
#: Share of the file at which a part begins, its length, and what replaces it.
_PART = st.tuples(st.floats(0, 1), st.integers(0, 200), st.binary(max_size=9))


@st.composite
def damaged(draw, content):
    """The content of a file, of which some parts are replaced, removed or cut off."""
    content = bytearray(content)
    for share, length, other in draw(st.lists(_PART, min_size=1, max_size=3)):
        # Headers are where the damage is done.
        end = draw(st.sampled_from([256, len(content)]))
        start = int(share * min(end, len(content)))
        end = draw(st.sampled_from([start + length, len(content)]))
        content[start:end] = other
    return bytes(content)
