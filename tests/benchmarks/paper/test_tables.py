"""The page of the paper's tables shows what the files hold."""

import re

import pytest
from sklearn.utils import Bunch

from benchmarks.paper import tables as paper_tables
from benchmarks.paper.report import paper_report


@pytest.fixture(scope="module")
def reports(verdicts, halves):
    other = verdicts.assign(predicted=verdicts["predicted"].to_numpy()[::-1])
    return {
        run: paper_report(Bunch(verdicts=verdicts if n else other, halves=halves))
        for n, run in enumerate(paper_tables.SHOWN)
    }


@pytest.fixture(scope="module")
def blocks(reports):
    sizes = dict.fromkeys(reports, "4 windows of 400 samples")
    return paper_tables.blocks(reports, sizes, paper_tables.compared(reports))


def test_long_window_holds_three_impacts_of_the_slowest_defect():
    # Outer ring of 9 balls of 7.94 mm on 39.04 mm, at 5 revolutions a second.
    impacts_per_second = 9 * 5 / 2 * (1 - 7.94 / 39.04)
    needed = 3 * 250_000 / impacts_per_second
    length = paper_tables.window_of_impacts(3)
    assert needed <= length < needed + 1200 and length % 1200 == 0


@pytest.mark.parametrize("run", paper_tables.SHOWN)
def test_every_run_has_every_table_and_the_first_one_has_the_paper(blocks, run):
    block = blocks[f"paper tables {run}"]
    titles = re.findall(r"^<summary>Table (\d(?: by halves)?):", block, flags=re.M)
    assert titles == ["2", "3", "4", "5", "5 by halves", "6", "7"]
    is_first = run == paper_tables.SHOWN[0]
    assert bool(re.search(r"^paper|paper:", block, flags=re.M)) == is_first


def test_cells_are_those_of_the_files(blocks, reports):
    (frame,) = [t.frame for t in reports["bank"] if t.stem == "table2"]
    text = re.search(r"Table 2:.*?\n(\|.*?)\n\n", blocks["paper tables bank"], re.S)[1]
    rows = [line.strip("| ").split(" | ") for line in text.split("\n")]
    cells = {row[0]: row[1:] for row in rows}
    assert [float(value) for value in cells["IR-Ball"]] == frame.loc["IR-Ball"].tolist()
    assert cells["Average"][-4:] == ["96.375", "97.875", "76.875", "79.125"]
