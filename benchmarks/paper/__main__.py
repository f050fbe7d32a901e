"""``python -m benchmarks.paper COMMAND ...``."""

import sys
from importlib import import_module

COMMANDS = {
    "tables": "benchmarks.paper.tables",
    "fault-estimation": "benchmarks.paper.fault_estimation.command",
}

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in COMMANDS:
        sys.exit(f"usage: python -m benchmarks.paper {'|'.join(COMMANDS)}")
    import_module(COMMANDS[sys.argv[1]]).main(sys.argv[2:])
