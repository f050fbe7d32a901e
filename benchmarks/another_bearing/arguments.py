"""Arguments that all commands of this benchmark have."""

import os

from benchmarks.another_bearing.protocol import BEARINGS
from benchmarks.pages.blocks import page_parser


def parse(arguments, description, folder, rigs=tuple(BEARINGS)):
    """Return the options of a command, whose output folder then exists.

    Parameters
    ----------
    arguments : list of str or None
        The command line.
    description : str
        Of the command.
    folder : str
        Name of the default output folder.
    rigs : sequence of str
        Names of the rigs that may be chosen; all of them by default.
    """
    parser = page_parser(description, folder)
    parser.add_argument("--rig", nargs="+", choices=list(rigs), default=list(rigs))
    parser.add_argument("--data-home", default=os.environ.get("SKARXLAG_DATA"))
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    return options
