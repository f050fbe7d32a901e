"""Alarms of a monitor on runs to failure."""

import numpy as np
import pytest

from benchmarks.monitoring import runs_to_failure
from benchmarks.monitoring.runs_to_failure import alarm_row
from skarxlag.monitoring import MonitorVerdict


def verdict(time, exceeds, alarm):
    """Return a verdict on a snapshot; what the rows do not show is empty."""
    empty = dict.fromkeys(MonitorVerdict._fields)
    stated = {"time": time, "exceeds": exceeds, "alarm": alarm}
    stated["alarm_state"] = "on" if alarm else "off"
    return MonitorVerdict(**empty | stated)


def test_row_separates_the_alarm_that_stays_from_those_that_went_off():
    alarms = [False, True, False, False, True, True]
    exceeds = [False, True, False, True, True, True]
    verdicts = [
        verdict(10.0 * number, *state)
        for number, state in enumerate(zip(exceeds, alarms, strict=True))
    ]
    row = alarm_row(verdicts, 60.0)
    assert row["alarm, s"] == "40" and row["before the end, s"] == "20"
    assert row["share of the run"] == "0.67"
    assert row["alarms before, that went off"] == 1
    assert row["snapshots that exceed before"] == "0.50"
    assert alarm_row(verdicts[:4], 60.0)["alarm, s"] == "none"


@pytest.mark.slow
def test_an_alarm_goes_on_after_the_impacts_began(monkeypatch):
    snapshots = np.random.default_rng(0).normal(size=(150, 1, 600))
    snapshots[100:, :, ::60] += 12
    monkeypatch.setattr(runs_to_failure, "FEW_HEALTHY", (8,))
    run = ("a", snapshots, 10.0 * np.arange(150), 1000.0, 10_000.0)
    (row,) = runs_to_failure.few_healthy_table([run]).to_dict("records")
    assert (row["healthy snapshots"], row["channels"]) == (8, 1)
    assert row["with an alarm at the end"] == 1
    assert "0.66" < row["earliest, share of the run"] < "0.9"
