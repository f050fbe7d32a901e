"""Scale of a fleet: what 10 000 sensors need, and what is exhausted first if there are more.

    python -m benchmarks.speed.fleet_scale --write docs/fleet.md

Each sensor sends a recording of a second every ten minutes. The costs of one recording
are measured: processor time in a worker, in the command and in the scheduler, memory,
bytes of files and bytes over the network. The needs of the fleet follow from them. A
simulation of a run with one queue and several workers uses the measured times.
"""

import argparse
import heapq
import os
import pickle
import resource
import sys
import tempfile
import time
import tracemalloc
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.speed.processes import run_python
from benchmarks.speed.rows import coloured_windows
from benchmarks.speed.scale import steps
from skarxlag.plant.commands import main as run_command
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.commands.workers import executors, run_tasks
from skarxlag.plant.readers.listing import list_files

SENSORS, SAMPLING_RATE, PERIOD = 10_000, 25_600, 600
#: Recordings of a second of each condition in the training.
_N_TRAINING = 40
#: What one small server has: cores, bytes of memory and of disk, and bytes a second of
#: network.
CORES, MEMORY, DISK, NETWORK = 4, 16e9, 1e12, 125e6
#: Days for which recordings are kept.
KEPT_DAYS = 30
_WORKERS = (1, 2, 4, 8, 16, 32)
#: Seconds in which the work of an idle scheduler is measured.
_IDLE = 5.0


class Costs(NamedTuple):
    """Costs of one recording, unless stated otherwise.

    Parameters
    ----------
    diagnosis : ndarray of shape (n_recordings,)
        Processor seconds in a worker.
    scheduling : float
        Processor seconds of the command and the scheduler of Dask together.
    lists : float
        Processor seconds of the command for the list, the journal and the results.
    start : float
        Processor seconds of a command that diagnoses one recording.
    worker : float
        Bytes of memory of a worker.
    verdict : float
        Bytes of memory of a verdict in the command.
    file, result : float
        Bytes of the recording, and of its results as json.
    sent, returned : float
        Bytes of a task to a worker, and of its result.
    """

    diagnosis: np.ndarray
    scheduling: float
    lists: float
    start: float
    worker: float
    verdict: float
    file: float
    result: float
    sent: float
    returned: float


def measure(n_recordings=200, n_listed=10_000):
    """Measure the costs.

    Parameters
    ----------
    n_recordings : int, default=200
        Recordings that are diagnosed.
    n_listed : int, default=10_000
        Recordings in the list.

    Returns
    -------
    Costs
        The costs.
    """
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        model, path = _fitted(folder, n_recordings)
        tasks = [partial(diagnose_file, each, model.load) for each in list_files(path)]
        diagnosis = tasks[0]()
        if diagnosis.error is not None:
            raise RuntimeError(diagnosis.error)
        listed = steps(model, path / "0.npy", n_listed)
        used = (
            "recordings of a table",
            "journal",
            "rows of results",
            "results as json",
        )
        scheduling, worker = _on_dask(tasks)
        command = ["-m", "skarxlag", "diagnose", model.path, path / "0.npy"]
        command += ["--sampling-rate", SAMPLING_RATE, "--rpm", 900]
        # The first run compiles what the cache does not hold.
        cache = os.environ.get("NUMBA_CACHE_DIR", folder)
        run_python(*command, cache=cache)
        started = _seconds_of_children()
        run_python(*command, cache=cache)
        return Costs(
            diagnosis=np.array([_processor_seconds(task) for task in tasks]),
            scheduling=scheduling,
            lists=sum(listed[name] for name in used) / n_listed,
            start=_seconds_of_children() - started,
            worker=worker,
            verdict=_bytes_in_memory(diagnosis),
            file=(path / "0.npy").stat().st_size,
            result=(path / str(n_listed) / "results.json").stat().st_size / n_listed,
            sent=len(pickle.dumps(tasks[0])),
            returned=len(pickle.dumps(diagnosis)),
        )


