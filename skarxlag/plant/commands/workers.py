"""Tasks on threads, each of which may have a process or a worker of a cluster at work.

A process that dies costs the task of its thread alone, because it has no other in hand.
"""

import operator
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    ThreadPoolExecutor,
    as_completed,
)
from contextlib import suppress
from typing import Any

from joblib import effective_n_jobs
from joblib.externals.loky import ProcessPoolExecutor

from .messages import CommandError, require

#: Trials of a task whose process dies.
_TRIALS = 2
_DEATH = "every process that read it died"
#: Seconds until a scheduler answers, and until it has a worker.
_CONNECT_SECONDS = 10
_WORKER_SECONDS = 30
#: Seconds without a result after which the workers of a cluster are checked. A result
#: that died with its worker is computed again, but only after 30 s
#: (distributed.comm.timeouts.connect).
_LOOK_SECONDS = 60
#: Set while a run ends, because a thread cannot be stopped from outside.
cancelled: threading.Event = threading.Event()


def run_tasks(
    tasks: Sequence[Callable[[], Any]],
    n_jobs: int | None = None,
    *,
    processes: bool = False,
    dask: str | None = None,
) -> Iterator[tuple[int, Any]]:
    """Yield the position and the result of each task, as they are finished.

    The result of a task that failed is the Exception with the reason.

    Parameters
    ----------
    tasks : sequence of callable
        They can be sent to another process.
    n_jobs : int or None, default=None
        Number of threads; -1: one for each core. A cluster determines it.
    processes : bool, default=False
        Whether each thread has a process that runs its tasks.
    dask : str or None, default=None
        Address of a Dask scheduler, whose workers run the tasks instead.

    Raises
    ------
    CommandError
        If no worker of the cluster can be reached any more.
    """
    n_threads = effective_n_jobs(n_jobs)
    pool = _Threads()
    if dask is not None:
        pool = _Cluster(dask)
        n_threads = pool.n_tasks
    elif processes:
        pool = _Processes()
    threads = ThreadPoolExecutor(n_threads)
    try:
        places = {
            threads.submit(pool.run, task): place for place, task in enumerate(tasks)
        }
        for future in as_completed(places):
            error = future.exception()
            if isinstance(error, CommandError):
                raise error
            yield places[future], error or future.result()
    finally:
        cancelled.set()
        pool.end()
        threads.shutdown(cancel_futures=True)
        cancelled.clear()


class _Threads:
    """Threads that run the tasks themselves."""

    run = staticmethod(operator.call)

    def end(self):
        """Do nothing: `cancelled` ends their tasks."""


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
        raise RuntimeError(_DEATH)

    def end(self):
        """Kill the processes, also those that are at work."""
        for executor in [*self._of_thread.values()]:
            executor.shutdown(kill_workers=True)


class _Cluster:
    """Workers of a Dask scheduler."""

    def __init__(self, address):
        require(("distributed",), "--dask", "distributed")
        from distributed import Client

        self._name = f"--dask {address}"
        try:
            self._client = Client(address, timeout=_CONNECT_SECONDS)
            self._client.wait_for_workers(1, timeout=_WORKER_SECONDS)
        except (OSError, TimeoutError, ValueError) as error:
            raise CommandError(
                f"{self._name}: no scheduler that has workers answers there ({error})"
            ) from error

    @property
    def n_tasks(self):
        """Number of tasks in hand: no worker waits for the next."""
        return 2 * sum(self._client.nthreads().values())

    def run(self, task):
        """Run a task on a worker, and again if the workers that read it have died."""
        from distributed import KilledWorker

        for _ in range(_TRIALS):
            with suppress(KilledWorker):
                return self._result(self._client.submit(task, pure=False))
        raise RuntimeError(_DEATH)

    def _result(self, future):
        while True:
            try:
                return future.result(timeout=_LOOK_SECONDS)
            except TimeoutError:
                self._check()
            except CancelledError as error:
                raise self._lost(error) from error

    def _check(self):
        try:
            is_working = any(self._client.processing().values())
        except OSError as error:
            raise self._lost(error) from error
        if not is_working:
            raise CommandError(
                f"{self._name}: no worker is working; their logs say why"
            )

    def _lost(self, error):
        return CommandError(f"{self._name}: the scheduler was lost ({error})")

    def end(self):
        """Give up the tasks in hand."""
        self._client.close()
