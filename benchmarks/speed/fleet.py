"""Row of the speed benchmark about many recordings: one worker process next to two."""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.speed.rows import coloured_windows, rate
from benchmarks.speed.timing import spread
from skarxlag import make_diagnoser, save_diagnoser
from skarxlag.commands.batch import diagnose_all
from skarxlag.recordings.listing import list_files


def fleet(n_rounds=5, n_recordings=24, n_windows=400, window_length=1200):
    """`diagnose --processes` over files, reading included: wall time of one worker over two.

    The worker processes have been started, and have loaded the model, before the clock runs.
    """
    X, y = coloured_windows(n_windows, window_length)
    n_samples = n_recordings * X.size
    seconds = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        save_diagnoser(make_diagnoser().fit(X, y), folder / "model.skops")
        for number in range(n_recordings):
            np.save(folder / f"{number}.npy", X.ravel())
        recordings = list_files(folder)
        for n_jobs in (1, 2):
            args = argparse.Namespace(
                model=folder / "model.skops", output=None, resample=False, n_jobs=n_jobs,
                processes=True, dask=None, quiet=True,
            )  # fmt: skip
            for _ in range(2):
                # Every worker has imported the package and loaded the model after this.
                diagnose_all(args, recordings)
            for _ in range(n_rounds):
                started = time.perf_counter()
                diagnose_all(args, recordings)
                seconds.setdefault(n_jobs, []).append(time.perf_counter() - started)
    ratios = [one / two for one, two in zip(seconds[1], seconds[2], strict=True)]
    return [
        {
            "what": f"`skarxlag diagnose --processes`, {n_recordings} recordings of {n_windows} "
            "windows, reading included: two worker processes over one",
            "ours": rate(n_samples, seconds[2]),
            "beside": f"one worker: {rate(n_samples, seconds[1])}",
            "reached": float(np.median(ratios)),
            "target": None,
            "spread": spread(ratios),
        }
    ]
