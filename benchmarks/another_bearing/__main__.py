"""``python -m benchmarks.another_bearing [COMMAND] ...``."""

import sys

from benchmarks.another_bearing import command, constants, curve, noise

COMMANDS = {
    "constants": constants.main,
    "noise": noise.main,
    "curve": curve.main,
}

if __name__ == "__main__":
    arguments = sys.argv[1:]
    main = COMMANDS.get(arguments[0]) if arguments else None
    if main is None:
        command.main(arguments)
    else:
        main(arguments[1:])
