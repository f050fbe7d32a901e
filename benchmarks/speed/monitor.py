"""Rows of the speed benchmark on a running sensor."""

import time

import numpy as np

from benchmarks.speed.peers import is_installed
from benchmarks.speed.rows import coloured_windows, rate
from benchmarks.speed.timing import ratio, take_turns
from skarxlag import ConditionMonitor, make_diagnoser, make_windows
from skarxlag.monitoring.monitor import diagnose_together

_RATE = 25_600.0
_BANDS = 16
#: Running sensors, and the seconds of their blocks.
_SENSORS = {1: (0.1, 1, 10), 50: (0.1, 1, 10), 500: (0.1, 1)}


def monitor(n_rounds=9, n_seconds=10):
    """`ConditionMonitor` on one core: samples a second, latency of a second, channels at once."""
    X, y = coloured_windows(200)
    diagnoser = make_diagnoser().fit(X, y)
    signal = np.random.default_rng(0).normal(size=int(n_seconds * _RATE))
    blocks = np.split(signal, n_seconds)
    windows = make_windows(signal)
    running = ConditionMonitor(diagnoser, _RATE)
    turns = {
        "monitor": lambda: [running.update(block) for block in blocks],
        "block": lambda: running.update(blocks[0]),
        "windows": lambda: diagnoser.diagnose(windows),
    }
    if is_installed("river"):
        stream = river_models(X, y)
        turns["river"] = lambda: [stream(block) for block in blocks]
    seconds = take_turns(turns, n_rounds, clock=time.perf_counter)
    times, differs = ratio(seconds["monitor"], seconds["windows"])
    latency = np.median(seconds["block"])
    what = "`ConditionMonitor.update`, one channel of 25.6 kHz, blocks of 1 s"
    lines = [
        {
            "what": f"{what}: time over `diagnose` on the same windows",
            "ours": rate(signal.size, seconds["monitor"]),
            "peer": f"`diagnose`: {rate(signal.size, seconds['windows'])}",
            "reached": times,
            "spread": differs,
        },
        {
            "what": "the same: channels that one core follows in real time",
            "ours": f"latency of a block of 1 s: {latency * 1e3:.3g} ms",
            "reached": 1 / latency,
        },
    ]
    if "river" in seconds:
        times, differs = ratio(seconds["monitor"], seconds["river"])
        lines.append(
            {
                "what": f"{what}: time over river's classifier and detector on {_BANDS} band "
                "energies of each window",
                "ours": rate(signal.size, seconds["monitor"]),
                "peer": f"river and NumPy: {rate(signal.size, seconds['river'])}",
                "reached": times,
                "spread": differs,
            }
        )
    return lines


def sensors(n_rounds=3, sensors=_SENSORS):
    """Time of `ConditionMonitor` on several sensors, in blocks, over `diagnose` of all windows."""
    X, y = coloured_windows(200)
    diagnoser = make_diagnoser().fit(X, y)
    lines = []
    for n_sensors, lengths in sensors.items():
        running = [ConditionMonitor(diagnoser, _RATE) for _ in range(n_sensors)]
        for seconds_of_block in lengths:
            # As many blocks as make a second, so that each sensor completes a window.
            n_seconds = max(seconds_of_block, 1)
            signal = np.random.default_rng(0).normal(size=int(n_seconds * _RATE))
            blocks = np.split(signal, round(n_seconds / seconds_of_block))
            windows = make_windows(signal)
            turns = {
                # As `skarxlag watch` does it.
                "monitors": lambda blocks=blocks, running=running: [
                    diagnose_together([monitor.cut(block) for monitor in running])
                    for block in blocks
                ],
                "windows": lambda windows=windows, running=running: [
                    diagnoser.diagnose(windows) for _ in running
                ],
            }
            seconds = take_turns(turns, n_rounds)
            times, differs = ratio(seconds["monitors"], seconds["windows"])
            of_sensor = np.median(seconds["monitors"]) / n_sensors / n_seconds
            lines.append(
                {
                    "what": f"`ConditionMonitor.update`, sensors of 25.6 kHz: {n_sensors}, blocks \
of {seconds_of_block:g} s: time over `diagnose` of the same samples, {n_seconds:g} s at once",
                    "ours": f"{1e3 * of_sensor:.3g} ms a second of a sensor",
                    "reached": times,
                    "target": 1.5,
                    "at_most": True,
                    "spread": differs,
                }
            )
    return lines


def river_models(X, y):
    """Return a function of a block that classifies its windows with river, as a user would.

    river takes a dict of features for each sample, so windows and features are the
    user's work: here the logarithms of the energy in bands, by NumPy, for all windows
    of a block at once.
    """
    from river import anomaly, linear_model, preprocessing

    classifier = preprocessing.StandardScaler() | linear_model.LogisticRegression()
    detector = preprocessing.MinMaxScaler() | anomaly.HalfSpaceTrees(seed=0)
    for features, label in zip(_features(X), y, strict=True):
        classifier.learn_one(features, bool(label == y[0]))
        detector.learn_one(features)

    def judge(block):
        return [
            (classifier.predict_proba_one(features), detector.score_one(features))
            for features in _features(make_windows(block))
        ]

    return judge


def _features(windows):
    power = np.abs(np.fft.rfft(windows, axis=1)[:, 1:]) ** 2
    energies = np.log(
        [band.sum(axis=1) for band in np.array_split(power, _BANDS, axis=1)]
    )
    return [dict(enumerate(row)) for row in energies.T.tolist()]
