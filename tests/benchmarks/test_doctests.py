import doctest

import pytest

from benchmarks.cross_speed import protocol
from benchmarks.pages import blocks as pages


@pytest.mark.parametrize("module", [pages, protocol])
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
