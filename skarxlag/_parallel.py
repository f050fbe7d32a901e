"""Work on windows in batches, on several threads or one."""

import functools
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ContextDecorator
from typing import Any

from joblib import effective_n_jobs
from sklearn import config_context, get_config
from sklearn.utils import gen_batches
from threadpoolctl import OpenBLASController, ThreadpoolController

#: Windows in one batch: fixed, so that no sum depends on the number of workers.
BATCH = 64
_worker = threading.local()


@functools.cache
def _libraries():
    return ThreadpoolController()


class _OneThread(ContextDecorator):
    """Linear algebra runs on one thread as long as anybody is inside.

    Sums over several threads are rounded in another order, so results would depend on the number
    of processors.

    The number of threads belongs to the process. Were each caller to set and to restore it, one
    that overlaps with another would restore what the other had set.
    """

    def __init__(self) -> None:
        self._lock, self._n_inside = threading.Lock(), 0

    def __enter__(self) -> None:
        with self._lock:
            if self._n_inside == 0:
                _let_any_thread_set()
                self._limits = _libraries().limit(limits=1, user_api="blas")
            self._n_inside += 1

    def __exit__(self, *exception: Any) -> None:
        with self._lock:
            self._n_inside -= 1
            if self._n_inside == 0:
                _let_any_thread_set()
                self._limits.restore_original_limits()
                _let_any_thread_set()


def _let_any_thread_set():
    """From threadpoolctl 3.8 on only the thread that has set a number may restore it."""
    if hasattr(OpenBLASController, "clear_controlling_thread"):
        OpenBLASController.clear_controlling_thread(force=True)


#: A context, and a decorator of functions.
one_thread = _OneThread()
if hasattr(os, "register_at_fork"):
    # Whoever was inside has stayed in the parent.
    os.register_at_fork(after_in_child=one_thread.__init__)


def _become_worker():
    _worker.is_one = True


def map_batches(
    function: Callable[..., Any], n_windows: int, n_jobs: int | None, batch_size: int = BATCH
) -> list[Any]:
    """Call a function with one slice of the windows after another.

    Linear algebra inside runs on one thread: its matrices are small, and threads that wait for
    each other cost more than they save. Neither do batches that are made inside a batch get threads
    of their own.

    Parameters
    ----------
    function : callable
        Takes a slice.
    n_windows : int
        Number of windows.
    n_jobs : int or None
        Threads, as in scikit-learn.
    batch_size : int, default=64
        Windows in a slice.

    Returns
    -------
    list
        What the function returned, in order.

    Examples
    --------
    >>> map_batches(lambda batch: (batch.start, batch.stop), 100, n_jobs=None)
    [(0, 64), (64, 100)]
    """
    batches = list(gen_batches(n_windows, batch_size))
    n_threads = min(effective_n_jobs(n_jobs), len(batches))
    with one_thread:
        if n_threads < 2 or hasattr(_worker, "is_one"):
            return [function(batch) for batch in batches]
        # scikit-learn's settings belong to a thread.
        settings = get_config()

        def of_batch(batch):
            with config_context(**settings):
                return function(batch)

        with ThreadPoolExecutor(n_threads, initializer=_become_worker) as threads:
            return list(threads.map(of_batch, batches))
