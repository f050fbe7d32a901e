"""Memory and processor time of one process that watches several sensors.

    python -m benchmarks.monitoring.sensors --write docs/plant.md

`skarxlag watch` with a table of sensors reads pipes of raw 16-bit samples, or of csv
lines, of the simulated rig, with one detector and windows of a second. The time of a
run with pipes of a few seconds is subtracted, so that loading the model does not count.
Pipes are written as fast as they are read.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.pages.blocks import markdown, write_blocks
from skarxlag import make_detector, save_diagnoser
from skarxlag.datasets import simulate_rig

#: Sampling rate in Hz, speed of the healthy recordings, and seconds of each signal.
RATE = 25_600
RPM = 500
SHORT = 5
LONG = 35


def sensors(counts):
    """Return memory and processor time for numbers of sensors.

    Parameters
    ----------
    counts : sequence of int
        Numbers of sensors with raw samples. The first of them is run with csv lines,
        too.

    Returns
    -------
    DataFrame
        Columns ``files``, ``sensors``, ``MiB``, and ``share of one core``: seconds of
        processor time for a second of all signals.
    """
    rig = simulate_rig(
        rpm=RPM, conditions=["Normal"], n_samples=120 * RATE, window_length=RATE
    )
    rows = rig.data if rig.data.ndim == 2 else rig.data[:, 0]
    integers = np.round(rows / np.abs(rows).max() * 2**15 * 0.9).astype("<i2")
    measured = []
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        with warnings.catch_warnings():
            # One speed suffices here.
            warnings.simplefilter("ignore", UserWarning)
            detector = make_detector(false_alarm_rate=0.02).fit(
                integers[:80] * 1.0, rpm=RPM
            )
        save_diagnoser(
            detector, folder / "m.skops", sampling_rate=RATE, window_length=RATE
        )
        # The first run compiles.
        _run(folder, integers, 1, 1, "raw")
        for files, count in [("csv", counts[0]), *(("raw", count) for count in counts)]:
            runs = [
                _run(folder, integers, count, seconds, files)
                for seconds in (SHORT, LONG)
            ]
            (_, before), (memory, after) = runs
            measured.append(
                (files, count, round(memory), (after - before) / (LONG - SHORT))
            )
            print(*measured[-1], file=sys.stderr, flush=True)
    return pd.DataFrame(
        measured, columns=["files", "sensors", "MiB", "share of one core"]
    )


def _run(folder, integers, count, seconds, files):
    """Return the largest resident memory in MiB, and processor time in seconds, of a run."""
    lines = ["name,source,model,rpm"]
    for sensor in range(count):
        samples = np.roll(integers, sensor, axis=0)[:seconds].ravel()
        content = samples.tobytes()
        if files == "csv":
            content = "".join(f"{sample}\n" for sample in samples.tolist()).encode()
        path = folder / f"{sensor}.bin"
        if not path.exists():
            os.mkfifo(path)
        threading.Thread(target=path.write_bytes, args=(content,)).start()
        lines.append(f"{sensor},{sensor}.bin,m.skops,{RPM}")
    (folder / "plant.csv").write_text("\n".join(lines))
    command = [sys.executable, "-m", "skarxlag", "watch", folder / "plant.csv"]
    command += [] if files == "csv" else ["--dtype", "<i2"]
    # The process ends when nothing is new; waiting takes no processor time.
    child = subprocess.Popen(
        [*command, "--idle", "2"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    with child.stdout as lines_of_output:
        n_lines = lines_of_output.read().count(b'"kind": "verdict"')
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = status
    # The end of a pipe of a table is a problem, of which the status is 1.
    if os.waitstatus_to_exitcode(status) != 1 or n_lines != count * seconds:
        raise RuntimeError(f"{n_lines} verdicts of {count * seconds}, status {status}")
    return usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensors", type=int, nargs="+", default=[10, 50])
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="Markdown file for the table"
    )
    options = parser.parse_args(arguments)
    text = markdown(sensors(options.sensors), digits=2)
    if options.write:
        write_blocks(options.write, {"sensors in one process": text})
    print(text)


if __name__ == "__main__":
    main()
