"""Run ``skarxlag acknowledge``: leave a note for the command watch next to each state."""

import argparse
from contextlib import suppress

from ..watch.sensors import acknowledgement
from .messages import as_command_error, say


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    for path in args.states:
        # A link is not followed, and a note that is there will do.
        with as_command_error(), suppress(FileExistsError):
            acknowledgement(path).touch(exist_ok=False)
        say(f"{path}: a latched alarm is acknowledged when watch looks at it next.")
    return 0
