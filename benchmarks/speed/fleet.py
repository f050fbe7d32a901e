"""Many recordings: rate of one core, and two worker processes compared with one.

    python -m benchmarks.speed --only fleet
    python -m benchmarks.speed.fleet --write docs/fleet.md

One and two worker processes take turns on the same recordings, reading of the files
included. All workers have been started and have loaded the model before the clock runs.
In the same rounds one and two processes multiply matrices, which shows the free
capacity for a second process.
"""

import os
import pickle
import tempfile
import time
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from joblib.externals.loky import ProcessPoolExecutor

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.speed.rows import coloured_windows, rate
from benchmarks.speed.timing import matrix_product, ratio, take_turns
from skarxlag import make_diagnoser, save_diagnoser
from skarxlag.plant.commands.diagnosis import diagnose_file
from skarxlag.plant.commands.models import SavedModel
from skarxlag.plant.commands.workers import Workers, run_tasks
from skarxlag.plant.readers.listing import list_files

WINDOW_LENGTH = 1200
#: The fleet of the example: sensors, their sampling rate in Hz, and the length of a
#: recording in s.
SENSORS, SAMPLING_RATE, SECONDS = 10_000, 25_600, 1.0


def _process_after(task):
    """Return the number of the process that did a task."""
    task()
    return os.getpid()


def _products(n):
    product, _ = matrix_product()
    for _ in range(n):
        product()


@contextmanager
def _warm_workers(n_workers, tasks):
    """An executor of which every process has done one of the tasks."""
    with ProcessPoolExecutor(n_workers) as executor:
        processes = set()
        while len(processes) < n_workers:
            processes.update(executor.map(_process_after, tasks))
        yield executor


def _run(executor, tasks, n_workers):
    for _, outcome in run_tasks(tasks, Workers(executor.submit, lambda: n_workers)):
        if isinstance(outcome, Exception) or getattr(outcome, "error", None):
            raise RuntimeError(f"a task failed: {outcome}")


def measure(n_rounds=9, n_recordings=24, n_windows=400):
    """Return the seconds of one and two workers, and bytes between them and the calling process.

    Parameters
    ----------
    n_rounds : int, default=9
        Rounds, in each of which all sides run once.
    n_recordings : int, default=24
        Recordings in a run.
    n_windows : int, default=400
        Windows in a recording.

    Returns
    -------
    dict
        ``seconds`` by side and round; ``n_samples`` in a run; ``bytes_out`` of the task
        of a recording and ``bytes_back`` of its results, a window.
    """
    X, y = coloured_windows(n_windows, WINDOW_LENGTH)
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        model = folder / "model.skops"
        save_diagnoser(make_diagnoser().fit(X, y), model)
        for number in range(n_recordings):
            np.save(folder / f"{number}.npy", X.ravel().astype(np.float32))
        load = SavedModel(model).load
        tasks = [
            partial(diagnose_file, recording, load) for recording in list_files(folder)
        ]
        products = [partial(_products, 10)] * 8
        with _warm_workers(1, tasks[:2]) as one, _warm_workers(2, tasks[:4]) as two:
            seconds = take_turns(
                {
                    "one": lambda: _run(one, tasks, 1),
                    "two": lambda: _run(two, tasks, 2),
                    "product": lambda: _run(one, products, 1),
                    "products": lambda: _run(two, products, 2),
                },
                n_rounds,
                clock=time.perf_counter,
            )
        return {
            "seconds": seconds,
            "n_samples": n_recordings * X.size,
            "bytes_out": len(pickle.dumps(tasks[0])),
            "bytes_back": len(pickle.dumps(tasks[0]())) / n_windows,
        }


def fleet(**settings):
    """Return a row of the speed benchmark: two worker processes over one."""
    measured = measure(**settings)
    seconds, n_samples = measured["seconds"], measured["n_samples"]
    faster, differs = ratio(seconds["one"], seconds["two"])
    possible, noise = ratio(seconds["product"], seconds["products"])
    return [
        {
            "what": "recordings on worker processes, reading included: two workers over one",
            "ours": rate(n_samples, seconds["two"]),
            "peer": f"one worker: {rate(n_samples, seconds['one'])}; matrix products in two "
            f"processes over one, in the same rounds: {possible:.3g} (spread {noise:.0%})",
            "reached": faster,
            "target": None,
            "spread": differs,
        }
    ]


def costs(measured):
    """Return the costs of a fleet as a data frame: measured values, then derived ones."""
    seconds, n_samples = measured["seconds"], measured["n_samples"]
    samples_a_second = n_samples / float(np.median(seconds["one"]))
    faster, differs = ratio(seconds["one"], seconds["two"])
    possible, noise = ratio(seconds["product"], seconds["products"])
    lines = [
        (
            "samples that one worker process diagnoses in a second, R",
            f"{samples_a_second:,.0f}",
        ),
        ("two worker processes over one (spread)", f"{faster:.2f} ({differs:.0%})"),
        (
            "matrix products in two processes over one (spread)",
            f"{possible:.2f} ({noise:.0%})",
        ),
        ("bytes to a worker for a recording, b", f"{measured['bytes_out']:,}"),
        ("bytes from a worker for a window, w", f"{measured['bytes_back']:.0f}"),
    ]
    for what, share in (("one recording a minute", SECONDS / 60), ("no pause", 1.0)):
        samples = SENSORS * SAMPLING_RATE * share
        recordings = SENSORS * share / SECONDS
        network = (
            recordings * measured["bytes_out"]
            + samples / WINDOW_LENGTH * measured["bytes_back"]
        )
        lines += [
            (f"example, {what}: cores", f"{samples / samples_a_second:,.1f}"),
            (f"example, {what}: MB/s over the network", f"{network / 1e6:.2f}"),
        ]
    return pd.DataFrame(lines, columns=["what", "value"])


def main(arguments=None):
    """Measure, print and write the table."""
    parser = page_parser(__doc__, "fleet")
    parser.add_argument("--rounds", type=int, default=9, metavar="N", help="default: 9")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    measured = measure(options.rounds)
    frame = costs(measured)
    options.output.mkdir(parents=True, exist_ok=True)
    frame.to_csv(options.output / "costs.csv", index=False)
    n_rounds = len(measured["seconds"]["one"])
    about = (
        "`make_diagnoser`, windows of "
        f"{WINDOW_LENGTH}, recordings of 400 windows in float32, median of {n_rounds} rounds in "
        f"which all sides take turns. The example: {SENSORS:,} sensors, each with recordings of "
        f"{SECONDS:g} s at {SAMPLING_RATE:,} Hz. When it began, {load:.1f} "
        f"processes were at work on {os.cpu_count()} processors."
    )
    publish(options, {"fleet": f"{about}\n\n{markdown(frame)}"})


if __name__ == "__main__":
    main()
