"""Tasks on threads, on processes or on a cluster, by one code path; workers may die.

All three are executors of `concurrent.futures`: the standard library's threads, joblib's
processes (loky), and the client of `dask.distributed`. joblib's own `Parallel` is not used on top
of them, for two reasons. On Dask it waits for ever for a task that killed its workers, and where a
cluster has a single core it computes in the calling process.

A task that kills every worker of a cluster is Dask's to find: it counts the workers that died with
a task, and gives up at ``distributed.scheduler.allowed-failures``. Two things are not in our hands.
A task that waited on the same workers is counted, too. And now and then a result that was lost with
its worker is never made again, so that the run waits. So no test does this on a cluster; processes
of one machine have no such doubt, and there it is tested.
"""

import argparse
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from joblib import effective_n_jobs
from joblib.externals.loky import get_reusable_executor

from .errors import CommandError

#: Tasks that wait beside each one that runs, so that no worker waits for the next.
_AHEAD = 2


_CONNECT_SECONDS = 10
#: Set when nobody waits for results any more; a thread cannot be ended from outside.
cancelled: threading.Event = threading.Event()


class WorkerDied:
    """In the place of a result: whatever process worked on the task ended."""


def run_tasks(
    tasks: Sequence[Any], start_executor: Callable[..., Any], n_workers: int
) -> Iterator[Any]:
    """Run tasks and yield what they return as soon as it is there.

    A worker process that dies takes other tasks with it, and nobody can tell which of them was the
    cause. Each of these is tried again, alone, up to twice. Dask tells which it was, and has tried
    it on several workers. A result that is lost on its way is asked for once more.

    Parameters
    ----------
    tasks : sequence of callables
        They take no argument, can be sent to a process, and raise nothing.
    start_executor : callable
        Returns an executor; called again when a worker has died.
    n_workers : int
        Tasks that run at a time.

    Yields
    ------
    int, object
        Position of a task, and what it returned, or a `WorkerDied`.
    """
    fresh, suspects, running = deque(range(len(tasks))), deque(), {}
    executor, on_trial, tried, lost = start_executor(), None, set(), set()
    while fresh or suspects or running:
        if suspects:
            on_trial = suspects.popleft()
            running[executor.submit(tasks[on_trial])] = on_trial
        while fresh and on_trial is None and len(running) < _AHEAD * n_workers:
            place = fresh.popleft()
            running[executor.submit(tasks[place])] = place
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        is_broken = False
        for future in done:
            error = future.exception()
            if error is None:
                yield running.pop(future), future.result()
            elif type(error).__name__ == "KilledWorker":
                yield running.pop(future), WorkerDied()
            elif isinstance(error, BrokenProcessPool):
                is_broken = True
            elif isinstance(error, Exception) and running[future] not in lost:
                # Tasks raise nothing: Dask has lost a result with the worker that held it.
                lost.add(running[future])
                fresh.append(running.pop(future))
            else:
                raise error
        if is_broken:
            executor = start_executor()
            if on_trial is None:
                # What a broken pool has not finished it will not finish.
                suspects.extend(sorted(running.values()))
            elif on_trial in tried:
                yield on_trial, WorkerDied()
            else:
                tried.add(on_trial)
                suspects.appendleft(on_trial)
            running.clear()
        on_trial = None


@contextmanager
def executors(args: argparse.Namespace) -> Iterator[tuple[Callable[..., Any], int]]:
    """What runs the tasks of a command.

    Parameters
    ----------
    args : argparse.Namespace
        With ``n_jobs``, ``processes`` and ``dask``.

    Yields
    ------
    callable, int
        `start_executor` and `n_workers` of `run_tasks`.

    Raises
    ------
    CommandError
        If there is no cluster, or nothing to connect to it with.
    """
    if args.dask is not None:
        with _connected(args.dask) as client:
            n_workers = sum(client.nthreads().values())
            yield lambda: client.get_executor(pure=False), n_workers
        return
    n_workers = effective_n_jobs(args.n_jobs)
    if args.processes:
        try:
            yield lambda: get_reusable_executor(max_workers=n_workers), n_workers
        except BaseException:
            get_reusable_executor(max_workers=n_workers).shutdown(kill_workers=True)
            raise
        return
    cancelled.clear()
    executor = ThreadPoolExecutor(n_workers)
    try:
        yield lambda: executor, n_workers
    finally:
        cancelled.set()
        executor.shutdown(cancel_futures=True)


@contextmanager
def _connected(address):
    try:
        from distributed import Client
    except ImportError as error:
        raise CommandError(
            "--dask needs distributed: pip install 'skarxlag[distributed]'"
        ) from error
    try:
        client = Client(address, timeout=_CONNECT_SECONDS)
    except (OSError, TimeoutError, ValueError) as error:
        raise CommandError(f"--dask {address}: no scheduler answers there ({error})") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=30)
        except TimeoutError as error:
            raise CommandError(f"--dask {address}: the cluster has no workers") from error
        yield client
