"""Figure of the page on fleets: a run on a cluster that loses workers, as it was measured.

``python -m benchmarks.pages.fleet_figure`` writes docs/images/fleet.svg. Two worker
processes of a local Dask cluster diagnose long recordings. One of them is killed from
outside. Later one recording ends whatever process has read it. The clock of every
attempt is read in its worker.
"""

import argparse
import os
import signal
import tempfile
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import dask
import numpy as np
import pandas as pd
from distributed import LocalCluster, get_worker
from matplotlib.patches import Patch

from benchmarks.pages.svg_figures import BLUE, GREY, ORANGE, PURPLE, saved_figure
from benchmarks.speed.rows import coloured_windows
from skarxlag import make_diagnoser, save_diagnoser
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.commands.workers import executors, run_tasks
from skarxlag.plant.readers.listing import list_files

WINDOW_LENGTH, N_WINDOWS, N_RECORDINGS = 1200, 2400, 24
#: The recording that ends its process, and the number of verdicts after which a worker
#: is killed.
DEADLY, KILL_AFTER = 13, 6
#: A task is given up with the first worker that dies, so that few restarts fill the
#: figure.
OPTIONS = {
    "distributed.scheduler.allowed-failures": 0,
    "distributed.deploy.lost-worker-timeout": "5m",
}
KINDS = {
    "verdict": BLUE,
    "lost with its worker, done again": ORANGE,
    "ends its worker each time, given up": PURPLE,
}


@dataclass(frozen=True)
class Attempt:
    """A task that notes when a worker begins with it, and when it has ended."""

    number: int
    task: Any
    notes: Path

    def __call__(self):
        """Return the worker, begin, end and what the task returned."""
        worker, began = get_worker().name, time.time()
        with self.notes.open("a") as file:
            file.write(f"{self.number},{worker},{began}\n")
        outcome = self.task()
        if self.number == DEADLY:
            os.kill(os.getpid(), signal.SIGKILL)
        return worker, began, time.time(), outcome


def measure():
    """Run the recordings on a cluster and note what happened when.

    Returns
    -------
    attempts : DataFrame
        With ``number``, ``worker``, ``began``, ``ended`` (NaN if the worker died) in
        seconds.
    arrivals : list of float
        When each verdict was there.
    killed : float
        When a worker was killed.
    """
    X, y = coloured_windows(N_WINDOWS, WINDOW_LENGTH)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        model = folder / "model.skops"
        save_diagnoser(make_diagnoser().fit(X[::6], y[::6]), model)
        np.save(folder / "0.npy", X.ravel().astype(np.float32))
        (recording,) = list_files(folder / "0.npy")
        load = SavedModel(model).load
        tasks = [
            partial(diagnose_file, replace(recording, name=str(n)), load)
            for n in range(N_RECORDINGS)
        ]
        expected = tasks[0]().windows
        notes = folder / "notes"
        args = argparse.Namespace()
        with (
            dask.config.set(OPTIONS),
            LocalCluster(
                n_workers=2,
                threads_per_worker=1,
                dashboard_address="localhost:0",
                silence_logs=60,
            ) as cluster,
        ):
            args.dask = cluster.scheduler_address
            with executors(dask=args.dask) as workers:
                # Both have loaded the model before the clock runs.
                list(run_tasks(tasks[:8], workers))
                start, ended, arrivals, killed = time.time(), {}, [], None
                attempts = [
                    Attempt(number, task, notes) for number, task in enumerate(tasks)
                ]
                for number, outcome in run_tasks(attempts, workers):
                    arrivals.append(time.time() - start)
                    if isinstance(outcome, Exception):
                        continue
                    *key, end, diagnosis = outcome
                    ended[number, *key] = end - start
                    pd.testing.assert_frame_equal(
                        diagnosis.windows, expected, check_exact=True
                    )
                    if len(arrivals) == KILL_AFTER:
                        time.sleep(0.4)  # until it is at work on the next
                        os.kill(cluster.workers[0].pid, signal.SIGKILL)
                        killed = time.time() - start
        frame = pd.read_csv(notes, names=["number", "worker", "began"])
    keys = zip(frame["number"], frame["worker"], frame["began"], strict=True)
    frame["ended"] = [ended.get(key, np.nan) for key in keys]
    return frame.assign(began=frame["began"] - start), arrivals, killed


def draw(path):
    """Draw the figure.

    Parameters
    ----------
    path : Path
        File to write.
    """
    attempts, arrivals, killed = measure()
    usual = (attempts["ended"] - attempts["began"]).median()
    with saved_figure(
        path, 2, 1, size=(7.0, 3.4), sharex=True, height_ratios=(2, 1)
    ) as (
        (bars,),
        (count,),
    ):
        for attempt in attempts.itertuples():
            end, kind = attempt.ended, "verdict"
            if np.isnan(end):
                kind = list(KINDS)[1 + (attempt.number == DEADLY)]
                # Nobody has read the clock at the death of a worker that we did not
                # kill.
                end = attempt.began + usual
                if attempt.began < killed < end:
                    end = killed
            span = attempt.began, end - attempt.began - 0.15
            bars.broken_barh([span], (attempt.worker - 0.35, 0.7), color=KINDS[kind])
        for axes in (bars, count):
            axes.axvline(killed, color=GREY, linestyle="--")
        bars.text(killed, -0.6, " worker 1 is killed", fontsize=8, va="bottom")
        bars.set_yticks([0, 1], ["worker 1", "worker 2"])
        bars.set_ylim(1.5, -0.9)
        count.step(
            [0, *arrivals], np.arange(len(arrivals) + 1), where="post", color=BLUE
        )
        count.set_ylabel("recordings done")
        count.set_xlabel("seconds")
        patches = [Patch(color=colour, label=kind) for kind, colour in KINDS.items()]
        bars.figure.legend(
            handles=patches,
            loc="outside upper center",
            ncols=3,
            frameon=False,
            fontsize=8,
        )


def main(argv=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", type=Path, default=Path("docs/images/fleet.svg"))
    args = parser.parse_args(argv)
    draw(args.figure)


if __name__ == "__main__":
    main()
