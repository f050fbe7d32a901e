"""Regenerate the tables and figures of README and docs.

``python -m benchmarks.pages NAME`` runs the command of that part. Without a name, it
runs the commands of all parts that are out of date. ``--check`` lists all parts, or
those that are named, with their state and date, the oldest first. It fails if one of
them is out of date:

- current: the code, the data and the command are those of the last run.
- moved: the code was changed since, but its canaries, cells that are recomputed in
  seconds, are still the same. ``--restamp`` declares these parts current.
- outdated: a canary differs, or the part has none. The names of the canaries follow.

Times and memory of a machine stay those of the code that was measured. Their parts are
moved when this code changes, and ``--restamp`` does not change that.
"""

import argparse
import shlex
import subprocess
import sys

from benchmarks.pages.modules import ROOT
from benchmarks.pages.parts import PARTS
from benchmarks.pages.states import MOVED, outdated, record, restamp, states


def main(arguments=None):
    """Run the command; with ``--check``, return the number of parts that are out of date."""
    parser = argparse.ArgumentParser(
        "python -m benchmarks.pages",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("part", nargs="*", help=f"one or more of {', '.join(PARTS)}")
    parser.add_argument("--check", action="store_true", help="list the states")
    parser.add_argument(
        "--restamp",
        action="store_true",
        help="with --check: record moved parts as current",
    )
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    options = parser.parse_args(arguments)
    if unknown := set(options.part) - set(PARTS):
        parser.error(f"{sorted(unknown)}: expected names among {', '.join(PARTS)}")
    if options.check:
        checked = states(options.part)
        for state in checked:
            print(f"{state.part:20} {state.name:10} {state.date:17} {state.differs}")
            part = PARTS[state.part]
            if options.restamp and state.name == MOVED and not part.of_machine:
                restamp(part)
        return sum(not state.is_valid for state in checked)
    for name in options.part or outdated():
        for arguments in PARTS[name].command.split(" && "):
            command = [sys.executable, *shlex.split(arguments)]
            if options.data_home and PARTS[name].downloads:
                command += ["--data-home", options.data_home]
            print(" ".join(command), file=sys.stderr, flush=True)
            subprocess.run(command, cwd=ROOT, check=True)
        # Blocks are recorded as they are written, with the date that they state.
        record(PARTS[name].images)
    return 0


if __name__ == "__main__":
    sys.exit(main())
