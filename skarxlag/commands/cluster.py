"""A cluster of `dask.distributed` that runs tasks, and on which no result can be lost unnoticed.

Dask does the most of it. It starts a task again whose worker died, and gives it up with a
`KilledWorker` after ``distributed.scheduler.allowed-failures`` deaths. A result that died with its
worker it computes again, but only after its scheduler has tried to reach that worker for
``distributed.comm.timeouts.connect``, 30 s by default. `Client.get_executor` is not used: if such a
result ends in an error after all, its future stays pending for ever.
"""

import asyncio
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Future
from contextlib import contextmanager
from time import monotonic
from typing import Any
from weakref import WeakSet

from .errors import CommandError

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
