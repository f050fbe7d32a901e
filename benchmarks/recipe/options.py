"""Command-line options of the commands that work on rigs."""

from benchmarks.cross_speed.rigs import RIGS, find_rig, split_by_crack
from benchmarks.pages.blocks import page_parser


def options(doc, name, arguments):
    """Parsed options of one command that works on rigs.

    Parameters
    ----------
    doc, name
        As in `page_parser`.
    arguments : list of str or None
        The command line.
    """
    parser = page_parser(doc, name)
    parser.add_argument(
        "--rig",
        nargs="+",
        default=list(RIGS),
        help=f"of {list(RIGS)}, or module:function",
    )
    parser.add_argument("--window-length", nargs="+", type=int, default=[1200, 4800])
    parser.add_argument(
        "--resume",
        action="store_true",
        help="keep results that the output folder holds",
    )
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    return parser.parse_args(arguments)


def rigs(options, window_length):
    """Label and windows of every rig that the options name, one for each crack size."""
    for name in options.rig:
        rig = find_rig(name, options.data_home)(window_length)
        yield from split_by_crack(name, rig).items()
