"""Canaries: cells of a table, recomputed to see whether changed code changed its numbers."""

from functools import cache
from importlib import import_module

#: Largest difference that may come from another processor or library.
TOLERANCE = 1e-3
CELLS = "benchmarks.pages.cells"


def part_canaries(names):
    """Recompute the canaries of these names.

    Parameters
    ----------
    names : iterable of str
        Functions of `benchmarks.pages.cells`.

    Returns
    -------
    dict of str to float
    """
    return {
        f"{name}: {quantity}": round(value, 6)
        for name in names
        for quantity, value in _recomputed(name).items()
    }


@cache
def _recomputed(name):
    # Cells import the benchmarks, whose pages are written by what imports this module.
    return getattr(import_module(CELLS), name)()


def changed(stored, now):
    """Return the canaries that differ; one that is stored or recomputed only is not compared.

    Examples
    --------
    >>> changed({"a": 0.5, "b": 0.5, "c": 0.5}, {"a": 0.50001, "b": 0.6})
    ['b']
    """
    common = stored.keys() & now.keys()
    return sorted(name for name in common if abs(stored[name] - now[name]) > TOLERANCE)
