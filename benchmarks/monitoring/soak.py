"""Memory and open files of a monitor that runs for a long time.

    python -m benchmarks.monitoring.soak --write docs/monitoring.md

A diagnoser with healthy limits follows simulated blocks of the simulated rig, healthy
and faulty in turn. Resident memory, open descriptors and the time of a window are
measured at equal steps. The windows are short, so that many of them pass in a given
time. Linux only, because the figures are read from /proc.
"""

import argparse
import os
import sys
import time
import warnings
from itertools import cycle, pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.pages.blocks import markdown, write_blocks
from skarxlag import ConditionMonitor, make_detector, make_diagnoser
from skarxlag.datasets import simulate_rig

#: Steps of the table.
STEPS = 8
#: Samples in a window, and windows of a block.
LENGTH = 128
N_WINDOWS = 200
RPM = 500


def soak(n_windows, n_steps=STEPS):
    """Return memory, descriptors and time of a window at equal steps.

    Parameters
    ----------
    n_windows : int
        Windows in all.
    n_steps : int, default=8
        Rows of the table after the first.

    Returns
    -------
    DataFrame
        Columns ``windows``, ``MiB``, ``descriptors`` and ``us a window``, with a row
        for the begin.
    """
    size = {"n_samples": N_WINDOWS * LENGTH, "window_length": LENGTH}
    rig = simulate_rig(rpm=RPM, crack_mm=6, conditions=["Normal", "OR"], **size)
    healthy = rig.target == "Normal"
    diagnoser = make_diagnoser(healthy="Normal").fit(rig.data, rig.target, rpm=rig.rpm)
    with warnings.catch_warnings():
        # One speed suffices here, and the rate is of no interest.
        warnings.simplefilter("ignore", UserWarning)
        detector = make_detector().fit(rig.data[healthy], rpm=RPM)
    monitor = ConditionMonitor(
        diagnoser, rig.sampling_rate, detector=detector, window_length=LENGTH
    )
    blocks = cycle(
        np.moveaxis(rig.data[chosen], 1, 0).reshape(2, -1)
        for chosen in (healthy, ~healthy)
    )
    monitor.update(next(blocks), rpm=RPM)
    rows = [_state(0)]
    for begin, end in pairwise(np.linspace(0, n_windows, n_steps + 1).astype(int)):
        done = begin
        while done < end:
            done += len(monitor.update(next(blocks), rpm=RPM))
        rows.append(_state(end))
        print(*rows[-1], file=sys.stderr, flush=True)
    frame = pd.DataFrame(rows, columns=["windows", "MiB", "descriptors", "seconds"])
    elapsed = frame.pop("seconds").diff() / frame["windows"].diff()
    return frame.assign(**{"us a window": (1e6 * elapsed).round(1)})


def _state(n_windows):
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    size = pages * os.sysconf("SC_PAGE_SIZE") / 2**20
    return (
        int(n_windows),
        round(size),
        len(os.listdir("/proc/self/fd")),
        time.process_time(),
    )


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--windows", type=float, default=1e7, help="default: %(default)g"
    )
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="Markdown file for the table"
    )
    options = parser.parse_args(arguments)
    text = markdown(soak(int(options.windows)), digits=1)
    if options.write:
        write_blocks(options.write, {"soak": text})
    print(text)


if __name__ == "__main__":
    main()
