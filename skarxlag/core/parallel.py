"""Work on windows in batches, on several threads or one."""

import contextlib
import functools
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from numbers import Integral
from typing import Any

from joblib import effective_n_jobs, parallel_config
from sklearn import config_context, get_config
from sklearn.utils import check_scalar
from threadpoolctl import OpenBLASController, ThreadpoolController

from .validation import of_one_model

#: Windows in one batch: fixed, so that no sum depends on the number of workers.
BATCH = 64
_libraries = functools.cache(lambda: ThreadpoolController().select(user_api="blas"))


class _OneThread(contextlib.ContextDecorator):
    """Context in which linear algebra runs on one thread.

    Sums over several threads are rounded in another order, so results would depend on
    the number of processors.

    The number of threads belongs to the process. If each caller set and restored it, a
    caller that overlaps with another would restore the number that the other had set.
    So the first one that enters sets it, and the last one that leaves restores it.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._n_inside = 0

    def __enter__(self) -> None:
        with self._lock:
            if self._n_inside == 0:
                n_threads = {
                    library: library.get_num_threads()
                    for library in _libraries().lib_controllers
                }
                # Setting a number takes longer than reading it.
                self._limited = [
                    (library, n) for library, n in n_threads.items() if n != 1
                ]
                for library, _ in self._limited:
                    _let_any_thread_set()
                    library.set_num_threads(1)
            self._n_inside += 1

    def __exit__(self, *exception: Any) -> None:
        with self._lock:
            self._n_inside -= 1
            if self._n_inside == 0 and self._limited:
                _let_any_thread_set()
                for library, n in self._limited:
                    library.set_num_threads(n)
                _let_any_thread_set()


def _let_any_thread_set():
    """Let this thread restore a number that another has set."""
    # threadpoolctl has the method, and needs it, from 3.8 on.
    with contextlib.suppress(AttributeError):
        OpenBLASController.clear_controlling_thread(force=True)


#: A context, and a decorator of functions.
one_thread = _OneThread()
if os.name == "posix":
    # The threads that were inside stay in the parent.
    os.register_at_fork(after_in_child=one_thread.__init__)


def map_batches(
    function: Callable[..., Any],
    n_windows: int,
    n_jobs: int | None,
    batch_size: int = BATCH,
) -> list[Any]:
    """Call a function with one slice of the windows after another.

    Linear algebra inside runs on one thread: its matrices are small, and threads that
    wait for each other cost more than they save. Batches inside a batch run on the
    thread of that batch.

    Parameters
    ----------
    function : callable
        Takes a slice.
    n_windows : int
        Number of windows.
    n_jobs : int or None
        Threads, as in scikit-learn. It is checked for a single batch, too.
    batch_size : int, default=64
        Windows in a slice.

    Returns
    -------
    list
        Results of the function, in order.

    Examples
    --------
    >>> map_batches(lambda batch: (batch.start, batch.stop), 100, n_jobs=None)
    [(0, 64), (64, 100)]
    """
    starts = range(0, n_windows, batch_size)
    batches = [slice(start, min(start + batch_size, n_windows)) for start in starts]
    with one_thread:
        check_scalar(n_jobs, "n_jobs", (type(None), Integral))
        # joblib takes longer to find out what None stands for than one window takes.
        n_threads = (
            1 if n_jobs is None and len(batches) < 2 else effective_n_jobs(n_jobs)
        )
        if min(n_threads, len(batches)) < 2:
            return [function(batch) for batch in batches]
        # scikit-learn's settings belong to a thread.
        settings = get_config()

        def of_batch(batch):
            with config_context(**settings), parallel_config("sequential"):
                return function(batch)

        with ThreadPoolExecutor(n_threads) as threads:
            return list(threads.map(of_batch, batches))


def map_rows(function: Callable[..., Any], X: Any, n_jobs: int | None) -> list[Any]:
    """Call a function with the place and the samples of one row after another.

    Parameters
    ----------
    function : callable
        Takes an integer and an array of shape (n_samples,).
    X : array of shape (n_rows, 1, n_samples)
        Rows, or innovations of one model.
    n_jobs : int or None
        Threads, as in scikit-learn.

    Returns
    -------
    list
        Results of the function, in order.
    """

    def of_batch(batch):
        return [
            function(*row) for row in enumerate(of_one_model(X[batch]), batch.start)
        ]

    parts = map_batches(of_batch, len(X), n_jobs, batch_size=1)
    return [result for part in parts for result in part]
