"""Many recordings, on threads and on processes that may die."""

import io
import os
import signal
from functools import partial

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from skarxlag import make_alpio, save_diagnoser
from skarxlag.plant.commands.journal import Journal
from skarxlag.plant.commands.workers import cancelled, run_tasks

WINDOW, N_RECORDINGS = 200, 20
#: On Windows any other signal ends a process like this.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


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


@pytest.mark.slow
def test_threads_and_processes_change_nothing(diagnose):
    in_order = diagnose("--n-jobs", "1", name="order.csv")
    assert diagnose("--n-jobs", "2") == in_order
    assert diagnose("--n-jobs", "2", "--processes") == in_order


def die(home, flag=None):
    """End the process, unless it is that of the tests or the flag exists."""
    if os.getpid() != home and not (flag and flag.exists()):
        if flag:
            flag.touch()
        os.kill(os.getpid(), KILL)
    return "survived"


class DiesWhileSending:
    """Result that ends the process which writes it to the parent."""

    def __init__(self, home):
        self.home = home

    def __reduce__(self):
        die(self.home)
        return DiesWhileSending, (self.home,)


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
