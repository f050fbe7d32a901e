import re
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.paper import tables as paper_tables
from benchmarks.paper.ladders import LADDERS

PAGE = Path(__file__).parents[3] / "docs" / "paper" / "tables.md"
BLOCKS = ["compared", *paper_tables.SHOWN]
LENGTHS = (400, 2400, 800, 4000, 1000, 2000)
#: Runs whose tables are written here; the others differ from them by their diagnosers
#: only.
WRITTEN = [*paper_tables.SHOWN, "bank, all by power"]


def test_long_window_holds_three_impacts_of_the_slowest_defect():
    # Outer ring of 9 balls of 7.94 mm on 39.04 mm, at 5 turns a second.
    impacts_per_second = 9 * 5 / 2 * (1 - 7.94 / 39.04)
    needed = 3 * 250_000 / impacts_per_second
    length = paper_tables.window_of_impacts(3)
    assert needed <= length < needed + 1200 and length % 1200 == 0
    assert paper_tables.window_of_impacts(1) < length


def test_runs():
    runs = paper_tables.runs(*LENGTHS)
    makers = {name: diagnosers for name, (_, diagnosers) in runs.items()}
    assert list(makers)[:4] == BLOCKS[1:]
    assert {**makers["stretches"], "Diagnoser": None} == {
        **LADDERS["bank"],
        "Diagnoser": None,
    }
    ours = makers["stretches"]["Diagnoser"](healthy="Normal")
    assert ours["decide"].residual.order_residual.sampling_rate == 250_000
    assert ours["decide"].healthy == "Normal"
    assert makers["bank"] is makers["long windows"] is LADDERS["bank"]
    assert makers["single residual"] is LADDERS["single"]
    unit = makers["single residual, unit windows"]["ALPIO"](healthy="Normal")
    assert unit["identify"].unit_rms and unit["identify"].healthy == "Normal"
    by_power = makers["bank, all by power"]
    assert list(by_power) == ["ALPIO", "Extended state"]
    for make in by_power.values():
        assert make(healthy="Normal")["observe"].evaluation == "power"
    assert by_power["Extended state"](healthy="Normal")["observe"].saturation == 1
    assert not makers["single residual"]["ALPIO"](healthy="Normal")["identify"].unit_rms
    lengths = {name: load(6, 500).data.shape for name, (load, _) in runs.items()}
    assert lengths.pop("long windows") == (40, 2, 800)
    assert lengths.pop("stretches") == (16, 2, 1000)
    assert set(lengths.values()) == {(48, 2, 400)}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("paper-tables")
    runs = paper_tables.runs
    page = folder / "page.md"
    marks = [
        f"<!-- paper tables {name}: {end} -->"
        for name in BLOCKS
        for end in ("begin", "end")
    ]
    page.write_text("\n".join(marks))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paper_tables, "PAPER_WINDOW", 400)
        patch.setattr(paper_tables, "PAPER_SAMPLES", 1600)
        patch.setattr(paper_tables, "LONG_WINDOWS", 2)
        patch.setattr(paper_tables, "window_of_impacts", lambda n: 800)
        # The runs share most rigs.
        patch.setattr(paper_tables, "_simulate", cache(paper_tables._simulate))
        # Stretches of several turns would take long.
        patch.setattr(paper_tables, "STRETCHES", 2)
        patch.setattr(paper_tables, "STRETCH_SECONDS", 1000 / 250_000)
        patch.setattr(paper_tables, "stretch_diagnoser", LADDERS["bank"]["Diagnoser"])
        patch.setattr(
            paper_tables, "runs", lambda *n: {run: runs(*n)[run] for run in WRITTEN}
        )
        paper_tables.main(["--output", str(folder / "csv"), "--write", str(page)])
    return folder


def blocks(page):
    found = re.findall(
        r"<!-- paper tables ([\w ]+): begin -->\n(.*?)\n<!-- paper tables \1: end -->",
        page.read_text("utf-8"),
        flags=re.S,
    )
    assert [name for name, _ in found] == BLOCKS
    return dict(found)


@pytest.mark.slow
def test_every_run_has_every_table(written):
    for name, block in blocks(written / "page.md").items():
        if name == "compared":
            continue
        sizes = {"long windows": "2 windows of 800", "stretches": "2 windows of 1000"}
        size = sizes.get(name, "4 windows of 400")
        assert f"Simulated rig, {size} samples for each condition and speed." in block
        titles = re.findall(r"^<summary>Table (\d(?: by halves)?):", block, flags=re.M)
        assert titles == ["2", "3", "4", "5", "5 by halves", "6", "7"]
        assert bool(re.search(r"^paper|paper:", block, flags=re.M)) == (name == "bank")
        assert block.count("<details>") == block.count("</details>") == len(titles)
        assert ("Diagnoser" in block) == (name != "single residual")


def test_cells_are_those_of_the_files(written):
    block = blocks(written / "page.md")["bank"]
    frame = pd.read_csv(written / "csv" / "bank_table2.csv", index_col="condition")
    _, head, rule, *rows = re.search(r"Table 2:.*?(\n\|.*?)\n\n", block, flags=re.S)[
        1
    ].split("\n")
    cells = {
        row.split(" | ")[0].strip("| "): row.strip("| ").split(" | ")[1:]
        for row in rows
    }
    names = head.strip("| ").split(" | ")
    heads = [
        name.replace("paper,", "paper:").replace("simulated rig, ", "")
        for name in frame
    ]
    assert names[-10:] == [head.replace(",", "") for head in heads]
    assert rule.count("---:") == 10
    assert [float(value) for value in cells["IR-Ball"]] == frame.loc["IR-Ball"].tolist()
    assert cells["Average"][-4:] == ["96.375", "97.875", "76.875", "79.125"]


def test_runs_are_compared_below_the_paper(written):
    block = blocks(written / "page.md")["compared"]
    frames = {
        run: pd.read_csv(written / "csv" / f"{stem}_improvements.csv", index_col=[0, 1])
        for run, stem in {"bank": "bank", "long windows": "long-windows"}.items()
    }
    rows = [
        line.strip("| ").split(" | ")
        for line in block.split("Improvement")[1].split("\n")
    ]
    rows = {tuple(row[:2]): row[2:] for row in rows if len(row) == 4}
    assert rows["paper", "rows of Tables 2-5"] == ["17.312", "16.375"]
    for run, frame in frames.items():
        own = frame.loc[("simulated rig", "rows of Tables 2-5")]
        shown = rows[f"simulated rig, {run}", "rows of Tables 2-5"]
        np.testing.assert_allclose(np.array(shown, dtype=float), own, atol=0.051)
    sources = [source for source, basis in rows if basis == "rows of Tables 2-5"]
    assert sources == ["paper", *(f"simulated rig, {run}" for run in WRITTEN)]
