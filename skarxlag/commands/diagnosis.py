"""Diagnoses of recordings on threads, on processes or on a cluster, which survive dead workers.

A worker process that dies takes all tasks with it that it has in hand, so the cause is
not known. Each of them is tried again, alone, when all others are done.

`joblib.Parallel` and `Client.get_executor` of Dask are not used: both wait without end
for a task that kills its workers, or whose result is lost.
"""

from __future__ import annotations

import argparse
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
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Self

import pandas as pd
from joblib import effective_n_jobs, parallel_config
from joblib.externals.loky import get_reusable_executor

from ..recordings.listing import ListedRecording
from ..verdicts.names import no_verdict
from .messages import CommandError, Progress, require

#: Entries of the verdict on a recording that the commands need.
_ENTRIES = {"verdict", "probability", "alarm", "windows"}
#: Tasks in hand for each worker, so that no worker waits for the next; and trials of a
#: task alone.
_AHEAD, _TRIALS = 2, 2
#: Seconds without any result after which the workers are checked. Dask recomputes a
#: result that died with its worker, but only after 30 s
#: (distributed.comm.timeouts.connect).
_LOOK_SECONDS = 60
_CONNECT_SECONDS, _WORKER_SECONDS = 10, 30
#: Set while a run ends, because a thread cannot be stopped from outside.
cancelled: threading.Event = threading.Event()


@dataclass(frozen=True)
class Diagnosis:
    """Result of one recording.

    Parameters
    ----------
    verdict : dict
        As `skarxlag.verdicts.judge.Judge.recording` returns it. If the recording
        failed, the verdict is "no verdict: ..." and the other entries are missing.
    windows : DataFrame or None
        One row for each window; None if the recording failed.
    sampling_rate : float or None
        In Hz; None if it is not known.
    remarks : list of str
        Sentences for the reader of the verdict.
    error : str or None
        Reason of a failure.
    file : tuple of int or None
        Size and time of modification of the file that was read.
    """

    verdict: dict[str, Any]
    windows: pd.DataFrame | None
    sampling_rate: float | None = None
    remarks: list[str] = field(default_factory=list)
    error: str | None = None
    file: tuple[int, ...] | None = None

    @classmethod
    def failed(cls, recording: ListedRecording, reason: object) -> Self:
        """Return the result of a recording that could not be diagnosed, without its name."""
        reason = (
            str(reason)
            .removeprefix(f"{recording.path}: ")
            .removeprefix(f"{recording.name}: ")
        )
        return cls(
            {"verdict": no_verdict(reason)}, None, error=" ".join(reason.split())
        )

    @property
    def is_whole(self) -> bool:
        """Return whether it holds an error, or a verdict and its windows."""
        if self.error is not None:
            return isinstance(self.error, str)
        is_table = isinstance(self.windows, pd.DataFrame) and not self.windows.empty
        return (
            is_table
            and isinstance(self.verdict, dict)
            and self.verdict.keys() >= _ENTRIES
        )

    def details(self) -> str:
        """Return details for --verbose: windows, alarm, and verdicts of several outputs."""
        shown = [
            name
            for name in self.verdict
            if name.startswith(("alarm", "windows", "verdict "))
        ]
        return ", ".join(f"{name} {self.verdict[name]}" for name in shown)


def diagnose_file(
    recording: Any, load: Any, resample: bool = False, n_threads=1
) -> Diagnosis:
    """Diagnose a recording with the model that `load` returns, in a worker.

    Errors are stored in the result, not raised.
    """
    try:
        before = file_state(recording)
        with parallel_config("threading", n_jobs=n_threads):
            found = load().diagnose(recording, resample)
        if file_state(recording) != before:
            return Diagnosis.failed(recording, "the file changed while it was read")
        return replace(found, file=before)
    except (OSError, ValueError, ImportError, MemoryError, CommandError) as error:
        return Diagnosis.failed(recording, error)


def file_state(recording: ListedRecording) -> tuple[int, ...]:
    """Return the size of a recording's file, and when its content and its entry changed."""
    status = recording.path.stat()
    # Programs that copy a file may set back the time of its content, but not that of
    # its entry.
    return status.st_size, status.st_mtime_ns, status.st_ctime_ns


