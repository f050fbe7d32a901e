"""Many recordings, on threads, and on processes and workers of a cluster that may die."""

import io
import multiprocessing
import os
import threading
import time
from contextlib import suppress
from functools import partial

import dask
import distributed
import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_alpio, save_diagnoser
from skarxlag.plant.commands.journal import Journal
from skarxlag.plant.commands.messages import CommandError
from skarxlag.plant.commands.workers import cancelled, run_tasks

from .deadly_tasks import DiesWhileSending, die

WINDOW, N_RECORDINGS = 200, 20


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


@pytest.fixture(scope="module")
def cluster():
    # With no failure allowed a task is given up with the first worker that dies. The
    # other times are how long Dask tries to fetch a result from a dead worker, and when
    # a local cluster, unlike others, closes a nanny whose worker has not come back.
    options = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.comm.timeouts.connect": "5s",
        "distributed.deploy.lost-worker-timeout": "5m",
    }
    if hasattr(os, "fork"):
        # A worker that is forked from a process with this module starts in no time.
        multiprocessing.set_forkserver_preload(["distributed.worker"])
        options["distributed.worker.multiprocessing-method"] = "forkserver"
    with dask.config.set(options):
        cluster = distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address="localhost:0",
        )
        yield cluster
        with suppress(TimeoutError):
            cluster.close(timeout=30)


@pytest.mark.slow
def test_threads_and_processes_change_nothing(diagnose):
    in_order = diagnose("--n-jobs", "1", name="order.csv")
    assert diagnose("--n-jobs", "2") == in_order
    assert diagnose("--n-jobs", "1", "--processes") == in_order


@pytest.mark.slow
def test_a_cluster_changes_nothing(diagnose, cluster):
    in_order = diagnose("--n-jobs", "1", name="order.csv")
    assert diagnose("--dask", cluster.scheduler_address) == in_order


def test_an_address_where_no_scheduler_answers_is_named(run, fleet, monkeypatch):
    monkeypatch.setattr("skarxlag.plant.commands.workers._CONNECT_SECONDS", 0.3)
    arguments = ("diagnose", fleet / "m.skops", fleet / "0.npy")
    code, out, err = run(*arguments, "--dask", "tcp://127.0.0.1:1")
    assert code == 1 and not out
    assert "--dask tcp://127.0.0.1:1: no scheduler that has workers answers" in err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ends", "message"),
    [("workers", "no worker is working"), ("scheduler", "the scheduler was lost")],
)
def test_a_cluster_on_which_nothing_happens_is_not_waited_for(
    monkeypatch, ends, message
):
    monkeypatch.setattr("skarxlag.plant.commands.workers._LOOK_SECONDS", 1)
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "1s"}),
        distributed.LocalCluster(
            n_workers=1, processes=False, dashboard_address=None
        ) as cluster,
    ):

        def end():
            if ends == "scheduler":
                cluster.sync(cluster.scheduler.close)
            else:
                cluster.scale(0)

        tasks = [partial(time.sleep, 3), partial(time.sleep, 3)]
        results = run_tasks(tasks, dask=cluster.scheduler_address)
        threading.Timer(0.5, end).start()
        with pytest.raises(CommandError, match=f"--dask .*: {message}"):
            list(results)


@pytest.mark.slow
def test_a_death_costs_a_retry_and_a_second_one_that_task_alone(tmp_path):
    home = os.getpid()
    deadly = {
        1: partial(die, home, tmp_path / "flag"),
        3: partial(die, home),
        5: partial(DiesWhileSending, home),
        6: partial(int, "no number"),
    }
    tasks = [deadly.get(place, partial(abs, place)) for place in range(8)]
    results = dict(run_tasks(tasks, 2, processes=True))
    for place in (3, 5):
        assert str(results.pop(place)) == "every process that read it died"
    assert "no number" in str(results.pop(6))
    assert results == {0: 0, 1: "survived", 2: 2, 4: 4, 7: 7}
    assert not cancelled.is_set()


@pytest.mark.slow
def test_a_worker_of_a_cluster_that_dies_costs_a_retry(tmp_path, cluster):
    address = cluster.scheduler_address
    deadly = partial(die, os.getpid())
    tasks = [partial(abs, 0), partial(deadly, tmp_path / "flag"), partial(abs, 2)]
    assert dict(run_tasks(tasks, dask=address)) == {0: 0, 1: "survived", 2: 2}
    ((_, error),) = run_tasks([deadly], dask=address)
    assert str(error) == "every process that read it died"


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
