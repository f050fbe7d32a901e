"""False-alarm and missed-detection rates of calibrated detectors at every speed."""

from functools import partial

import numpy as np
import pandas as pd
from sklearn.pipeline import make_pipeline

from benchmarks.cross_speed.protocol import check_rig, first_and_second_half
from benchmarks.pages.blocks import markdown
from skarxlag import ARXLaguerre, FaultDetector, PIObserver, ThresholdLadder, make_diagnoser

RATES = (0.01, 0.05)


def fault_detector(X, y, healthy, rate, *, unit_rms):
    """Alarms of the `FaultDetector` that is calibrated on the healthy windows of X."""
    detector = make_pipeline(
        ARXLaguerre(unit_rms=unit_rms), PIObserver(), FaultDetector(false_alarm_rate=rate)
    ).fit(X[y == healthy])
    return lambda windows: detector.predict(windows) == -1


def ladder_gamma(X, y, healthy, rate):
    """Alarms of the ladder's Gamma on a bank of residuals in the sensor's unit."""
    ladder = make_pipeline(
        ARXLaguerre(unit_rms=False),
        PIObserver(),
        ThresholdLadder(healthy=healthy, false_alarm_rate=rate),
    ).fit(X, y)
    return lambda windows: ladder[-1].detect(ladder[:-1].transform(windows))


def diagnoser_gamma(X, y, healthy, rate):
    """Alarms of the Gamma that `make_diagnoser` comes with."""
    diagnoser = make_diagnoser(healthy=healthy)
    diagnoser.set_params(decide__false_alarm_rate=rate).fit(X, y)
    return lambda windows: diagnoser["decide"].detect(diagnoser[:-1].transform(windows))


DETECTORS = {
    "FaultDetector, sensor's unit": ("highest", partial(fault_detector, unit_rms=False)),
    "ladder's Γ, sensor's unit": ("highest", ladder_gamma),
    "FaultDetector, sensor's unit, at the lowest speed": (
        "lowest",
        partial(fault_detector, unit_rms=False),
    ),
    "FaultDetector, windows of unit RMS": ("highest", partial(fault_detector, unit_rms=True)),
    "Γ of make_diagnoser, windows of unit RMS": ("highest", diagnoser_gamma),
}


def detection_rates(rig, window_length):
    """Rates on second halves of each detector, at each speed and stated false-alarm rate."""
    check_rig(rig, window_length)
    first, second = first_and_second_half(rig.recording, rig.start, window_length)
    healthy, speeds = rig.target_names[0], np.unique(rig.rpm)
    rows = []
    for name, (where, calibrate) in DETECTORS.items():
        train = first & (rig.rpm == (speeds[-1] if where == "highest" else speeds[0]))
        for rate in RATES:
            alarm = calibrate(rig.data[train], rig.target[train], healthy, rate)
            for speed in speeds:
                test = second & (rig.rpm == speed)
                alarms, faulty = alarm(rig.data[test]), rig.target[test] != healthy
                rows.append(
                    {
                        "detector": name,
                        "stated": rate,
                        "healthy windows": int(np.sum(rig.target[train] == healthy)),
                        "rpm": speed,
                        "false_alarms": alarms[~faulty].mean(),
                        "missed": 1 - alarms[faulty].mean(),
                    }
                )
    return pd.DataFrame(rows)


def detection_table(rates):
    """Markdown: a table for each rig, a column for each speed, false alarms / missed."""
    parts = [
        "Made by `python -m benchmarks.recipe confidence`. Calibrated on first halves at the "
        "highest speed where nothing else is said; measured on second halves. In each cell the "
        "share of healthy windows that raise an alarm / the share of faulty windows that raise "
        "none."
    ]
    for rig, rows in rates.groupby("rig", sort=False):
        lines = []
        for (detector, stated), group in rows.groupby(["detector", "stated"], sort=False):
            cells = {
                f"{row.rpm:g} rpm": f"{row.false_alarms:.3f} / {row.missed:.3f}"
                for row in group.itertuples()
            }
            lines.append({"detector": detector, "stated rate": f"{stated:g}", **cells})
        count = rows["healthy windows"].iloc[0]
        parts.append(f"**{rig}**, {count} healthy windows to calibrate on")
        parts.append(markdown(pd.DataFrame(lines)))
    return "\n\n".join(parts)
