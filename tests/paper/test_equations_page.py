"""Pages on the paper: all equations covered, all names real, all links alive."""

import ast
import inspect
import re
from importlib import import_module
from pathlib import Path

import pytest

import skarxlag

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
EQUATIONS = (DOCS / "paper" / "equations.md").read_text("utf-8")
SECTIONS = dict(
    re.findall(r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", EQUATIONS, flags=re.S | re.M)
)
PAGES = [
    DOCS / "method.md",
    *(DOCS / "paper" / f"{name}.md" for name in ("index", "equations", "observers")),
]
PAGES.append(DOCS / "paper" / "errata.md")
ALL = [f"({n})" for n in range(1, 33)] + [f"A-{n}" for n in range(1, 10)]


def numbers(label):
    """Equations that a heading names: '(12)-(15) Matrices' and 'A-6 to A-9 Lyapunov function'."""
    label = re.sub(r"(?<=\d) to (?=A-)", ")-(", label).replace("A-", "A")
    ranges = re.findall(r"(A?)(\d+)(?:\)-\(A?(\d+))?", label)
    return [
        f"A-{n}" if appendix else f"({n})"
        for appendix, first, last in ranges
        for n in range(int(first), int(last or first) + 1)
    ]


def item(section, name):
    """Text of one list item of a section."""
    return re.search(rf"^- {name}: (.*?)(?=^- |^\n|\Z)", section, flags=re.S | re.M)[1]


def resolve(name):
    """Object of the package behind a dotted name; kernels are modules."""
    head, *rest = name.split(".")
    if head == "kernels":
        public = import_module(f"skarxlag.kernels.{rest[0]}")
        rest = rest[1:]
    else:
        assert head in skarxlag.__all__
        public = getattr(skarxlag, head)
    for part in rest:
        public = getattr(public, part)
    return public


def inline_formulas(text):
    without_blocks = re.sub(r"\$\$.*?\$\$", "", text, flags=re.S)
    return re.findall(r"\$([^$]+)\$", without_blocks)


def test_every_equation_has_one_section():
    assert sorted(ALL) == sorted(n for label in SECTIONS for n in numbers(label))


@pytest.mark.parametrize("label", SECTIONS)
def test_section_names_status_functions_and_tests(label):
    section = SECTIONS[label]
    status = re.match(r"\nStatus: \*\*(.*?)\*\*", section)[1]
    assert status in re.findall(r"^- \*\*(.*?)\*\*", EQUATIONS, flags=re.M)
    assert status == "as printed" or "errata.md#" in item(section, "Errata")
    functions = re.findall(r"`([^`]+)`", item(section, "Computed by"))
    assert functions or status == "not used"
    for name, _, arguments in (each.partition("(") for each in functions):
        computed_by = resolve(name)
        assert callable(computed_by)
        named = arguments.rstrip(")").split(", ") if arguments else []
        assert set(named) <= set(inspect.signature(computed_by).parameters)
    tests = re.findall(r"`(\w+)` \(`([\w/.]+)`\)", item(section, "Tested by"))
    assert len(tests) == section.count("`tests/") > 0
    for function, file in tests:
        tree = ast.parse((ROOT / file).read_text("utf-8"))
        assert function in {
            node.name for node in tree.body if isinstance(node, ast.FunctionDef)
        }


def test_overview_has_every_table_and_figure():
    overview = (DOCS / "paper" / "index.md").read_text("utf-8")
    for kind, last in (("Table", 9), ("Figure", 19)):
        labels = re.findall(rf"^\| {kind}s? ([\d, -]+) \|", overview, flags=re.M)
        spans = [part.split("-") for label in labels for part in label.split(", ")]
        listed = [n for span in spans for n in range(int(span[0]), int(span[-1]) + 1)]
        assert sorted(listed) == list(range(1, last + 1))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_formulas_survive_markdown(page):
    # A bar ends a table's cell; code hosts take a backslash before punctuation for an
    # escape.
    text = page.read_text("utf-8")
    rows = re.findall(r"^\|.*\|$", text, flags=re.M)
    assert not [
        row
        for row in rows
        if any("|" in each for each in re.findall(r"\$[^$]+\$", row))
    ]
    if page.parent.name == "paper":
        assert not [
            each for each in inline_formulas(text) if re.search(r"\\[^a-zA-Z]", each)
        ]
