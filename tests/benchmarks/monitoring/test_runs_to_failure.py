import numpy as np
import pytest

from benchmarks.monitoring import runs_to_failure
from benchmarks.monitoring.runs_to_failure import alarm_row, main, watch_run
from skarxlag.monitoring import MonitorVerdict


def verdict(time, exceeds, alarm):
    fields = (
        0,
        time,
        np.nan,
        "good",
        0.0,
        None,
        None,
        np.nan,
        exceeds,
        alarm,
        0.5,
        np.nan,
        "hold",
    )
    return MonitorVerdict(*fields, alarm_state="on" if alarm else "off")


def test_row_separates_the_alarm_that_stays_from_those_that_went_off():
    alarms = [False, True, False, False, True, True]
    exceeds = [False, True, False, True, True, True]
    verdicts = [
        verdict(10.0 * i, *each)
        for i, each in enumerate(zip(exceeds, alarms, strict=True))
    ]
    row = alarm_row(verdicts, 60.0)
    assert row["alarm, s"] == "40" and row["before the end, s"] == "20"
    assert (
        row["share of the run"] == "0.67" and row["alarms before, that went off"] == 1
    )
    assert row["snapshots that exceed before"] == "0.50"
    assert alarm_row(verdicts[:4], 60.0)["alarm, s"] == "none"


@pytest.fixture(scope="module")
def run():
    """Steady noise, and impacts in the last third."""
    snapshots = np.random.default_rng(0).normal(size=(300, 600))
    snapshots[200:, ::60] += 12
    return snapshots, 10.0 * np.arange(300)


@pytest.mark.slow
def test_alarm_goes_on_after_the_impacts_began(run):
    verdicts, n_healthy = watch_run(*run, 1000.0, 10_000.0)
    row = alarm_row(verdicts, 3000.0)
    assert n_healthy == 30 and len(verdicts) == 270
    assert (
        2000 < float(row["alarm, s"]) < 2600
        and row["alarms before, that went off"] == 0
    )


@pytest.mark.slow
def test_command_writes_the_tables_and_the_figure(run, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(runs_to_failure, "FEW_HEALTHY", (8,))
    path, page, figure = (tmp_path / name for name in ("a.npz", "page.md", "a.svg"))
    snapshots, seconds = run
    np.savez(
        path,
        acceleration_g=snapshots[:, np.newaxis],
        seconds=seconds,
        rpm=1000,
        sampling_rate=10_000.0,
    )
    names = ("runs to failure", "few healthy snapshots")
    marks = [
        f"<!-- {name}: {mark} -->\n" for name in names for mark in ("begin", "end")
    ]
    page.write_text("".join(marks))
    main([str(path), "--write", str(page), "--figure", str(figure)])
    for table in capsys.readouterr().out.strip().split("\n\n"):
        assert table in page.read_text()
    assert (
        "| a | 0 | 30 |" in page.read_text() and figure.read_text().count("<svg") == 1
    )


@pytest.mark.slow
def test_detectors_of_few_healthy_snapshots_are_compared(run, monkeypatch):
    snapshots, seconds = run
    monkeypatch.setattr(runs_to_failure, "FEW_HEALTHY", (2, 8))
    _, n_healthy = watch_run(snapshots, seconds, 1000.0, 10_000.0, most_healthy=8)
    assert n_healthy == 8
    recorded = [
        ("a", np.stack([snapshots, snapshots], axis=1), seconds, 1000.0, 10_000.0)
    ]
    table = runs_to_failure.few_healthy_table(recorded)
    assert table["healthy snapshots"].tolist() == [2, 8]
    assert table["channels"].tolist() == [2, 2]
    assert table["with an alarm at the end"].tolist()[1] == 2
    assert table["earliest, share of the run"].tolist()[1] > "0.66"
