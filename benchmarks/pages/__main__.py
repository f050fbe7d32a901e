"""Write anew what is generated in README and docs.

``python -m benchmarks.pages`` runs the command of every part that is out of date, ``--check`` tells
which these are, and a name runs the command of that part alone. A part is out of date when the
code that it depends on has changed since it was written.
"""

import argparse
import shlex
import subprocess
import sys

from benchmarks.pages.parts import PARTS, ROOT, record, stale


def main(arguments=None):
    """Run the command; the number of parts that are out of date with ``--check``."""
    parser = argparse.ArgumentParser("python -m benchmarks.pages", description=__doc__)
    parser.add_argument("part", nargs="*", help=f"of {', '.join(PARTS)}")
    parser.add_argument("--check", action="store_true", help="tell what is out of date")
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    options = parser.parse_args(arguments)
    if unknown := set(options.part) - set(PARTS):
        parser.error(f"{sorted(unknown)}: expected some of {', '.join(PARTS)}")
    outdated = stale()
    if options.check:
        for name, outputs in outdated.items():
            print(f"{name}: python {PARTS[name].command.replace(' && ', ' && python ')}")
            print("".join(f"    {output}\n" for output in outputs), end="")
        return len(outdated)
    for name in options.part or outdated:
        for arguments in PARTS[name].command.split(" && "):
            command = [sys.executable, *shlex.split(arguments)]
            if options.data_home and PARTS[name].downloads:
                command += ["--data-home", options.data_home]
            print(" ".join(command), file=sys.stderr, flush=True)
            subprocess.run(command, cwd=ROOT, check=True)
        record(PARTS[name].outputs())
    return 0


if __name__ == "__main__":
    sys.exit(main())
