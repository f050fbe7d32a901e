import doctest

import pytest

from benchmarks.cross_speed import intervals, peers_with_speed, protocol
from benchmarks.pages import blocks as pages
from benchmarks.pages import canaries, digests, terminal_example
from benchmarks.paper import comparison, printed_tables
from benchmarks.paper import protocol as paper_protocol

MODULES = [pages, canaries, digests, terminal_example]
MODULES += [protocol, intervals, peers_with_speed]
MODULES += [comparison, printed_tables, paper_protocol]


@pytest.mark.parametrize("module", MODULES)
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
