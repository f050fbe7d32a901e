"""``python -m benchmarks.pages COMMAND ...``."""

from benchmarks.commands import run_command

COMMANDS = {"paper-figures": "benchmarks.pages.paper_figures"}

if __name__ == "__main__":
    run_command("benchmarks.pages", COMMANDS)
