import asyncio
import io
import multiprocessing
import os
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext, suppress
from importlib import import_module
from types import SimpleNamespace

import dask
import distributed
import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_alpio, save_diagnoser
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.journal import Journal
from skarxlag.plant.commands.messages import CommandError, Reporter
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.commands.workers import Workers, executors, run_tasks
from skarxlag.plant.readers.listing import list_files

from .deadly_tasks import KILL, Deadly, DiesWhileSending, Harmless

WINDOW, N_RECORDINGS = 200, 20


def name_of(task):
    """Name of the recording that a task diagnoses."""
    return task.args[0].name


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """A model, many short recordings, and their table, which names one that does not exist."""
    folder = tmp_path_factory.mktemp("fleet")
    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, WINDOW))
    X[20:] = lfilter([1.0], [1.0, -0.9], X[20:])
    diagnoser = make_alpio(healthy="good").fit(X, np.repeat(["good", "worn"], 20))
    save_diagnoser(diagnoser, folder / "m.skops")
    lines = ["path,sampling_rate"]
    for number in range(N_RECORDINGS):
        noise = rng.normal(size=3 * WINDOW)
        np.save(
            folder / f"{number}.npy", lfilter([1.0], [1.0, -0.1 * (number % 10)], noise)
        )
        lines.append(f"{number}.npy,5e3")
    (folder / "table.csv").write_text("\n".join([*lines, "lost.npy,5e3"]))
    return folder


@pytest.fixture(scope="module")
def cluster():
    # With no failure allowed a task is given up with the first worker that dies, as are
    # those that waited beside it. The times are how long Dask tries to fetch a result
    # from a dead worker, and when a local cluster, unlike others, closes a nanny whose
    # worker has not come back.
    options = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.comm.timeouts.connect": "5s",
        "distributed.deploy.lost-worker-timeout": "5m",
    }
    if "forkserver" in multiprocessing.get_all_start_methods():
        # A worker that is forked from a process with these modules starts in no time.
        multiprocessing.set_forkserver_preload(
            [
                "distributed.worker",
                "skarxlag.plant.commands.diagnosis",
                "skarxlag.core.pipelines",
            ]
        )
        import_module("multiprocessing.forkserver").ensure_running()
        options["distributed.worker.multiprocessing-method"] = "forkserver"
    with dask.config.set(options):
        cluster = distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address="localhost:0",
        )
        yield cluster
        # A cluster that is closed while a worker starts may wait for it for ever.
        with suppress(TimeoutError), distributed.Client(cluster) as client:
            client.wait_for_workers(2, timeout=60)
        with suppress(TimeoutError):
            cluster.close(timeout=30)


@pytest.fixture
def diagnose(run, fleet, tmp_path):
    """Diagnose the fleet; the contents of the two files of results."""

    def diagnose_fleet(*options, name="out.csv", n_failed=1):
        output = tmp_path / name
        table = fleet / "table.csv"
        code, out, err = run(
            "diagnose", fleet / "m.skops", "--table", table, "-o", output, *options
        )
        assert code == 1
        assert f"{n_failed} of 21 recordings failed" in err
        assert "lost.npy" in err
        assert not list(tmp_path.glob("*-journal"))
        windows = output.with_name(f"{output.stem}_windows.csv")
        return output.read_bytes(), windows.read_bytes(), out.replace(output.stem, "")

    return diagnose_fleet


@pytest.fixture
def in_order(diagnose):
    return diagnose("--n-jobs", "1", name="order.csv")


@pytest.mark.slow
def test_threads_and_processes_change_nothing(diagnose, in_order):
    assert diagnose("--n-jobs", "2") == in_order
    assert diagnose("--n-jobs", "2", "--processes") == in_order


@pytest.mark.slow
def test_a_recording_that_kills_its_workers_costs_itself_alone(
    diagnose, in_order, cluster, fleet, tmp_path, monkeypatch
):
    killer, seen = "7.npy", []
    victim = next(iter(cluster.workers.values())).pid

    def run_with_killer(tasks, workers):
        return run_tasks(
            [Deadly() if name_of(each) == killer else each for each in tasks], workers
        )

    def step_and_kill(progress, line):
        seen.append(line)
        if len(seen) == 4:
            # Without any fault of a recording, and perhaps for the second time.
            with suppress(ProcessLookupError):
                os.kill(victim, KILL)

    monkeypatch.setattr("skarxlag.plant.commands.diagnose.run_tasks", run_with_killer)
    monkeypatch.setattr(Reporter, "step", step_and_kill)
    diagnose("--dask", cluster.scheduler_address, n_failed=2)
    assert len(seen) == N_RECORDINGS + 1
    assert victim not in [worker.pid for worker in cluster.workers.values()]
    for name in ("{}.csv", "{}_windows.csv"):
        expected, found = (
            pd.read_csv(tmp_path / name.format(run)) for run in ("order", "out")
        )
        is_killer = found["recording"] == killer
        pd.testing.assert_frame_equal(
            found[~is_killer].reset_index(drop=True),
            expected[expected["recording"] != killer].reset_index(drop=True),
            check_exact=True,
        )
        if "error" in found:
            (error,) = found.loc[is_killer, "error"]
            assert error == "every process that read it died"


