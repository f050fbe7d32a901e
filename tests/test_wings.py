"""The two wings of the package: the library, and its first user in ``skarxlag.plant``."""

import ast
from pathlib import Path

import pandas as pd
import pytest

import skarxlag

from .weight import LIMITS, exceeded, weigh, weights

PACKAGE = Path(skarxlag.__file__).parent
#: The starting point of the shell, and the lazy names of the package.
_DOORS = {"__main__.py", "__init__.py"}
LIBRARY = [
    path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.relative_to(PACKAGE).parts[0] not in {"plant", *_DOORS}
]


def imported(path):
    """Return the absolute names of the modules that a module imports."""
    package = ["skarxlag", *path.relative_to(PACKAGE).parts[:-1]]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        if isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            names = [*above, *([node.module] if node.module else [])]
            yield from (".".join([*names, each.name]) for each in node.names)


@pytest.mark.parametrize("path", LIBRARY, ids=lambda path: path.stem)
def test_the_library_does_not_import_the_plant(path):
    names = list(imported(path))
    assert [name for name in names if name.startswith("skarxlag.plant")] == []


def test_imports_of_the_plant_would_be_seen():
    of_commands = set(imported(PACKAGE / "__main__.py"))
    assert any(name.startswith("skarxlag.plant") for name in of_commands)


def test_no_wing_grows():
    sums = weights().groupby("wing")["tokens"].sum()
    assert {wing: n for wing, n in sums.items() if n > LIMITS[wing]} == {}


def test_tokens_are_counted_without_docstrings_comments_and_layout():
    source = '"""Module."""\n\n\nclass A:\n    """A."""\n\n    b = "text"  # why\n'
    assert weigh(source) == (6, 2)


def test_each_budget_is_checked():
    rows = [
        ("library", 100_000, 20_000),
        ("plant", 30_000, 3_000),
        ("tests", 170_000, 50_000),
        ("benchmarks", 50_000, 10_000),
    ]
    modules = pd.DataFrame(rows, columns=["wing", "tokens", "lines"])
    assert exceeded(modules) == [
        "library: 100000 tokens, expected at most 80000",
        "tests: 170000 tokens, expected at most 169000",
        "plant: 10.00 tokens a line, expected at most 9",
    ]
