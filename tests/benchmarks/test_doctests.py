import doctest

import protocol
import pytest
import reporting


@pytest.mark.parametrize("module", [protocol, reporting])
def test_examples(module):
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
