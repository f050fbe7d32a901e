"""Rows of the speed benchmark on a running sensor."""

import time

import numpy as np

from benchmarks.speed.rows import coloured_windows, rate
from benchmarks.speed.timing import ratio, take_turns
from skarxlag import ConditionMonitor, make_diagnoser, make_windows

_RATE = 25_600.0


def monitor(n_rounds=9, n_seconds=10):
    """`ConditionMonitor` on one core: samples a second, latency of a second, channels at once."""
    X, y = coloured_windows(200)
    diagnoser = make_diagnoser().fit(X, y)
    signal = np.random.default_rng(0).normal(size=int(n_seconds * _RATE))
    blocks = np.split(signal, n_seconds)
    windows = make_windows(signal)
    running = ConditionMonitor(diagnoser, _RATE)
    seconds = take_turns(
        {
            "monitor": lambda: [running.update(block) for block in blocks],
            "block": lambda: running.update(blocks[0]),
            "windows": lambda: diagnoser.diagnose(windows),
        },
        n_rounds,
        clock=time.perf_counter,
    )
    times, differs = ratio(seconds["monitor"], seconds["windows"])
    latency = np.median(seconds["block"])
    what = "`ConditionMonitor.update`, one channel of 25.6 kHz, blocks of 1 s"
    return [
        {
            "what": f"{what}: time over `diagnose` on the same windows",
            "ours": rate(signal.size, seconds["monitor"]),
            "beside": f"`diagnose`: {rate(signal.size, seconds['windows'])}",
            "reached": times,
            "spread": differs,
        },
        {
            "what": "the same: channels that one core follows in real time",
            "ours": f"latency of a block of 1 s: {latency * 1e3:.3g} ms",
            "reached": 1 / latency,
        },
    ]
