import sys

import pytest

from benchmarks.monitoring import sensors

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="measures a child by wait4")


@pytest.mark.slow
def test_two_sensors(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sensors, "SHORT", 1)
    monkeypatch.setattr(sensors, "LONG", 4)
    page, name = tmp_path / "page.md", "sensors in one process"
    page.write_text(f"x\n<!-- {name}: begin -->\n<!-- {name}: end -->\n", encoding="utf-8")
    sensors.main(["--sensors", "2", "--write", str(page)])
    table = capsys.readouterr().out.strip()
    assert table in page.read_text("utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    assert [row[:2] for row in rows[2:]] == [["csv", "2"], ["raw", "2"]]
    assert all(100 < float(memory) < 2000 for _, _, memory, _ in rows[2:])
