"""Compilation of loops with numba. All kernels of this package are compiled with it."""

import contextlib
import functools
from collections.abc import Callable
from typing import Any


class _LenientCache:
    """A cache on disk that is ignored if it cannot be read or written.

    The cache only makes the next run faster. A full disk, a truncated file or a folder that became
    read-only must therefore not abort a computation.
    """

    def __init__(self, cache: Any) -> None:
        self._cache = cache

    def __getattr__(self, name: Any) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        # What unpickling of a damaged file raises is as varied as the damage.
        with contextlib.suppress(Exception):
            return self._cache.load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            self._cache.save_overload(sig, data)
        except Exception:
            # A damaged index would be read again before every attempt to add to it.
            with contextlib.suppress(Exception):
                self._cache.flush()
                self._cache.save_overload(sig, data)


class _Kernel:
    """Function that numba compiles at its first call."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        functools.update_wrapper(self, function)
        self._options = options

    def __call__(self, *args: Any) -> Any:
        return self.dispatcher(*args)

    @functools.cached_property
    def dispatcher(self) -> Any:
        """Return numba's dispatcher of the function, or the function under NUMBA_DISABLE_JIT."""
        # Loading a model computes nothing, so it should not wait for numba.
        import numba

        function: Any = self.__wrapped__
        known = function.__globals__
        for name in function.__code__.co_names:
            # numba compiles calls of its dispatchers only.
            if isinstance(known.get(name), _Kernel):
                known[name] = known[name].dispatcher
        try:
            dispatcher = numba.njit(**self._options)(function)
        except (RuntimeError, OSError):
            dispatcher = numba.njit(**self._options | {"cache": False})(function)
        with contextlib.suppress(AttributeError):
            dispatcher._cache = _LenientCache(dispatcher._cache)
        return dispatcher


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` with numba at its first call, which also imports numba.

    The machine code is cached on disk if numba finds a folder that it may write to. If there is no
    such folder, the disk is full or the cache is damaged, the machine code is kept in memory until
    the process ends.

    Parameters
    ----------
    function : callable
        A loop over arrays and plain numbers in numba's subset of Python.

    Returns
    -------
    callable
        The compiled function. Its attribute ``__wrapped__`` is the original function.
    """
    options = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}
    return _Kernel(function, cache=True, **options)


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
