"""Tasks on threads, each with a process of its own if that is asked for.

A process that dies costs the task of its thread alone, because it has no other in hand.
"""

import operator
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor, as_completed
from typing import Any

from joblib.externals.loky import ProcessPoolExecutor

#: Trials of a task whose process dies.
_TRIALS = 2
#: Set while a run ends, because a thread cannot be stopped from outside.
cancelled: threading.Event = threading.Event()


def run_tasks(
    tasks: Sequence[Callable[[], Any]], n_workers: int, processes: bool = False
) -> Iterator[tuple[int, Any]]:
    """Yield the position and the result of each task, as they are finished.

    The result of a task that failed is the Exception with the reason.

    Parameters
    ----------
    tasks : sequence of callable
        They can be sent to another process.
    n_workers : int
        Number of threads.
    processes : bool, default=False
        Whether each thread has a process that runs its tasks.
    """
    pool = _Processes()
    threads = ThreadPoolExecutor(n_workers)
    run = pool.run if processes else operator.call
    try:
        places = {threads.submit(run, task): place for place, task in enumerate(tasks)}
        for future in as_completed(places):
            yield places[future], future.exception() or future.result()
    finally:
        cancelled.set()
        pool.end()
        threads.shutdown(cancel_futures=True)
        cancelled.clear()


class _Processes:
    """One process for each thread that runs a task."""

    def __init__(self):
        self._of_thread = {}

    def run(self, task):
        """Run a task in the process of this thread. One that dies is replaced."""
        thread = threading.get_ident()
        for _ in range(_TRIALS):
            if thread not in self._of_thread:
                self._of_thread[thread] = ProcessPoolExecutor(1)
            try:
                return self._of_thread[thread].submit(task).result()
            except BrokenExecutor:
                del self._of_thread[thread]
        raise RuntimeError("every process that read it died")

    def end(self):
        """Kill the processes, also those that are at work."""
        for executor in [*self._of_thread.values()]:
            executor.shutdown(kill_workers=True)
