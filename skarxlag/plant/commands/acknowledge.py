"""Run ``skarxlag acknowledge``: leave a note for the command watch next to each state."""

import argparse

from ...persistence.monitor_states import load_monitor_state
from ..watch.stream import acknowledgement, is_latched
from .messages import CommandError, as_command_error, say


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    with as_command_error():
        states = {path: load_monitor_state(path)[0] for path in args.states}
        for path, state in states.items():
            if not is_latched(state):
                raise CommandError(f"{path}: there is no latched alarm")
        for path in states:
            acknowledgement(path).touch()
            say(f"{path}: the alarm will be acknowledged when watch looks at it next.")
    return 0
