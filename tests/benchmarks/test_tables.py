"""The printed tables: what the check sees, on the simulated rig and on copies of pages."""

import re

import pandas as pd
import pytest

from benchmarks import cross_speed, tables
from benchmarks.blocks import ROOT, blocks_of, put_block, without_blocks
from skarxlag.distances.comparison import SpectralDistance

CELLS = {
    "rigs": ["simulated 3 mm"],
    "lengths": ["4800"],
    "most_splits": 1,
}
METHODS = ["make_diagnoser", "log spectrum + shrinkage LDA"]
#: The site writes copies of some pages into the folder ``project``.
PAGES = sorted(
    page
    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    if page.parent.name != "project"
)


def pages_of(name):
    return {
        page: blocks_of((ROOT / page).read_text("utf-8"))
        for page in {block.partition(": ")[0] for block in tables.TABLES[name].blocks}
    }


@pytest.mark.parametrize("name", tables.TABLES)
def test_every_block_is_what_its_lines_give(name):
    assert tables.check_blocks(name, pages_of(name)) == []


def test_every_generated_block_and_csv_has_its_table():
    of_tables = [block for table in tables.TABLES.values() for block in table.blocks]
    listed = {*of_tables, *tables.LISTINGS}
    found = {
        f"{page.relative_to(ROOT).as_posix()}: {block}"
        for page in [*PAGES, ROOT / "benchmarks" / "README.md"]
        if page.parent.name != "paper"
        for block in blocks_of(page.read_text("utf-8"))
    }
    assert found == listed
    stored = {path.stem for path in (ROOT / "docs" / "tables").glob("*.csv")}
    assert stored <= set(tables.TABLES)


def test_recomputed_cells_of_the_simulated_rig_are_those_that_are_printed():
    methods = list(cross_speed.SIMULATED_METHODS)
    wrong, n_compared, n_cells, _ = tables.check_cells(
        "cross_speed", cells=(CELLS | {"methods": methods},)
    )
    assert [text for text in wrong if "no cell of the method" not in text] == []
    assert 40 < n_compared < n_cells


@pytest.fixture(scope="module")
def computed():
    """Lines of a small table."""
    return pd.DataFrame(cross_speed.lines(**CELLS, methods=METHODS))


@pytest.fixture
def printed(tmp_path, monkeypatch, computed):
    """The lines and the page that shows them, in a folder of their own."""
    monkeypatch.setattr(tables, "csv_of", lambda name: tmp_path / f"{name}.csv")
    block = {"page.md: cells": lambda lines: f"A sentence.\n\n{len(lines)} lines"}
    cells = CELLS | {"methods": METHODS}
    table = tables.Table(cross_speed.lines, block, (cells,))
    monkeypatch.setitem(tables.TABLES, "small", table)
    lines = computed.assign(made="2026-01-01")
    lines.to_csv(tmp_path / "small.csv", index=False)
    text = tables.block_text("small", "page.md", block["page.md: cells"], lines)
    return tmp_path / "small.csv", text


def check(text):
    cells, *_ = tables.check_cells("small")
    return cells + tables.check_blocks("small", {"page.md": {"cells": text}})


def test_an_unchanged_table_passes(printed):
    assert check(printed[1]) == []


@pytest.mark.parametrize(
    ("before", "after"), [("8 lines", "9 lines"), ("A sentence.", "Another one.")]
)
def test_a_number_or_a_sentence_edited_in_a_page_is_seen(printed, before, after):
    text = printed[1]
    assert before in text
    pages = {"page.md": {"cells": text.replace(before, after)}}
    assert tables.check_blocks("small", pages)


def test_a_number_edited_in_a_csv_is_seen(printed):
    path, _ = printed
    lines = tables.read_lines("small")
    lines.loc[0, "right"] += 1
    lines.to_csv(path, index=False)
    (wrong,), *_ = tables.check_cells("small")
    assert ("right is" in wrong and METHODS[0] in wrong) or METHODS[1] in wrong


def test_another_constant_of_a_distance_is_seen(printed, monkeypatch):
    make = SpectralDistance.__init__
    changed = make.__kwdefaults__ | {
        "smooth_drift": 1.2 * SpectralDistance().smooth_drift
    }
    monkeypatch.setattr(make, "__kwdefaults__", changed)
    assert any(METHODS[0] in text for text in check(printed[1]))


def test_a_method_without_a_cell_is_seen(printed):
    path, text = printed
    lines = tables.read_lines("small")
    more = lines.assign(method="another method")
    pd.concat([lines, more]).to_csv(path, index=False)
    assert any("another method" in wrong for wrong in check(text))


def test_printing_replaces_the_lines_that_are_computed_and_keeps_the_others(
    printed, monkeypatch
):
    path, _ = printed
    monkeypatch.setattr(tables, "write_pages", lambda name: None)
    before = tables.read_lines("small")
    before["right"] = -1
    before.to_csv(path, index=False)
    tables.print_table("small", {"methods": METHODS[:1], **CELLS})
    after = tables.read_lines("small")
    assert len(after) == len(before)
    is_kept = after["right"] == -1
    assert set(after["method"][is_kept]) == {METHODS[1]}
    assert set(after["method"][~is_kept]) == {METHODS[0]}


def test_a_page_with_a_mark_twice_is_refused():
    with pytest.raises(ValueError, match="expected"):
        put_block("<!-- x: begin -->\n\n", "x", "new")


#: Numbers with a decimal point that are no results: versions, names, settings, lengths.
ALLOWED = re.compile(
    r"(arXiv:|doi |CC BY-NC-SA |Python |scikit-learn |MATLAB |default is )[\d.]+"
    r"|(factors? (of|from)|rate of) [\d.]+( to [\d.]+)?"
    r"|Below [\d.]+, the verdict|at least [\d.]+ in the first question and [\d.]+ in the second"
    r"|k = .* and v = [\d.]+"
    r"|\d*\.\d+ ?(to [\d.]+ )?"
    r"(k?Hz|m?s\b|dB|mm|inch|seconds?|%|revolutions|samples|steps?|orders?)"
    r"|\w+=\S+|`[^`]*`|\([^()]*\.(md|py|svg|png|csv)[^()]*\)|\d+\.\d+\.\d+\S*|org/\S+"
)
WRITTEN = [page for page in PAGES if page.parent.name != "paper"]
WRITTEN.append(ROOT / "benchmarks" / "README.md")


def typed_figures(text):
    """Return the numbers with a decimal point that no command wrote into a page."""
    text = without_blocks(text)
    text = re.sub(r"```.*?```|\$\$.*?\$\$", "", text, flags=re.S)
    # Code, equations, and rows of parameters, whose defaults another test compares.
    text = re.sub(r"(?m)^(    |\| `|.*\\).*$|\$[^$]*\$", "", text)
    prose = " ".join(ALLOWED.sub("", text).split())
    return re.findall(r".{0,40}(?<![\w.])\d*\.\d+(?!\w).{0,20}", prose)


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.stem)
def test_prose_has_no_typed_figures(page):
    assert typed_figures(page.read_text("utf-8")) == []


def test_a_typed_figure_is_found():
    for text in ("Its accuracy is .93.", "| ours | 0.931 |"):
        assert len(typed_figures(text)) == 1


def test_listings_are_what_the_package_prints():
    for block, make in tables.LISTINGS.items():
        page, _, name = block.partition(": ")
        text = make()
        shown = blocks_of((ROOT / page).read_text("utf-8"))[name]
        assert text is None or shown == text, block
