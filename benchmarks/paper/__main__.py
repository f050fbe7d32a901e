"""``python -m benchmarks.paper COMMAND ...``."""

from benchmarks.commands import run_command

COMMANDS = {
    "tables": "benchmarks.paper.tables",
    "fault-estimation": "benchmarks.paper.fault_estimation.command",
}

if __name__ == "__main__":
    run_command("benchmarks.paper", COMMANDS)
