"""Compilation of loops with numba. All kernels of this package are compiled with it."""

import contextlib
import functools
import gc
import warnings
from collections.abc import Callable
from typing import Any


class _LenientCache:
    """A cache on disk that is ignored if it cannot be read or written.

    The cache only makes the next run faster. A full disk, a truncated file or a folder
    that became read-only must therefore not abort a computation.
    """

    def __init__(self, cache: Any) -> None:
        self._cache = cache

    def __getattr__(self, name: Any) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        # What unpickling of a damaged file raises is as varied as the damage.
        with contextlib.suppress(Exception):
            return self._cache.load_overload(sig, target_context)
        # A damaged index would be read again before every attempt to add to it.
        with contextlib.suppress(Exception):
            self._cache.flush()

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(Exception):
            self._cache.save_overload(sig, data)


class _Kernel:
    """Function that numba compiles at its first call."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self._options = options

    def __call__(self, *args: Any) -> Any:
        # numba creates a million objects at the first call, and each collection would
        # visit them.
        collects = gc.isenabled()
        gc.disable()
        try:
            return self.dispatcher(*args)
        finally:
            if collects:
                gc.enable()

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Return numba's dispatcher of the function, or the function under NUMBA_DISABLE_JIT."""
        # Loading a model computes nothing, so it should not wait for numba.
        import numba

        if numba.config.DISABLE_JIT:
            warnings.warn(
                "NUMBA_DISABLE_JIT is set, so loops run as plain Python and take some "
                "thousand times as long. Unset it, except to debug a few windows.",
                stacklevel=3,
            )
        function: Any = self.__wrapped__
        names_in_module = function.__globals__
        for name in function.__code__.co_names:
            # numba compiles calls of its dispatchers only.
            if isinstance(names_in_module.get(name), _Kernel):
                names_in_module[name] = names_in_module[name].dispatcher
        dispatcher = numba.njit(**self._options)(function)
        # Without a folder for the cache there is none, and under NUMBA_DISABLE_JIT no
        # dispatcher.
        with contextlib.suppress(RuntimeError, OSError, AttributeError):
            dispatcher.enable_caching()
            dispatcher._cache = _LenientCache(dispatcher._cache)
        return dispatcher


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` with numba at its first call, which also imports numba.

    The machine code is cached on disk if numba finds a folder that it may write to. If
    there is no such folder, the disk is full or the cache is damaged, the machine code
    is kept in memory until the process ends.

    Parameters
    ----------
    function : callable
        A loop over arrays and plain numbers in numba's subset of Python. It allocates
        nothing, has no expressions of whole arrays, and assigns no array to a slice.

    Returns
    -------
    callable
        The compiled function. Its attribute ``__wrapped__`` is the original function.
    """
    options = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
    # A fifth of the time to compile would be spent on counting references to views of
    # arrays, and on a search for expressions of whole arrays.
    return _Kernel(function, _nrt=False, no_rewrites=True, **options)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Inline `function` into the compiled loops that call it.

    Inlining takes less time to compile than a separate function.

    Parameters
    ----------
    function : callable
        A helper in numba's subset of Python.

    Returns
    -------
    callable
        The function, which compiled loops can call.
    """
    return _Kernel(function, inline="always")