def test_an_address_where_no_scheduler_answers_is_named(run, fleet, monkeypatch):
    monkeypatch.setattr("skarxlag.plant.commands.workers._CONNECT_SECONDS", 0.3)
    arguments = ("diagnose", fleet / "m.skops", fleet / "0.npy")
    arguments += ("--dask", "tcp://127.0.0.1:1")
    code, out, err = run(*arguments)
    assert code == 1 and not out
    assert "--dask tcp://127.0.0.1:1: no scheduler that has workers answers" in err


@pytest.mark.slow
def test_a_death_costs_a_retry_and_a_second_one_that_task_alone(tmp_path):
    tasks = [Harmless(0), Deadly(tmp_path / "flag"), Harmless(2), Deadly()]
    tasks += [Harmless(place) for place in range(4, 9)]
    # Threads do not send a result, and Dask fetches it without end: then the run ends.
    tasks.append(Harmless(DiesWhileSending(os.getpid())))
    with executors(2, processes=True) as workers:
        results = dict(run_tasks(tasks, workers))
    for place in (3, 9):
        assert str(results.pop(place)) == "every process that read it died"
    assert results.pop(1) == "survived"
    assert results == {place: place for place in (0, 2, 4, 5, 6, 7, 8)}


def test_a_result_that_is_lost_is_asked_for_once_more():
    class Losing(ThreadPoolExecutor):
        asked = 0

        def submit(self, task):
            Losing.asked += 1
            if Losing.asked <= n_lost:
                future = Future()
                future.set_exception(TypeError("cannot unpack non-iterable int object"))
                return future
            return super().submit(task)

    with Losing(1) as executor:
        n_lost = 1
        assert dict(run_tasks([Harmless(5)], Workers(executor.submit, lambda: 1))) == {
            0: 5
        }
        Losing.asked, n_lost = 0, 3
        ((_, failed),) = run_tasks([Harmless(5)], Workers(executor.submit, lambda: 1))
        assert str(failed) == "TypeError: cannot unpack non-iterable int object"


class SilentClient:
    """Client of a cluster that returns no result."""

    status, work = "running", {}

    def __init__(self, address, timeout):
        self.loop = SimpleNamespace(asyncio_loop=asyncio.new_event_loop())

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.loop.asyncio_loop.close()

    def wait_for_workers(self, n_workers, timeout):
        pass

    def nthreads(self):
        return {"a": 2}

    def processing(self):
        if self.work is None:
            raise distributed.comm.CommClosedError("connection refused")
        return self.work


@pytest.mark.parametrize(
    ("work", "message"),
    [
        ({"a": ("key",)}, None),
        ({"a": ()}, "tcp://host:1: no worker is working; their logs say why"),
        ({}, "no worker is working"),
        (None, "tcp://host:1: the scheduler was lost .connection refused"),
    ],
)
def test_a_cluster_on_which_nothing_happens_is_not_waited_for(
    monkeypatch, work, message
):
    monkeypatch.setattr(SilentClient, "work", work)
    monkeypatch.setattr("distributed.Client", SilentClient)
    expected = (
        nullcontext() if message is None else pytest.raises(CommandError, match=message)
    )
    with expected, executors(dask="tcp://host:1") as workers:
        assert workers.count() == 2
        workers.check()


def test_the_end_of_a_run_cancels_no_later_diagnosis(fleet):
    with executors(1) as workers:
        assert dict(run_tasks([Harmless(5)], workers)) == {0: 5}
    known = list_files(fleet / "0.npy", sampling_rate=5e3)[0]
    assert diagnose_file(known, SavedModel(fleet / "m.skops").load).verdict


@pytest.mark.slow
def test_an_interrupted_run_goes_on_where_it_stopped(
    run, fleet, tmp_path, monkeypatch, diagnose
):
    whole = diagnose(name="order.csv")
    output = tmp_path / "out.csv"
    arguments = ("diagnose", fleet / "m.skops", "--table", fleet / "table.csv")
    arguments += ("-o", output)
    add, added = Journal.add, []

    def add_and_interrupt(journal, recording, diagnosis):
        add(journal, recording, diagnosis)
        added.append(recording.name)
        if len(added) == 7:
            raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "add", add_and_interrupt)
    code, out, err = run(*arguments, "--n-jobs", "1")
    assert code == 130 and not out and not output.exists()
    partial = tmp_path / "out.csv.skarxlag-journal"
    assert (
        f"{partial}: The results so far are saved. Run the same command again to continue."
        in err
        and "interrupted" in err
    )
    # A file that has changed since.
    os.utime(fleet / added[0], ns=(1, 1))
    monkeypatch.setattr(Journal, "add", add)
    code, _, err = run(*arguments)
    assert err.count("(from an earlier run)") == 6
    assert not partial.exists()
    rows = [pd.read_csv(io.BytesIO(each)) for each in (whole[0], output.read_bytes())]
    pd.testing.assert_frame_equal(*(each.drop(columns="file_time") for each in rows))
    assert output.with_name("out_windows.csv").read_bytes() == whole[1]
