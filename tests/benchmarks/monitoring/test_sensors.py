import sys

import pytest

from benchmarks.monitoring import sensors

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="measures a child by wait4"
)


@pytest.mark.slow
def test_two_sensors(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sensors, "SHORT", 1)
    monkeypatch.setattr(sensors, "LONG", 4)
    run = sensors._run

    def shortened(folder, integers, count, seconds, files):
        """Return invented figures for all runs but one, because each takes seconds."""
        is_run = seconds == 4 and files == "csv"
        return (
            run(folder, integers, count, seconds, files)
            if is_run
            else (300.0, 0.1 * seconds)
        )

    monkeypatch.setattr(sensors, "_run", shortened)
    page = tmp_path / "page.md"
    name = "sensors in one process"
    page.write_text(
        f"x\n<!-- {name}: begin -->\n<!-- {name}: end -->\n", encoding="utf-8"
    )
    sensors.main(["--sensors", "2", "--write", str(page)])
    table = capsys.readouterr().out.strip()
    assert table in page.read_text("utf-8")
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in table.splitlines()
    ]
    assert [row[:2] for row in rows[2:]] == [["csv", "2"], ["raw", "2"]]
    assert all(100 < float(memory) < 2000 for _, _, memory, _ in rows[2:])
    # .3 s more of processor time for 3 s more of signal.
    assert float(rows[3][3]) == 0.1
