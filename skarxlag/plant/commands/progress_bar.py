"""Bar with the remaining time of a command, on a terminal."""

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Mapping

_WIDTH = 30


class ProgressBar:
    """Bar on standard error, with an estimate of the remaining time.

    There is no bar if standard error is no terminal, or with --quiet.

    Parameters
    ----------
    work : mapping of str to float
        Amount of work of each kind. The time for a unit of work is measured for each
        kind. A kind that has not begun is assumed to take as long as the others
        together.
    args : argparse.Namespace
        Arguments of the command.
    """

    def __init__(self, work: Mapping[str, float], args: argparse.Namespace) -> None:
        self._is_shown = not args.quiet and sys.stderr.isatty()
        self._work = dict(work)
        self._done = Counter()
        self._seconds = Counter()
        self._last = time.monotonic()
        self._n_shown = 0

    def advance(self, kind: str, amount: float) -> None:
        """Count work of a kind that was done since the last call, and draw the bar."""
        now = time.monotonic()
        self._seconds[kind] += now - self._last
        self._done[kind] += amount
        self._last = now
        self.show()

    def clear(self) -> None:
        """Remove the bar, so that other text can be printed."""
        if self._n_shown:
            print("\r" + " " * self._n_shown, end="\r", file=sys.stderr, flush=True)
            self._n_shown = 0

    def seconds_left(self) -> float:
        """Estimate the remaining time."""
        of_all = self._seconds.total() / self._done.total()
        left = 0.0
        for kind, amount in self._work.items():
            done = self._done[kind]
            left += (amount - done) * (self._seconds[kind] / done if done else of_all)
        return left

    def show(self) -> None:
        """Draw the bar, once there is an estimate and until all is done."""
        self.clear()
        left = self.seconds_left()
        if not self._is_shown or left == 0:
            return
        passed = self._seconds.total()
        n_full = int(_WIDTH * passed / (passed + left))
        bar = f"[{'#' * n_full:<{_WIDTH}}] about {_duration(left)} left"
        print(bar, end="", file=sys.stderr, flush=True)
        self._n_shown = len(bar)


def _duration(seconds):
    """Return a time in seconds or minutes.

    >>> _duration(4.2), _duration(100.0), _duration(400.0)
    ('5 s', '100 s', '7 min')
    """
    return (
        f"{math.ceil(seconds)} s"
        if seconds <= 120
        else f"{math.ceil(seconds / 60)} min"
    )
