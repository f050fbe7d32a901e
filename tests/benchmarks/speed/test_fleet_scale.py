"""Needs of a fleet follow from the costs of a recording."""

import numpy as np
import pytest

from benchmarks.speed import fleet_scale

pytest.importorskip("distributed")

COSTS = fleet_scale.Costs(
    diagnosis=np.full(4, 0.03),
    scheduling=0.006,
    lists=1e-4,
    start=2.0,
    worker=4e8,
    verdict=1e4,
    file=1e5,
    result=500,
    sent=400,
    returned=2600,
)


def test_limits_are_sorted_by_the_number_of_sensors():
    table = fleet_scale.limits_table(COSTS).set_index("what")
    assert (
        table.index[0] == "cores, if each sensor has a model and a command of its own"
    )
    # 10 000 commands of 2 s in ten minutes, and 4 cores.
    assert table.iloc[0].tolist() == ["33.3", "4", "1,200"]
    assert table.loc["cores of workers"].tolist() == ["0.5", "4", "80,000"]
    assert table.loc["cores of the command and the scheduler", "needed"] == "0.102"
    # 0.1 MB for 4320 recordings of 10 000 sensors.
    assert table.loc["GB of disk, recordings of 30 days", "needed"] == "4,320"


def test_more_workers_wait_for_the_scheduler():
    runs = fleet_scale.runs_table(COSTS).set_index("workers")
    assert runs["all verdicts, s"].tolist()[:2] == ["302", "152"]
    assert runs["all verdicts, s"].tolist()[-2:] == ["62", "62"]
    assert runs.loc[1, "busy"] == "99%" and runs.loc[32, "busy"] == "15%"


@pytest.mark.slow
def test_costs_are_measured(monkeypatch):
    monkeypatch.setattr(fleet_scale, "_IDLE", 0.2)
    costs = fleet_scale.measure(n_recordings=9, n_listed=20)
    assert costs.diagnosis.shape == (9,) and costs.diagnosis.min() > 0
    others = np.array(costs[1:])
    assert np.all(others > 0) and costs.start > 10 * costs.lists
    assert len(fleet_scale.costs_table(costs)) == 9
