"""Choice of one of several commands of a package by its first argument."""

import argparse
from importlib import import_module


def run_command(package, modules, arguments=None):
    """Call ``main`` of the module that the first argument names with the other arguments.

    Parameters
    ----------
    package : str
        The module after ``python -m``.
    modules : dict of str to str
        Module of every command, imported when it is called.
    arguments : list of str or None, default=None
        The command line.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {package}")
    parser.add_argument("command", choices=modules)
    parser.add_argument(
        "options", nargs=argparse.REMAINDER, help="-h for those of a command"
    )
    chosen = parser.parse_args(arguments)
    import_module(modules[chosen.command]).main(chosen.options)
