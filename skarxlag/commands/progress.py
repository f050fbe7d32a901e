"""How far a long command is: a bar on a terminal, lines in a log, nothing on request."""

import sys
from typing import Any, Self


class Progress:
    """Tells on stderr how much of the work is done.

    Parameters
    ----------
    total : int
        Number of steps.
    unit : str
        What a step is.
    quiet : bool
        Whether to say nothing.
    """

    def __init__(self, total: int, unit: str, *, quiet: bool = False) -> None:
        self._total, self._done, self._quiet, self._bar = total, 0, quiet, None
        if sys.stderr.isatty() and not quiet:
            try:
                from tqdm import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, unit=f" {unit}", file=sys.stderr, dynamic_ncols=True)

    def step(self, line: Any) -> None:
        """One step is done; the line says which and what came of it."""
        self._done += 1
        if self._quiet:
            return
        if self._bar is None:
            print(f"[{self._done}/{self._total}] {line}", file=sys.stderr, flush=True)
        else:
            self._bar.update()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: Any) -> None:
        if self._bar is not None:
            self._bar.close()
