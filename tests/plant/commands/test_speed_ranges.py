from argparse import ArgumentTypeError

import pytest

from skarxlag.plant.commands.arguments import speed_range


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("1797", 1797, 1797),
        (" 1797.5 ", 1797.5, 1797.5),
        ("1797+-30", 1767, 1827),
        ("1000 ± 2 %", 980, 1020),
        ("1000+/-2.5%", 975, 1025),
        ("1700..1800", 1700, 1800),
        ("10+-30", 0, 40),
    ],
)
def test_ends_of_a_range(text, low, high):
    assert speed_range(text) == (low, high)


@pytest.mark.parametrize(
    "text", ["", "fast", "0", "-5", "1800..1700", "nan", "1..2..3", "5+-"]
)
def test_what_is_no_range(text):
    message = r"expected a speed such as 1797, 1797\+-30 or 1700\.\."
    with pytest.raises(ArgumentTypeError, match=message):
        speed_range(text)
