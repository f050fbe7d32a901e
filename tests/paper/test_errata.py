"""The page of errata: complete entries in order, tests that exist, counts and tables that hold."""

import ast
import re
from collections import Counter
from pathlib import Path

import pytest

from .printed import WRONG_AVERAGES, differing_cells

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "paper" / "errata.md").read_text("utf-8")
INTRODUCTION, *SECTIONS = re.split(r"^### ", PAGE, flags=re.M)
#: Where: **severity**, check by `test`, `test`.
STATEMENT = re.compile(
    r"^\S.*: \*\*([\w ]+)\*\*, (\w+)(?: by (`\w+`(?:, `\w+`)*))?\.$", re.M
)
TESTS = {
    node.name
    for path in (ROOT / "tests").rglob("test_*.py")
    if path.parent.name in ("paper", "kernels")
    for node in ast.parse(path.read_text("utf-8")).body
    if isinstance(node, ast.FunctionDef)
}


def cells(text):
    """Cells of the Markdown tables in a text, without their heads."""
    rows = [
        line.strip("| ").split(" | ")
        for line in text.splitlines()
        if line.startswith("|")
    ]
    return [row for row in rows if not set(row[0]) <= set("-:")][1:]


def counts(head):
    """Names and stated numbers of the table in the introduction that begins with this head."""
    return {
        row[0]: int(row[-1])
        for row in cells(re.search(rf"\| {head} .*?\n\n", PAGE, re.S)[0])
    }


def numbers(section):
    """Numbers of the entries that a section holds."""
    first, last = re.match(r"E(\d\d)(?: to E(\d\d))? ", section).groups()
    return range(int(first), int(last or first) + 1)


def test_numbers_run_through_the_page():
    listed = [number for section in SECTIONS for number in numbers(section)]
    assert listed == list(range(1, len(listed) + 1))


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section[:3])
def test_entry_is_complete_and_its_tests_exist(section):
    ((severity, check, named),) = STATEMENT.findall(section)
    assert severity in counts("severity") and check in counts("check")
    assert bool(named) == (check != "read")
    assert set(re.findall(r"`(\w+)`", named)) <= TESTS
    labels = re.findall(r"^- (\w+): \S", section, flags=re.M)
    if len(numbers(section)) == 1:
        assert labels in (
            required := ["Printed", "Problem", "Instead"],
            [*required, "Doubt"],
        )


def test_stated_counts_are_those_of_the_entries():
    statements = [
        STATEMENT.search(section) for section in SECTIONS for _ in numbers(section)
    ]
    assert counts("severity") == Counter(each[1] for each in statements)
    assert counts("check") == Counter(each[2] for each in statements)


def test_listed_averages_are_those_that_the_rows_contradict():
    (section,) = (each for each in SECTIONS if "Averages of Tables 2 to 5" in each)
    listed = {}
    for number, (label, where, *figures) in zip(
        numbers(section), cells(section), strict=True
    ):
        assert label == f"E{number}"
        table, method, crack = where.split(", ")
        key = (table.lower().replace(" ", ""), method, int(crack.removesuffix(" mm")))
        listed[key] = tuple(map(float, figures))
    assert listed == WRONG_AVERAGES


def test_listed_cells_are_those_that_differ():
    (section,) = (each for each in SECTIONS if "Cells with two values" in each)
    listed = cells(section)
    assert listed == [list(map(str, cell.values())) for cell in differing_cells()]
