"""Work on windows in batches, on several threads or one."""

import functools
import threading
from concurrent.futures import ThreadPoolExecutor

from joblib import effective_n_jobs
from sklearn import config_context, get_config
from sklearn.utils import gen_batches
from threadpoolctl import ThreadpoolController

#: Windows in one batch: fixed, so that no sum depends on the number of workers.
BATCH = 64
_worker = threading.local()


@functools.cache
def _libraries():
    return ThreadpoolController()


def _become_worker():
    _worker.is_one = True


def map_batches(function, n_windows, n_jobs, batch_size=BATCH):
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
    with _libraries().limit(limits=1, user_api="blas"):
        if n_threads < 2 or hasattr(_worker, "is_one"):
            return [function(batch) for batch in batches]
        # scikit-learn's settings belong to a thread.
        settings = get_config()

        def of_batch(batch):
            with config_context(**settings):
                return function(batch)

        with ThreadPoolExecutor(n_threads, initializer=_become_worker) as threads:
            return list(threads.map(of_batch, batches))
