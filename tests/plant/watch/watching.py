"""Helpers that the tests of ``watch`` share."""

import json
from functools import partial

import numpy as np
from scipy.signal import lfilter

from skarxlag import ConditionMonitor
from skarxlag.plant.watch.parsing import TextParser, chosen_names
from skarxlag.plant.watch.stream_times import NO_TIMES, StreamTimes

WINDOW, RATE = 200, 1000.0
COLOURS = {"good": [1.0, -0.9], "worn": [1.0, 0.9]}
#: A folder ends the command when nothing has come for a moment.
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


def text_parser(times=None, channel=None):
    """A parser, which looks for no times unless they are stated."""
    times = times or StreamTimes(NO_TIMES, RATE, 0.1, WINDOW)
    choose = partial(chosen_names, channel=channel, speed=None, usual=[])
    return TextParser(choose, times)


def parsed(parser, data, is_end=False):
    """All samples that a parser yields of some bytes."""
    parts = [samples for samples, _ in parser.parts(data, is_end)]
    return np.concatenate(parts, axis=1) if parts else np.empty((0, 0))
