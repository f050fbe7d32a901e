import numpy as np
import pytest

from skarxlag.recordings.speeds import SpeedRange


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
def test_parse(text, low, high):
    assert SpeedRange.parse(text) == SpeedRange(low, high)


@pytest.mark.parametrize("text", ["", "fast", "0", "-5", "1800..1700", "nan", "1..2..3", "5+-"])
def test_what_is_no_range(text):
    with pytest.raises(ValueError, match=r"expected a speed such as 1797, 1797\+-30 or 1700\.\."):
        SpeedRange.parse(text)


def test_ends_belong_to_the_range():
    chosen = SpeedRange.parse("1700..1800").contains(np.array([1699.9, 1700, 1800, 1800.1]))
    assert chosen.tolist() == [False, True, True, False]


def test_text_of_a_range():
    assert [str(SpeedRange.parse(text)) for text in ("1797", "1797+-3")] == ["1797", "1794..1800"]
