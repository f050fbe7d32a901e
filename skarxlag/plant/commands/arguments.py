"""Types of arguments."""

import math
from argparse import ArgumentTypeError
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ..readers.formats.facts import check_unambiguous
from ..readers.speeds import HIGHEST_RPM, is_speed_source

#: Ways to state a bearing.
BEARING = (
    "a name such as 6205, dimensions 9,7.94,39.04, or orders outer=3.585,inner=5.415 "
    "(BPFO, BPFI)"
)


def number(
    kind: Any, expected: str, is_valid: Callable[[Any], bool]
) -> Callable[[str], Any]:
    """Return a type for argparse that parses a finite number and checks it."""

    def parse(text: str) -> Any:
        with suppress(ValueError, OverflowError):
            if math.isfinite(value := kind(text)) and is_valid(value):
                return value
        raise ArgumentTypeError(f"{text!r}, expected {expected}")

    return parse


positive_int = number(int, "an integer of at least 1", lambda value: value >= 1)
window_length = number(int, "an integer of at least 100", lambda value: value >= 100)
job_count = number(
    int, "a number of threads, or -1 for all cores", lambda value: value != 0
)
positive_number = number(float, "a number above 0", lambda value: value > 0)
rate = number(float, "a number between 0 and 1", lambda value: 0 < value < 1)


def sampling_rate(text: str) -> float:
    """Parse a sampling rate, whose sign must not be one of thousands."""
    try:
        check_unambiguous("sampling_rate", text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from error
    return positive_number(text)


def speed_or_source(text: str) -> dict[str, Any]:
    """Parse a shaft speed, or a source of speeds, to facts of recordings."""
    if is_speed_source(text):
        return {"speed_source": text}
    try:
        check_unambiguous("rpm", text, HIGHEST_RPM)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from error
    return {"rpm": positive_number(text)}


def bearing(text: str) -> str:
    """Check a name, dimensions or orders of a bearing, as `bearing_orders` takes them."""
    from ...bearings import bearing_orders

    try:
        bearing_orders(text)
    except ValueError as error:
        raise ArgumentTypeError(f"{text!r}: {error}") from error
    return text
