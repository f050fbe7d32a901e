"""Helpers that the tests of ``watch`` share."""

import json

import numpy as np
from scipy.signal import lfilter

from skarxlag import ConditionMonitor
from skarxlag.core.capabilities import Capabilities
from skarxlag.plant.readers.listing import ListedRecording
from skarxlag.plant.watch.live import from_folder
from skarxlag.plant.watch.live_text import TextSamples
from skarxlag.plant.watch.live_times import StreamTimes

WINDOW, RATE = 200, 1000.0
COLOURS = {"good": [1.0, -0.9], "worn": [1.0, 0.9]}
IDLE = ("--idle", 0.06, "--poll", 0.005, "--settle", 0.01)


def sound(condition, n_samples, seed):
    noise = np.random.default_rng(seed).normal(size=n_samples)
    return lfilter([1.0], COLOURS[condition], noise)


def verdicts_of(text):
    """The fields of `MonitorVerdict` and the healthy condition, in each line."""
    lines = [json.loads(line) for line in text.splitlines()]
    for line in lines:
        assert line.pop("kind") == "verdict"
        assert line.pop("sensor")
        assert len(line.pop("model")) == 12
        line["time"] = line.pop("seconds")
    return lines


def expected(fitted, signal, **settings):
    diagnoser, detector = fitted
    monitor = ConditionMonitor(
        diagnoser, RATE, detector=detector, window_length=WINDOW, **settings
    )
    found = [verdict._asdict() for verdict in monitor.update(signal)]
    return [
        {k: None if v != v else v for k, v in each.items()} | {"healthy": "good"}
        for each in found
    ]


def lines_of(signal, separator=","):
    columns = np.atleast_2d(signal).T
    return "".join(
        separator.join(map(repr, row)) + "\n" for row in columns.tolist()
    ).encode()


def parsed(parser, data, *, is_end=False):
    """All samples that a parser yields of some bytes."""
    parts = [samples for samples, _ in parser.parts(data, is_end=is_end)]
    return np.concatenate(parts, axis=1) if parts else np.empty((0, 0))


def drained(blocks, between=None, n_looks=6):
    """All blocks of a source that finds nothing new some times; what to do each time."""
    found = []
    n_empty = 0
    while n_empty < n_looks:
        block = next(blocks)
        if block is not None:
            found.append(block)
            continue
        if between is not None:
            between(n_empty)
        n_empty += 1
    return found


def blocks_of(folder, warn, position=None, settle=1e-6):
    """Blocks from the files of a folder, in windows of 5 samples."""

    def entry_of(path):
        return ListedRecording(None, path.name, path, sampling_rate=1.0)

    rows = Capabilities(window_length=5)
    return from_folder(folder, entry_of, rows, settle, False, warn, position)


def text_samples(channel=None):
    """A parser that looks for no times."""
    return TextSamples(channel, StreamTimes("none", RATE, 0.1, WINDOW))
