import doctest

import pytest

from benchmarks.cross_speed import protocol
from benchmarks.pages import blocks as pages
from benchmarks.paper import comparison, printed_tables
from benchmarks.paper import protocol as paper_protocol


@pytest.mark.parametrize("module", [pages, protocol, comparison, printed_tables, paper_protocol])
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
