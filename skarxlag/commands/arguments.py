"""Values of arguments: what argparse calls to turn text into them, or to refuse it."""

import argparse
import math

from ..bearings import bearing_orders
from ..recordings.speeds import SpeedRange


def add_execution_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what many recordings are worked on with."""
    group = parser.add_argument_group("workers")
    group.add_argument(
        "--n-jobs", type=job_count, default=-1, metavar="N", help="at a time; default: all cores"
    )
    where = group.add_mutually_exclusive_group()
    where.add_argument(
        "--processes",
        action="store_true",
        help="use processes instead of threads: for many small or compressed files, and where a "
        "damaged one could end the process that reads it",
    )
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="use the workers of a dask.distributed scheduler, such as tcp://host:8786; they read "
        "the files and the model themselves, from the same paths",
    )


def positive_int(text: str) -> int:
    """An integer of at least 1."""
    return _integer(text, "an integer of at least 1", lambda value: value >= 1)


def window_length(text: str) -> int:
    """A number of samples; in fewer there is no model to identify."""
    return _integer(text, "an integer of at least 100", lambda value: value >= 100)


def seed(text: str) -> int:
    """An integer that seeds a random number generator."""
    return _integer(text, "an integer from 0 to 4294967295", lambda value: 0 <= value < 2**32)


def job_count(text: str) -> int:
    """A number of threads, or a negative one as in joblib."""
    return _integer(text, "a number of threads, or -1 for all cores", lambda value: value != 0)


def positive_number(text: str) -> float:
    """A finite number above 0."""
    return _number(text, "a number above 0", lambda value: value > 0)


def rate(text: str) -> float:
    """A number strictly between 0 and 1."""
    return _number(text, "a number between 0 and 1", lambda value: 0 < value < 1)


def speed_range(text: str) -> SpeedRange:
    """A shaft speed, alone, with a tolerance, or as a range."""
    try:
        return SpeedRange.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def speed_or_all(text: str) -> float | str:
    """A shaft speed, or the word all."""
    return text if text == "all" else _number(text, "a speed in rpm, or all", lambda v: v > 0)


def bearing(text: str) -> str:
    """Check a name, dimensions or orders of a bearing, as `bearing_orders` takes them."""
    try:
        bearing_orders(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: {error}") from error
    return text


def _integer(text, expected, is_valid):
    try:
        value = int(text)
    except ValueError:
        value = None
    if value is None or not is_valid(value):
        raise argparse.ArgumentTypeError(f"{text!r}, expected {expected}")
    return value


def _number(text, expected, is_valid):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or not is_valid(value):
        raise argparse.ArgumentTypeError(f"{text!r}, expected {expected}")
    return value
