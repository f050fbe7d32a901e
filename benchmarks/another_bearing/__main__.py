"""``python -m benchmarks.another_bearing [COMMAND] ...``; without a command, the verdicts."""

import sys

from benchmarks.commands import run_command

COMMANDS = {
    "verdicts": "benchmarks.another_bearing.command",
    "noise": "benchmarks.another_bearing.noise",
    "curve": "benchmarks.another_bearing.curve",
    "constants": "benchmarks.another_bearing.constants",
}

if __name__ == "__main__":
    arguments = sys.argv[1:]
    if not arguments or arguments[0].startswith("--"):
        arguments = ["verdicts", *arguments]
    run_command("benchmarks.another_bearing", COMMANDS, arguments)
