"""``python -m skarxlag`` and the console script ``skarxlag``."""

import gc
import sys

from .plant.commands import main


def run() -> int:
    """Run a command in a process of its own, and return the exit status.

    Imports create a million objects and no garbage. So the garbage collector runs less
    often than by default, and not at the end: a third of the time of a short command.
    """
    gc.set_threshold(100_000)
    try:
        return main()
    finally:
        gc.freeze()


if __name__ == "__main__":
    sys.exit(run())
