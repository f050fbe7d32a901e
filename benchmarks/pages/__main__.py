"""Regenerate the tables and figures of README and docs.

``python -m benchmarks.pages NAME`` runs the command of that part. Without a name, it runs the
commands of all parts that an earlier version of the package wrote. ``--check`` runs nothing. It
lists all parts with their version and date, the oldest first, and the number of commits to the
package since that day.
"""

import argparse
import shlex
import subprocess
import sys

from benchmarks.pages.parts import PARTS, ROOT, outdated, record, states


def main(arguments=None):
    """Run the command; with ``--check``, return the number of parts of an earlier version."""
    parser = argparse.ArgumentParser("python -m benchmarks.pages", description=__doc__)
    parser.add_argument("part", nargs="*", help=f"one or more of {', '.join(PARTS)}")
    parser.add_argument("--check", action="store_true", help="list the state of all parts")
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    options = parser.parse_args(arguments)
    if unknown := set(options.part) - set(PARTS):
        parser.error(f"{sorted(unknown)}: expected names among {', '.join(PARTS)}")
    if options.check:
        for name, (version, date) in states().items():
            print(f"{name:20} {version:8} {date or 'never':17} {_commits_since(date)}")
        return len(outdated())
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


def _commits_since(date):
    """Return how often the package was changed since then, empty if that is not known."""
    if not date:
        return ""
    command = ["git", "rev-list", "--count", f"--since={date}+0000", "HEAD", "--", "skarxlag"]
    try:
        counted = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return f"{counted.stdout.strip()} commits since"


if __name__ == "__main__":
    sys.exit(main())
