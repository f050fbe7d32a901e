"""``python -m benchmarks.detection COMMAND ...``."""

from benchmarks.commands import run_command

COMMANDS = {
    "constants": "benchmarks.detection.constants",
    "rates": "benchmarks.detection.rates",
    "runs": "benchmarks.detection.runs",
    "unknown": "benchmarks.detection.unknown",
}

if __name__ == "__main__":
    run_command("benchmarks.detection", COMMANDS)
