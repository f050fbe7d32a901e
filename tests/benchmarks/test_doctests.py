import doctest

import pages
import protocol
import pytest


@pytest.mark.parametrize("module", [pages, protocol])
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
