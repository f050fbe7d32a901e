"""The list of errata: complete entries, tests that exist, and a page that is made of it."""

import ast
import json
import runpy
from pathlib import Path

import pytest

from tests.paper import test_errata_tables as tables

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "docs" / "paper"
DATA = json.loads((PAPER / "errata.json").read_text("utf-8"))
ENTRIES = DATA["entries"]
KEYS = {"id", "part", "title", "where", "kind", "printed", "problem", "corrected"}
KEYS |= {"severity", "check", "tests"}


def test_page_is_what_the_data_give():
    page = runpy.run_path(str(PAPER / "make_errata.py"))["page"]
    written = (PAPER / "errata.md").read_text("utf-8")
    assert written == page(DATA), "run python docs/paper/make_errata.py"


def test_numbers_run_through_the_page():
    assert [entry["id"] for entry in ENTRIES] == [f"E{n:02d}" for n in range(1, len(ENTRIES) + 1)]
    parts = list(DATA["parts"])
    places = [parts.index(entry["part"]) for entry in ENTRIES]
    assert places == sorted(places)


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry["id"])
def test_entry_is_complete(entry):
    optional = {"doubt", "table", "method", "crack_mm", "cells"}
    assert set(entry) - optional == KEYS
    assert entry["severity"] in DATA["severities"]
    assert entry["check"] in DATA["checks"]
    assert bool(entry["tests"]) == (entry["check"] != "read")


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry["id"])
def test_tests_of_entry_exist(entry):
    for name in entry["tests"]:
        file, _, function = name.partition("::")
        tree = ast.parse((ROOT / file).read_text("utf-8"))
        assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_every_severity_and_check_is_used():
    assert {entry["severity"] for entry in ENTRIES} == set(DATA["severities"])
    assert {entry["check"] for entry in ENTRIES} == set(DATA["checks"])


def test_listed_averages_are_those_that_the_rows_contradict():
    listed = {
        (entry["table"], entry["method"], entry["crack_mm"]): (entry["printed"], entry["corrected"])
        for entry in ENTRIES
        if entry["kind"] == "average"
    }
    assert listed == tables.WRONG_AVERAGES


def test_listed_cells_are_those_that_differ():
    (listed,) = (entry["cells"] for entry in ENTRIES if "cells" in entry)
    assert listed == tables.differing_cells()
