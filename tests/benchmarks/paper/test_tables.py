"""The page of the paper's tables shows what the files hold."""

import re

import numpy as np
import pytest
from sklearn.utils import Bunch

from benchmarks.paper import tables as paper_tables
from benchmarks.paper.report import paper_report


@pytest.fixture(scope="module")
def reports(verdicts, halves):
    other = verdicts.assign(predicted=verdicts["predicted"].to_numpy()[::-1])
    return {
        run: paper_report(Bunch(verdicts=verdicts if n else other, halves=halves))
        for n, run in enumerate(paper_tables.runs())
    }


@pytest.fixture(scope="module")
def blocks(reports):
    comparison = paper_tables.compared(reports)
    return paper_tables.blocks(reports["as typed"], "4 windows", comparison)


def test_the_page_has_every_table_with_that_of_the_paper(blocks):
    block = blocks["paper tables as typed"]
    titles = re.findall(r"^\*\*Table (\d(?: by halves)?):", block, flags=re.M)
    assert titles == ["2", "3", "4", "5", "5 by halves", "6", "7", "8", "9"]
    assert len(re.findall(r"^paper|paper:", block, flags=re.M)) >= 9


def test_cells_are_those_of_the_files(blocks, reports):
    (frame,) = [t.frame for t in reports["as typed"] if t.stem == "table2"]
    text = re.search(
        r"Table 2:.*?\n(\|.*?)\n\n", blocks["paper tables as typed"], re.S
    )[1]
    rows = [line.strip("| ").split(" | ") for line in text.split("\n")]
    cells = {row[0]: row[1:] for row in rows}
    assert [float(value) for value in cells["IR-Ball"]] == frame.loc["IR-Ball"].tolist()
    assert cells["Average"][-4:] == ["96.375", "97.875", "76.875", "79.125"]


def test_runs_are_compared_below_the_paper(blocks, reports):
    text = blocks["paper tables compared"].split("Improvement")[1]
    lines = [line.strip("| ").split(" | ") for line in text.split("\n")]
    basis = "rows of Tables 2-5"
    rows = {line[0]: line[2:] for line in lines if line[1:2] == [basis]}
    assert list(rows) == ["paper", *(f"simulated rig, {run}" for run in reports)]
    assert rows["paper"] == ["17.312", "16.375"]
    for run, tables in reports.items():
        (frame,) = [t.frame for t in tables if t.stem == "improvements"]
        shown = np.array(rows[f"simulated rig, {run}"], dtype=float)
        expected = frame.loc[("simulated rig", basis)]
        np.testing.assert_allclose(shown, expected, atol=0.051)