def diagnose_all(
    args: argparse.Namespace, recordings: list[ListedRecording], model, journal
):
    """Return diagnoses of recordings. Errors in one recording do not affect the others.

    The model is a `RecordingModel`. The journal is a `Journal` or None.
    """
    diagnoses, waiting = [None] * len(recordings), []
    progress = Progress(len(recordings), args)

    def finish(place, diagnosis, note=""):
        diagnoses[place] = diagnosis
        verdict = diagnosis.error or diagnosis.verdict["verdict"]
        progress.step(f"{recordings[place].name}: {verdict}{note}", diagnosis.details())

    # Missing files are reported before the first file is read.
    for place, recording in enumerate(recordings):
        if not recording.path.is_file():
            finish(place, Diagnosis.failed(recording, "no such file"))
        elif journal is not None and (known := journal.result(recording)) is not None:
            finish(place, known, " (from an earlier run)")
        else:
            waiting.append(place)
    with executors(args) as workers:
        # Each of a few recordings gets several threads.
        n_threads = max(workers.count() // max(len(waiting), 1), 1)
        n_threads = 1 if args.dask or args.processes else n_threads
        # A worker of a cluster may run in another folder.
        own = [replace(each, path=each.path.absolute()) for each in recordings]
        further = model.load, args.resample, n_threads
        tasks = [partial(diagnose_file, own[place], *further) for place in waiting]
        for number, outcome in run_tasks(tasks, workers):
            place = waiting[number]
            if not (isinstance(outcome, Diagnosis) and outcome.is_whole):
                lie = f"a worker returned a {type(outcome).__name__} that is no result"
                reason = outcome if isinstance(outcome, Exception) else lie
                outcome = Diagnosis.failed(recordings[place], reason)
            if journal is not None:
                journal.add(recordings[place], outcome)
            finish(place, outcome)
    return diagnoses


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

    The result of a task that failed each time, because its worker died or returned no
    result, is an Exception with the reason.
    """
    failed = []
    for task, future in _finished(enumerate(tasks), workers):
        if future.exception() is None:
            yield task[0], future.result()
        else:
            failed.append(task)
    for task in failed:
        for _ in range(_TRIALS):
            ((_, future),) = _finished([task], workers)
            if (error := future.exception()) is None:
                break
        died, reason = (
            isinstance(error, BrokenExecutor),
            f"{type(error).__name__}: {error}",
        )
        failure = RuntimeError("every process that read it died" if died else reason)
        yield task[0], failure if error else future.result()


def _finished(tasks, workers):
    """Yield tasks with their positions, and futures. A few tasks are in hand at a time."""
    waiting, running = deque(tasks), {}
    while waiting or running:
        while waiting and len(running) < _AHEAD * max(workers.count(), 1):
            task = waiting.popleft()
            running[workers.submit(task[1])] = task
        done, _ = wait(running, timeout=_LOOK_SECONDS, return_when=FIRST_COMPLETED)
        if not done:
            workers.check()
        for future in sorted(done, key=lambda each: running[each][0]):
            yield running.pop(future), future


def executors(args: argparse.Namespace) -> AbstractContextManager[Workers]:
    """Return a context that starts the workers that the arguments ask for."""
    if args.dask is not None:
        return _cluster(args.dask)
    # A worker of multiprocessing.Pool cannot start processes.
    can_start = not multiprocessing.current_process().daemon
    kind = _processes if args.processes and can_start else _threads
    return kind(effective_n_jobs(args.n_jobs))


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
    require("distributed", "--dask", "distributed")
    from distributed import Client, KilledWorker
    from distributed.comm import CommClosedError

    try:
        client = Client(address, timeout=_CONNECT_SECONDS)
        client.wait_for_workers(1, timeout=_WORKER_SECONDS)
    except (OSError, TimeoutError, ValueError) as error:
        missing = "no scheduler that has workers answers there"
        raise CommandError(f"--dask {address}: {missing} ({error})") from error

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
