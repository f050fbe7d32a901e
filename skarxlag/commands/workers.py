"""Tasks on threads, on processes or on a cluster, by one code path; workers may die.

The three are the standard library's threads, joblib's processes (loky), and `dask.distributed`.
joblib's own `Parallel` is not used on top of them, for two reasons. On Dask it waits for ever for a
task that killed its workers, and where a cluster has a single core it computes in the calling
process.

On a cluster, Dask starts a task again whose worker died. It raises a `KilledWorker` after
``distributed.scheduler.allowed-failures`` deaths. It computes a result again that died with its
worker, but only after its scheduler has tried to reach that worker for
``distributed.comm.timeouts.connect``, 30 s by default. `Client.get_executor` is not used: if such a
result ends in an error after all, its future stays pending.
"""

from __future__ import annotations

import argparse
import asyncio
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic
from typing import Any
from weakref import WeakSet

from joblib import effective_n_jobs
from joblib.externals.loky import get_reusable_executor

from .messages import CommandError

#: Tasks in hand for each one that runs, so that no worker waits for the next.
_AHEAD = 2
#: How often a task is tried alone, and how often one is asked for whose result was lost.
_TRIALS = 2
#: How long nothing may come before the workers are looked after.
_LOOK_SECONDS = 5
#: Set when nobody waits for results any more; a thread cannot be ended from outside.
cancelled: threading.Event = threading.Event()


class WorkerDied:
    """In the place of a result: whatever process worked on the task ended."""


def _trust() -> None:
    """Threads and processes of this machine tell by themselves when they end."""


@dataclass(frozen=True)
class Workers:
    """What runs tasks.

    Parameters
    ----------
    submit : callable
        Starts a task; returns a `concurrent.futures.Future`. If the worker dies, a
        `concurrent.futures.BrokenExecutor` comes of it.
    count : callable
        Tasks that run at a time.
    look : callable
        Called when nothing has come for a while; raises if nothing will.
    """

    submit: Callable[[Any], Future[Any]]
    count: Callable[[], int]
    look: Callable[[], None] = _trust


def run_tasks(
    tasks: Sequence[Callable[[], Any]], workers: Workers | Cluster
) -> Iterator[tuple[int, Any]]:
    """Run tasks and yield what they return as soon as it is there.

    A worker process that dies takes other tasks with it, and nobody can tell which of them was the
    cause. Each of these is tried again when all others are done, alone, up to twice. A result that
    is lost on its way is asked for once more.

    Parameters
    ----------
    tasks : sequence of callables
        They take no argument, can be sent to a process, and raise nothing.
    workers : Workers or Cluster
        What runs them.

    Yields
    ------
    int, object
        Position of a task, and what it returned, or a `WorkerDied`.
    """
    fresh, suspects, on_trial = deque(range(len(tasks))), deque(), None
    deaths, losses, running = Counter(), Counter(), {}
    while fresh or suspects or running:
        while fresh and len(running) < _AHEAD * max(workers.count(), 1):
            place = fresh.popleft()
            running[_started(workers, tasks[place])] = place
        if suspects and not running:
            on_trial = suspects.popleft()
            running[_started(workers, tasks[on_trial])] = on_trial
        done, _ = wait(running, timeout=_LOOK_SECONDS, return_when=FIRST_COMPLETED)
        if not done:
            workers.look()
        # What was finished meanwhile is told in its order.
        for future in sorted(done, key=running.__getitem__):
            place, error = running.pop(future), future.exception()
            if error is None:
                yield place, future.result()
            elif isinstance(error, BrokenExecutor):
                deaths[place] += place == on_trial
                if deaths[place] < _TRIALS:
                    suspects.append(place)
                else:
                    yield place, WorkerDied()
            elif isinstance(error, Exception) and losses[place] + 1 < _TRIALS:
                # Tasks raise nothing: the result was lost with the worker that held it.
                losses[place] += 1
                fresh.append(place)
            else:
                raise error
            on_trial = None


