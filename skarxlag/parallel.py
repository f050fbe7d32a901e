"""Work on windows in batches, on several threads or one."""

import functools

from sklearn.utils import gen_batches
from sklearn.utils.parallel import Parallel, delayed
from threadpoolctl import ThreadpoolController

#: Windows in one batch: fixed, so that no sum depends on the number of workers.
_BATCH = 64


@functools.cache
def _libraries():
    return ThreadpoolController()


def map_batches(function, n_windows, n_jobs):
    """Call a function with one slice of the windows after another.

    Linear algebra inside runs on one thread: its matrices are small, and threads that wait for
    each other cost more than they save.

    Parameters
    ----------
    function : callable
        Takes a slice.
    n_windows : int
        Number of windows.
    n_jobs : int or None
        Threads, as in scikit-learn.

    Returns
    -------
    list
        What the function returned, in order.

    Examples
    --------
    >>> map_batches(lambda batch: (batch.start, batch.stop), 100, n_jobs=None)
    [(0, 64), (64, 100)]
    """
    with _libraries().limit(limits=1, user_api="blas"):
        return Parallel(n_jobs=n_jobs, prefer="threads")(
            delayed(function)(batch) for batch in gen_batches(n_windows, _BATCH)
        )
