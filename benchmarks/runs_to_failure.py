"""Alarms and names in runs of a bearing from healthy to failed.

The folder ``femto`` holds a file of snapshots for each run. The first tenth of a run is
taken for healthy. The rest goes through `ConditionMonitor` as it came: with a detector,
which raises an alarm, and with the bearing, whose combs name a fault.
"""

import os
import warnings
from pathlib import Path

import numpy as np

from skarxlag import BearingGeometry, ConditionMonitor, make_detector, make_diagnoser

BEARING = BearingGeometry(n_elements=13, element_diameter=3.5, pitch_diameter=25.6)
HEALTHY_SHARE = 0.1
#: The lowest rate that about 20 healthy snapshots support, as a round number.
FALSE_ALARM_RATE = 0.05
#: Hours of signal. With a tenth of a second in ten seconds, 100 hours of a run.
FALSE_ALARM_INTERVAL = 1.0
#: Seconds in which the weight of the combs of a snapshot halves.
HALF_LIFE = 100.0
#: Numbers of healthy snapshots of the fit; None is all.
HEALTHY_SNAPSHOTS = (None, 5, 10)


def lines(home=None, runs=None):
    """Yield the alarm of each run and channel, and the fault that is named at its end."""
    folder = Path(home or os.environ.get("SKARXLAG_DATA", ".")) / "femto"
    for path in sorted(folder.glob("*.npz")):
        if runs is not None and path.stem not in runs:
            continue
        with np.load(path) as content:
            signal = content["acceleration_g"].astype(float)
            seconds = content["seconds"]
            rpm, rate = float(content["rpm"]), float(content["sampling_rate"])
        end = seconds[-1] + signal.shape[2] / rate
        for channel in range(signal.shape[1]):
            watched = (signal[:, channel], seconds, rpm, rate)
            facts = {"run": path.stem, "channel": channel}
            for n_healthy in HEALTHY_SNAPSHOTS:
                fitted = {"method": "detector", "healthy snapshots": n_healthy or "all"}
                yield facts | fitted | alarm(_watched(*watched, n_healthy), end)
            named = {"method": "bearing", "healthy snapshots": "all"}
            yield facts | named | name(_named(*watched), end)


def _watched(snapshots, seconds, rpm, rate, n_healthy):
    is_healthy = seconds < HEALTHY_SHARE * seconds[-1]
    detector = make_detector(false_alarm_rate=FALSE_ALARM_RATE, fixed_gain=True)
    with warnings.catch_warnings():
        # A run has one speed and few healthy snapshots.
        warnings.simplefilter("ignore", UserWarning)
        detector.fit(snapshots[is_healthy][:n_healthy], rpm=rpm)
    monitor = ConditionMonitor(
        None,
        rate,
        detector=detector,
        window_length=snapshots.shape[1],
        false_alarm_interval=FALSE_ALARM_INTERVAL,
    )
    return _updated(monitor, snapshots[~is_healthy], seconds[~is_healthy], rpm)


def _named(snapshots, seconds, rpm, rate):
    is_healthy = seconds < HEALTHY_SHARE * seconds[-1]
    diagnoser = make_diagnoser(bearing=BEARING, sampling_rate=rate)
    labels = np.full(is_healthy.sum(), "healthy")
    diagnoser.fit(snapshots[is_healthy], labels, rpm=rpm)
    monitor = ConditionMonitor(
        diagnoser, rate, window_length=snapshots.shape[1], half_life=HALF_LIFE
    )
    return _updated(monitor, snapshots[~is_healthy], seconds[~is_healthy], rpm)


def _updated(monitor, snapshots, seconds, rpm):
    verdicts = []
    for snapshot, start in zip(snapshots, seconds, strict=True):
        verdicts += monitor.update(snapshot, time=float(start), rpm=rpm)
    return verdicts


def alarm(verdicts, end):
    """Return when the alarm that lasts to the end of a run went on.

    Returns
    -------
    dict
        ``alarm``, seconds before the end, none if it is off; ``before``, the alarms that
        went off again; ``exceed``, the share of snapshots that exceed the threshold
        before.
    """
    is_on = np.array([verdict.alarm for verdict in verdicts])
    exceeds = np.array([bool(verdict.exceeds) for verdict in verdicts])
    on = np.flatnonzero(np.diff(is_on.astype(int), prepend=0) == 1)
    lasts = len(on) > 0 and is_on[-1]
    last = on[-1] if lasts else len(is_on)
    return {
        "alarm": round(end - verdicts[last].time) if lasts else None,
        "before": len(on) - lasts,
        "exceed": round(float(exceeds[:last].mean()), 3) if last else 0.0,
    }


def name(verdicts, end):
    """Return the name at the end of a run, and for how many seconds it stayed."""
    names = np.array([str(verdict.verdict) for verdict in verdicts])
    others = np.flatnonzero(names != names[-1])
    first = others[-1] + 1 if len(others) else 0
    return {"name": names[-1], "since": round(end - verdicts[first].time)}