def _started(workers, task):
    try:
        return workers.submit(task)
    except BrokenExecutor as error:
        future = Future()
        future.set_exception(error)
        return future


@contextmanager
def executors(args: argparse.Namespace) -> Iterator[Workers | Cluster]:
    """What runs the tasks of a command.

    Parameters
    ----------
    args : argparse.Namespace
        With ``n_jobs``, ``processes`` and ``dask``.

    Yields
    ------
    Workers or Cluster
        For `run_tasks`.

    Raises
    ------
    CommandError
        If there is no cluster, or nothing to connect to it with.
    """
    if args.dask is not None:
        with connected(args.dask) as cluster:
            yield cluster
        return
    n_workers = effective_n_jobs(args.n_jobs)
    if args.processes:

        def submit(task):
            # A pool that has broken is replaced here.
            return get_reusable_executor(max_workers=n_workers).submit(task)

        try:
            yield Workers(submit, lambda: n_workers)
        except BaseException:
            get_reusable_executor(max_workers=n_workers).shutdown(kill_workers=True)
            raise
        return
    cancelled.clear()
    executor = ThreadPoolExecutor(n_workers)
    try:
        yield Workers(executor.submit, lambda: n_workers)
    finally:
        cancelled.set()
        executor.shutdown(cancel_futures=True)


_CONNECT_SECONDS = 10
_WORKER_SECONDS = 30
#: How long nobody may work while results are expected. Longer than the 30 s above.
_IDLE_SECONDS = 60


class Cluster:
    """Workers of a scheduler, with the methods that `runner.Workers` names.

    Parameters
    ----------
    client : distributed.Client
        Connected.
    address : str
        What messages call it.
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client, self._address = client, address
        self._asked: WeakSet[Any] = WeakSet()
        self._idle_since: float | None = None

    def submit(self, task: Any) -> Future[Any]:
        """Start a task. A `BrokenExecutor` comes of it if its workers died."""
        with self._as_command_error():
            future = self._client.submit(task, pure=False)
        self._asked.add(future)
        return asyncio.run_coroutine_threadsafe(_result(future), self._client.loop.asyncio_loop)

    def count(self) -> int:
        """Tasks that the cluster runs at a time, which changes as workers come and go."""
        with self._as_command_error():
            return sum(self._client.nthreads().values())

    def look(self) -> None:
        """When nothing has come for a while: see to it that something still can.

        Raises
        ------
        CommandError
            If the scheduler is gone, or there has been no worker for a minute.
        """
        with self._as_command_error():
            work = self._client.processing()
        if any(work.values()):
            self._idle_since = None
        elif self._idle_since is None:
            self._idle_since = monotonic()
        elif monotonic() - self._idle_since > _IDLE_SECONDS:
            self._idle_since = None
            if not work:
                raise CommandError(
                    f"--dask {self._address}: no workers are left; their logs say why"
                )
            # Nobody works and yet we wait. A cancelled task ends with an error and is asked for
            # once more.
            self._client.cancel(list(self._asked))

    @contextmanager
    def _as_command_error(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            if self._client.status == "running" and not isinstance(error, OSError):
                raise
            message = f"--dask {self._address}: the scheduler was lost ({error})"
            raise CommandError(message) from error


async def _result(future: Any) -> Any:
    from distributed import KilledWorker

    try:
        return await future
    except KilledWorker as error:
        raise BrokenExecutor(str(error)) from error


@contextmanager
def connected(address: str) -> Iterator[Cluster]:
    """The cluster of a scheduler that answers.

    Parameters
    ----------
    address : str
        Such as ``tcp://host:8786``.

    Yields
    ------
    Cluster
        With at least one worker.

    Raises
    ------
    CommandError
        If there is no cluster, or nothing to connect to it with.
    """
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
            client.wait_for_workers(1, timeout=_WORKER_SECONDS)
        except TimeoutError as error:
            raise CommandError(f"--dask {address}: the cluster has no workers") from error
        yield Cluster(client, address)
