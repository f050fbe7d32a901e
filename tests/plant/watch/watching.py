"""Helpers that the tests of ``watch`` share."""

import json
from functools import partial

import numpy as np
from scipy.signal import lfilter

from skarxlag import ConditionMonitor, make_detector, make_windows, save_diagnoser
from skarxlag.plant.watch.parsing import TextParser, chosen_names

WINDOW, RATE = 200, 1000.0
COLOURS = {"good": [1.0, -0.9], "worn": [1.0, 0.9]}
#: A folder ends the command when nothing has come for a moment.
IDLE = ("--idle", 0.06, "--settle", 0.01)


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


def parsed(data, size=10**9):
    """All samples of some bytes that come in pieces of a size."""
    choose = partial(chosen_names, channel=None, speed=None, usual=[])
    parser = TextParser(choose)
    pieces = [data[start : start + size] for start in range(0, len(data), size)]
    parts = [parser.samples(piece, False) for piece in pieces]
    return np.concatenate([part for part in parts if part.size], axis=1)


def save_model(diagnoser, path, seed):
    """Save a diagnoser with healthy limits that take the level, too."""
    healthy = make_windows(sound("good", 100 * WINDOW, seed), WINDOW)
    facts = {"conditions": ["good", "worn"], "n_channels": 1, "sampling_rate": RATE}
    detector = make_detector(fixed_gain=True).fit(healthy)
    save_diagnoser(diagnoser, path, window_length=WINDOW, detector=detector, **facts)
