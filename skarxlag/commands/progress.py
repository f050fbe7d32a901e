"""How far a long command is: a bar on a terminal, lines in a log, nothing on request."""

import argparse
import sys
from time import perf_counter
from typing import Any, Self

from .names import counted


def add_progress_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare how much is said meanwhile."""
    how_much = parser.add_mutually_exclusive_group()
    how_much.add_argument("-q", "--quiet", action="store_true", help="tell no progress")
    how_much.add_argument(
        "-v",
        "--verbose",
        action="store_true",
        help="tell more of each step, on a terminal too, and how long all took",
    )


class Progress:
    """Tells on stderr how much of the work is done.

    Parameters
    ----------
    total : int
        Number of steps.
    unit : str
        What a step is.
    args : argparse.Namespace
        With the arguments of `add_progress_arguments`.
    """

    def __init__(self, total: int, unit: str, args: Any) -> None:
        self._total, self._unit, self._done, self._bar = total, unit, 0, None
        self._quiet, self._verbose, self._started = args.quiet, args.verbose, perf_counter()
        if sys.stderr.isatty() and not self._quiet:
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, unit=f" {unit}", file=sys.stderr, dynamic_ncols=True)

    def step(self, line: str, more: str = "") -> None:
        """One step is done.

        Parameters
        ----------
        line : str
            Which, and what came of it.
        more : str, default=""
            What those want to know who ask for more.
        """
        self._done += 1
        if self._quiet:
            return
        text = f"[{self._done}/{self._total}] {line}"
        if self._verbose and more:
            text += f" ({more})"
        if self._bar is None:
            print(text, file=sys.stderr, flush=True)
            return
        if self._verbose:
            self._bar.write(text, file=sys.stderr)
        self._bar.update()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *exception: Any) -> None:
        if self._bar is not None:
            self._bar.close()
        if self._verbose and kind is None:
            seconds = perf_counter() - self._started
            print(
                f"{counted(self._done, self._unit)} in {seconds:.1f} s", file=sys.stderr, flush=True
            )
