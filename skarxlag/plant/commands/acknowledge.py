"""Run ``skarxlag acknowledge``: leave a note for the command watch next to each state."""

import argparse
from contextlib import suppress

from ...persistence.monitor_states import load_monitor_state
from ..watch.sensors import acknowledgement, is_latched
from .messages import CommandError, as_command_error, say


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    with as_command_error():
        states = {path: load_monitor_state(path)[0] for path in args.states}
        for path, state in states.items():
            if not is_latched(state):
                raise CommandError(f"{path}: there is no latched alarm")
        for path in states:
            # A link is not followed, and a note that is there will do.
            with suppress(FileExistsError):
                acknowledgement(path).touch(exist_ok=False)
            say(f"{path}: the alarm will be acknowledged when watch looks at it next.")
    return 0
