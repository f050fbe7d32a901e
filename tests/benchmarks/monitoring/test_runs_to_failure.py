import numpy as np
import pytest

from benchmarks.monitoring.runs_to_failure import alarm_row, main, watch_run
from skarxlag.monitoring import MonitorVerdict


def verdict(time, exceeds, alarm):
    fields = (0, time, np.nan, "good", 0.0, None, None, np.nan, exceeds, alarm, 0.5, np.nan, "hold")
    return MonitorVerdict(*fields, alarm_state="on" if alarm else "off")


def test_row_separates_the_alarm_that_stays_from_those_that_went_off():
    alarms = [False, True, False, False, True, True]
    exceeds = [False, True, False, True, True, True]
    verdicts = [
        verdict(10.0 * i, *each) for i, each in enumerate(zip(exceeds, alarms, strict=True))
    ]
    row = alarm_row(verdicts, 60.0)
    assert row["alarm, s"] == "40" and row["before the end, s"] == "20"
    assert row["share of the run"] == "0.67" and row["alarms before, that went off"] == 1
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
    assert 2000 < float(row["alarm, s"]) < 2600 and row["alarms before, that went off"] == 0


@pytest.mark.slow
def test_command_writes_the_table_and_the_figure(run, tmp_path, capsys):
    path, page, figure = (tmp_path / name for name in ("a.npz", "page.md", "a.svg"))
    snapshots, seconds = run
    np.savez(
        path,
        acceleration_g=snapshots[:, np.newaxis],
        seconds=seconds,
        rpm=1000,
        sampling_rate=10_000.0,
    )
    blocks = ("runs to failure", "few healthy snapshots")
    page.write_text("\n".join(f"<!-- {name}: begin -->\n<!-- {name}: end -->" for name in blocks))
    main([str(path), "--write", str(page), "--figure", str(figure)])
    printed = capsys.readouterr().out.strip().split("\n\n")
    assert len(printed) == len(blocks)
    assert all(block in page.read_text() for block in printed)
    assert "| a | 0 | 30 |" in page.read_text() and figure.read_text().count("<svg") == 1
