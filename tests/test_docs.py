"""README, docs and examples run as they stand."""

import doctest
import inspect
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from skarxlag.datasets import simulate_rig

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def _name(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_blocks_of_page(page):
    text = page.read_text(encoding="utf-8")
    parsed = doctest.DocTestParser().get_doctest(text, {}, page.name, str(page), 0)
    assert bool(parsed.examples) == ("```pycon" in text)
    report = []
    doctest.DocTestRunner(optionflags=OPTIONS).run(parsed, out=report.append)
    assert not report, "".join(report)


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_blocks_end_with_an_empty_line(page):
    # Otherwise doctest takes the closing fence for expected output.
    blocks = re.findall(r"^```pycon\n(.*?)^```$", page.read_text("utf-8"), flags=re.S | re.M)
    assert all(block.endswith("\n\n") for block in blocks)


@pytest.mark.parametrize("page", sorted(ROOT.glob("*.md")) + PAGES[1:], ids=_name)
def test_links_within_the_repository(page):
    prose = re.sub(r"\$+[^$]*\$+", "", page.read_text("utf-8"))
    targets = re.findall(r"\]\((?!https?:)([^)#]*)(?:#[^)]*)?\)", prose)
    missing = [each for each in targets if each and not (page.parent / each).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_anchors(page):
    text = page.read_text("utf-8")
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#]*)#([^)]*)\)", text):
        other = (page.parent / target if target else page).read_text("utf-8")
        headings = re.findall(r"^#+ (.*)$", other, flags=re.M)
        slugs = [re.sub(r"[^\w -]", "", each).lower().replace(" ", "-") for each in headings]
        assert anchor in slugs


@pytest.mark.parametrize("example", EXAMPLES, ids=_name)
def test_example(example, monkeypatch, capsys):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.setattr(pyplot, "show", lambda: None)
    runpy.run_path(str(example), run_name="__main__")
    pyplot.close("all")
    assert capsys.readouterr().out


def test_readme_has_a_place_for_the_cross_speed_table():
    text = (ROOT / "README.md").read_text("utf-8")
    marks = [f"<!-- cross-speed overview: {mark} -->" for mark in ("begin", "end")]
    assert [text.count(mark) for mark in marks] == [1, 1]
    assert text.index(marks[0]) < text.index(marks[1])


def test_every_parameter_of_the_simulated_rig_is_in_its_table():
    text = (ROOT / "docs" / "simulated_rig.md").read_text("utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \|", text, flags=re.M)
    parameters = inspect.signature(simulate_rig).parameters
    assert [name for name, _ in rows] == list(parameters)
    for name, shown in rows:
        default = parameters[name].default
        if isinstance(default, float | int | tuple) and not isinstance(default, bool):
            values = [float(each) for each in re.sub(r"(?<=\d),(?=\d)", "", shown).split(",")]
            assert values == list(np.ravel(default)), name
