"""The one way in which this package compiles a loop."""

import functools

import numba


def compiled(function):
    """Compile `function` with numba at its first call, never at import.

    The machine code is cached on disk where numba finds a folder that it may write to, and kept in
    memory for the life of the process where it does not.

    Parameters
    ----------
    function : callable
        A loop over arrays and plain numbers in numba's subset of Python.

    Returns
    -------
    callable
        `function`, compiled; the original stays reachable as ``__wrapped__``.
    """
    options = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:
        dispatcher = numba.njit(**options)(function)
    functools.update_wrapper(dispatcher, function)
    return dispatcher


def inlined(function):
    """Make `function` part of the compiled loops that call it.

    That takes less time to compile than a function of its own.

    Parameters
    ----------
    function : callable
        A helper in numba's subset of Python.

    Returns
    -------
    callable
        `function`, to be called from compiled loops.
    """
    return functools.update_wrapper(numba.njit(inline="always")(function), function)
