"""Tasks on threads, on processes or on a cluster, which survive dead workers.

A worker process that dies takes all tasks with it that it has in hand, so the cause is
not known. Each of them is tried again, alone, when all others are done.

`joblib.Parallel` and `Client.get_executor` of Dask are not used: both wait without end
for a task that kills its workers, or whose result is lost. Processes are those of loky.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from joblib import effective_n_jobs
from joblib.externals.loky import get_reusable_executor

from .messages import CommandError, require

#: Tasks in hand for each worker, so that no worker waits for the next.
_AHEAD = 2
#: Trials of a task alone.
_TRIALS = 2
#: Seconds without any result after which the workers are checked. Dask recomputes a
#: result that died with its worker, but only after 30 s
#: (distributed.comm.timeouts.connect).
_LOOK_SECONDS = 60
_CONNECT_SECONDS = 10
_WORKER_SECONDS = 30
#: Set while a run ends, because a thread cannot be stopped from outside.
cancelled: threading.Event = threading.Event()


@dataclass(frozen=True)
class Workers:
    """Workers of one kind.

    Parameters
    ----------
    submit : callable
        Starts a task and returns its future, which raises BrokenExecutor if the worker
        dies.
    count : callable
        Returns the number of tasks that run at a time.
    check : callable
        Raises an error if no further result can come.
    """

    submit: Callable[[Any], Future[Any]]
    count: Callable[[], int]
    check: Callable[[], object] = lambda: None


def run_tasks(
    tasks: Sequence[Callable[[], Any]], workers: Workers
) -> Iterator[tuple[int, Any]]:
    """Yield the position and the result of each task, as they are finished.

    The result of a task that failed each time is an Exception with the reason.
    """
    failed = []
    for task, future in _finished(enumerate(tasks), workers):
        if future.exception() is None:
            yield task[0], future.result()
        else:
            failed.append(task)
    for task in failed:
        yield task[0], _tried_again(task, workers)


def _tried_again(task, workers):
    """Return the result of a task, or an Exception with the reason if it fails again."""
    for _ in range(_TRIALS):
        ((_, future),) = _finished([task], workers)
        error = future.exception()
        if error is None:
            return future.result()
    if isinstance(error, BrokenExecutor):
        return RuntimeError("every process that read it died")
    return RuntimeError(f"{type(error).__name__}: {error}")


def _finished(tasks, workers):
    """Yield tasks with their positions, and futures. A few tasks are in hand at a time."""
    waiting = deque(tasks)
    running = {}
    while waiting or running:
        while waiting and len(running) < _AHEAD * max(workers.count(), 1):
            task = waiting.popleft()
            running[workers.submit(task[1])] = task
        done, _ = wait(running, timeout=_LOOK_SECONDS, return_when=FIRST_COMPLETED)
        if not done:
            workers.check()
        for future in sorted(done, key=lambda future: running[future][0]):
            yield running.pop(future), future


def executors(
    n_jobs: int | None = None, *, processes: bool = False, dask: str | None = None
) -> AbstractContextManager[Workers]:
    """Return a context that starts workers.

    Parameters
    ----------
    n_jobs : int or None, default=None
        Number of workers; -1: one for each core.
    processes : bool, default=False
        Whether they are processes. False: threads.
    dask : str or None, default=None
        Address of a scheduler of a cluster, whose workers are taken instead.
    """
    if dask is not None:
        return _cluster(dask)
    # A worker of multiprocessing.Pool cannot start processes.
    can_start = not multiprocessing.current_process().daemon
    kind = _processes if processes and can_start else _threads
    return kind(effective_n_jobs(n_jobs))


@contextmanager
def _threads(n_workers):
    executor = ThreadPoolExecutor(n_workers)
    try:
        yield Workers(executor.submit, lambda: n_workers)
    finally:
        cancelled.set()
        executor.shutdown(cancel_futures=True)
        cancelled.clear()


@contextmanager
def _processes(n_workers):
    executor = partial(get_reusable_executor, max_workers=n_workers)

    def submit(task):
        with suppress(BrokenExecutor):
            return executor().submit(task)
        # loky replaces a pool that has broken.
        return executor().submit(task)

    try:
        yield Workers(submit, lambda: n_workers)
    except BaseException:
        executor().shutdown(kill_workers=True)
        raise


@contextmanager
def _cluster(address):
    require(("distributed",), "--dask", "distributed")
    from distributed import Client, KilledWorker
    from distributed.comm import CommClosedError

    try:
        client = Client(address, timeout=_CONNECT_SECONDS)
        client.wait_for_workers(1, timeout=_WORKER_SECONDS)
    except (OSError, TimeoutError, ValueError) as error:
        raise CommandError(
            f"--dask {address}: no scheduler that has workers answers there ({error})"
        ) from error

    async def result(future):
        try:
            return await future
        except KilledWorker as error:
            raise BrokenExecutor(str(error)) from error

    def submit(task):
        future = client.submit(task, pure=False)
        return asyncio.run_coroutine_threadsafe(
            result(future), client.loop.asyncio_loop
        )

    def check():
        if not any(client.processing().values()):
            raise CommandError(
                f"--dask {address}: no worker is working; their logs say why"
            )

    with client:
        try:
            yield Workers(submit, lambda: sum(client.nthreads().values()), check)
        except Exception as error:
            if client.status == "running" and not isinstance(error, CommClosedError):
                raise
            raise CommandError(
                f"--dask {address}: the scheduler was lost ({error})"
            ) from error