def _fitted(folder, n_recordings):
    """Return a model that `fit` saved, and the folder of the recordings to diagnose."""
    X, y = coloured_windows(4 * _N_TRAINING, SAMPLING_RATE)
    training, path = folder / "training", folder / "recordings"
    for each in (training, path):
        each.mkdir()
    for condition in range(4):
        np.save(
            training / f"{condition}.npy", X[y == condition].ravel().astype(np.float32)
        )
    command = [
        "fit",
        training,
        "-o",
        folder / "model.skops",
        "--pattern",
        r"(?P<condition>\d)",
    ]
    command += [
        "--sampling-rate",
        SAMPLING_RATE,
        "--rpm",
        900,
        "--healthy",
        0,
        "--quiet",
    ]
    command += [
        "--diagnoser",
        "stretches",
        "--window-length",
        SAMPLING_RATE,
        "--n-jobs",
        1,
    ]
    sys.stdout.flush()
    if run_command([str(each) for each in command]) != 0:
        raise RuntimeError("the model could not be fitted")
    for number, row in enumerate(
        coloured_windows(n_recordings, SAMPLING_RATE, seed=1)[0]
    ):
        np.save(path / f"{number}.npy", row.astype(np.float32))
    return SavedModel(folder / "model.skops"), path


def _on_dask(tasks):
    """Return processor seconds of this process for a task, and the memory of the worker."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=1,
        threads_per_worker=1,
        dashboard_address="localhost:0",
        silence_logs=60,
    ) as cluster:
        args = argparse.Namespace(dask=cluster.scheduler_address)
        with executors(dask=args.dask) as workers:
            list(run_tasks(tasks[:8], workers))
            # An idle scheduler works, too, and a busy machine would count more of that.
            idle, elapsed = _both_seconds(partial(time.sleep, _IDLE))
            seconds, duration = _both_seconds(lambda: list(run_tasks(tasks, workers)))
            seconds -= duration * idle / elapsed
            ((_, memory),) = run_tasks([_peak_memory], workers)
    return seconds / len(tasks), memory


def _peak_memory():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _processor_seconds(task):
    return _both_seconds(task)[0]


def _both_seconds(task):
    """Return the processor time and the time that a task takes."""
    start, begin = time.process_time(), time.perf_counter()
    task()
    return time.process_time() - start, time.perf_counter() - begin


def _seconds_of_children():
    times = os.times()
    return times.children_user + times.children_system


def _bytes_in_memory(diagnosis, n_copies=200):
    content = pickle.dumps(diagnosis)
    tracemalloc.start()
    copies = [pickle.loads(content) for _ in range(n_copies)]
    used, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return used / len(copies)


def simulate(seconds, scheduling, n_workers):
    """Simulate a run of the command over recordings that are all there at its beginning.

    The scheduler passes one recording after another to the next free worker.

    Parameters
    ----------
    seconds : ndarray of shape (n_recordings,)
        Seconds in a worker.
    scheduling : float
        Seconds of command and scheduler for each recording.
    n_workers : int
        Number of workers.

    Returns
    -------
    ndarray of shape (n_recordings,)
        Seconds from the beginning to each verdict.

    Examples
    --------
    >>> simulate(np.array([2.0, 2.0, 2.0]), 0.5, 2).tolist()
    [2.5, 3.0, 4.5]
    """
    free = [0.0] * n_workers
    verdicts = np.empty(len(seconds))
    for number, duration in enumerate(seconds):
        begin = max((number + 1) * scheduling, heapq.heappop(free))
        verdicts[number] = begin + duration
        heapq.heappush(free, verdicts[number])
    return verdicts


def costs_table(costs):
    """Return the measured costs of one recording as a data frame."""
    low, high = np.quantile(costs.diagnosis, [0.25, 0.75])
    median = np.median(costs.diagnosis)
    lines = [
        (
            "diagnosis, ms of a core",
            f"{1e3 * median:.1f} ({1e3 * low:.1f} to {1e3 * high:.1f})",
        ),
        (
            "command and scheduler of Dask, ms of a core",
            f"{1e3 * costs.scheduling:.2f}",
        ),
        ("list, journal and results, ms of a core", f"{1e3 * costs.lists:.2f}"),
        ("command for one recording alone, ms of a core", f"{1e3 * costs.start:.0f}"),
        ("memory of a worker, MB", f"{costs.worker / 1e6:.0f}"),
        ("memory of a verdict in the command, kB", f"{costs.verdict / 1e3:.1f}"),
        ("file of the recording, kB", f"{costs.file / 1e3:.1f}"),
        ("results as json, kB", f"{costs.result / 1e3:.2f}"),
        ("to a worker and back, kB", f"{(costs.sent + costs.returned) / 1e3:.1f}"),
    ]
    return pd.DataFrame(lines, columns=["one recording", "cost"])


def limits_table(costs):
    """Return what the fleet needs and the number of sensors that exhausts it, the fewest first."""
    of_command = costs.scheduling + costs.lists
    on_network = costs.file + costs.sent + costs.returned
    a_day = 24 * 3600 / PERIOD
    alone = "cores, if each sensor has a model and a command of its own"
    needs = {
        f"GB of disk, recordings of {KEPT_DAYS} days": (
            costs.file * a_day * KEPT_DAYS / 1e9,
            DISK / 1e9,
        ),
        f"GB of disk, results of {KEPT_DAYS} days": (
            costs.result * a_day * KEPT_DAYS / 1e9,
            DISK / 1e9,
        ),
        "cores of workers": (costs.diagnosis.mean() / PERIOD, CORES),
        "cores of the command and the scheduler": (of_command / PERIOD, 1),
        alone: (costs.start / PERIOD, CORES),
        "GB of memory of the command": (costs.verdict / 1e9, MEMORY / 1e9),
        "MB/s of network": (on_network / PERIOD / 1e6, NETWORK / 1e6),
    }
    columns = ["what", "needed", "limit", "sensors at the limit"]
    lines = [
        (what, _rounded(SENSORS * each), f"{limit:,g}", limit / each)
        for what, (each, limit) in needs.items()
    ]
    table = pd.DataFrame(lines, columns=columns).sort_values(columns[-1])
    return table.assign(**{columns[-1]: table[columns[-1]].map(lambda n: f"{n:,.0f}")})


def _rounded(value):
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def runs_table(costs):
    """Return the seconds of a simulated run with several numbers of workers."""
    seconds = np.random.default_rng(0).choice(costs.diagnosis, SENSORS)
    lines = []
    for n_workers in _WORKERS:
        verdicts = costs.start + simulate(seconds, costs.scheduling, n_workers)
        last = verdicts.max() + SENSORS * costs.lists
        busy = seconds.sum() / (n_workers * last)
        shown = (f"{np.median(verdicts):.0f}", f"{verdicts.max():.0f}", f"{last:.0f}")
        lines.append((n_workers, *shown, f"{busy:.0%}"))
    columns = [
        "workers",
        "half of the verdicts, s",
        "all verdicts, s",
        "results, s",
        "busy",
    ]
    return pd.DataFrame(lines, columns=columns)


def main(arguments=None):
    """Measure, simulate, print and write the tables."""
    parser = page_parser(__doc__, "fleet-scale")
    parser.add_argument(
        "--recordings", type=int, default=200, metavar="N", help="default: 200"
    )
    options = parser.parse_args(arguments)
    costs = measure(options.recordings)
    tables = [costs_table(costs), limits_table(costs), runs_table(costs)]
    about = (
        f"{SENSORS:,} sensors, each with a recording of 1 s at {SAMPLING_RATE:,} Hz (float32) "
        f"every {PERIOD // 60} minutes. The model is that of `skarxlag fit`, with known conditions "
        "and healthy limits; a row is the whole recording. Times are processor time, so other work "
        "on the machine has little influence."
    )
    limits = (
        f"What the fleet needs, and the number of sensors that would exhaust a server with {CORES} "
        f"cores, {MEMORY / 1e9:g} GB of memory, {DISK / 1e12:g} TB of disk and a network of "
        f"{NETWORK * 8 / 1e9:g} Gbit/s. The command and the scheduler share a process here, which "
        "uses one core at most. The first row is exhausted first."
    )
    runs = (
        "A simulated run of `skarxlag diagnose --dask` on one recording of each sensor, from the "
        "start of the command. Busy: share of the time in which a worker diagnoses."
    )
    shown = [
        about,
        markdown(tables[0]),
        limits,
        markdown(tables[1]),
        runs,
        markdown(tables[2]),
    ]
    publish(options, {"fleet-scale": "\n\n".join(shown)})


if __name__ == "__main__":
    main()
