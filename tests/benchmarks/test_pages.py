"""Everything that is generated has one command, and states its version and date."""

import re
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.pages import __main__ as command
from benchmarks.pages import blocks, parts

PAGES = [*parts.ROOT.glob("*.md"), *parts.ROOT.glob("benchmarks/*.md")]
PAGES += parts.ROOT.glob("docs/*.md")
PAGES += parts.ROOT.glob("docs/paper/*.md")
#: Drawn by hand.
BY_HAND = {"docs/_static/logo.svg"}


def test_every_marked_block_is_written_by_one_part():
    marked = [
        f"{page.relative_to(parts.ROOT).as_posix()}: {name}"
        for page in PAGES
        for name in re.findall(r"^<!-- (.*): begin -->$", page.read_text("utf-8"), flags=re.M)
    ]
    listed = [
        output for part in parts.PARTS.values() for output in part.outputs() if ": " in output
    ]
    assert sorted(listed) == sorted(marked)


def test_every_image_is_written_by_one_part():
    patterns = [pattern for part in parts.PARTS.values() for pattern in part.images]
    listed = [path for pattern in patterns for path in parts.ROOT.glob(pattern)]
    stored = [
        path
        for folder in ("docs/_static", "docs/images", "docs/paper/images")
        for suffix in ("*.svg", "*.png")
        for path in parts.ROOT.glob(f"{folder}/{suffix}")
        if path.relative_to(parts.ROOT).as_posix() not in BY_HAND
    ]
    assert sorted(listed) == sorted(stored)


@pytest.mark.parametrize("part", parts.PARTS.values(), ids=parts.PARTS)
def test_the_command_of_a_part_exists(part):
    assert find_spec(part.command.split()[1]) is not None


@pytest.mark.parametrize("name", parts.PARTS)
def test_each_block_states_its_command_version_and_date(name):
    known = parts.recorded()
    for page, names in parts.PARTS[name].blocks.items():
        text = (parts.ROOT / page).read_text("utf-8")
        for block in names:
            written = text.partition(f"<!-- {block}: begin -->\n")[2].partition("\n<!-- ")[0]
            state = known[f"{page}: {block}"]
            maker = f"`python -m benchmarks.pages {name}`"
            if page == "README.md":
                maker = "[a benchmark](benchmarks/README.md)"
            made = f"with version {state['version']}, {state['date']} UTC.*"
            assert written.endswith(f"*Made by {maker} {made}")


def test_every_table_in_a_file_belongs_to_a_block():
    wanted = {
        parts.ROOT / Path(page).parent / "tables" / f"{name.replace(' ', '_')}.csv"
        for part in parts.PARTS.values()
        for page, names in part.blocks.items()
        for name in set(names).intersection(part.tables)
    }
    assert wanted == {*parts.ROOT.glob("docs/**/tables/*")}


@pytest.fixture
def page(tmp_path, monkeypatch):
    """A tree with one page, and the record next to it."""
    page = tmp_path / "page.md"
    page.write_text("<!-- a: begin -->\nold\n<!-- a: end -->\n")
    part = parts.Part("-c \"open('ran','w')\"", {"page.md": ("a",)})
    for module in (parts, command, blocks):
        monkeypatch.setattr(module, "PARTS", {"only": part})
        monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(parts, "RECORD", tmp_path / "generated.json")
    return page


def test_a_block_is_outdated_until_it_is_written_and_with_a_new_version(page, monkeypatch, capsys):
    assert parts.outdated() == ["only"] and command.main(["--check"]) == 1
    assert re.fullmatch(r"only +never *\n", capsys.readouterr().out)
    blocks.write_blocks(page, {"a": "new"})
    assert parts.outdated() == [] and command.main(["--check"]) == 0
    assert f" {parts.__version__} " in capsys.readouterr().out
    assert re.search(
        r"-->\nnew\n\n\*Made by `python -m benchmarks.pages only` with version .* UTC\.\*\n<!--",
        page.read_text(),
    )
    monkeypatch.setattr(parts, "__version__", "99")
    assert parts.outdated() == ["only"]


def test_blocks_of_every_part_are_recorded(page, monkeypatch):
    earlier = parts.PARTS["only"]._replace(blocks={"other.md": ("b",)})
    monkeypatch.setattr(parts, "PARTS", {"earlier": earlier, **parts.PARTS})
    blocks.write_blocks(page, {"a": "new"})
    assert parts.outdated() == ["earlier"]


def test_what_is_outdated_is_run(page, monkeypatch):
    part = parts.PARTS["only"]._replace(blocks={}, images=("a.svg",))
    for module in (parts, command):
        monkeypatch.setattr(module, "PARTS", {"only": part})
    assert command.main([]) == 0
    assert (page.parent / "ran").exists() and parts.outdated() == []
    with pytest.raises(SystemExit):
        command.main(["unknown"])


def test_tables_of_a_block_move_to_one_file(page, monkeypatch):
    part = parts.PARTS["only"]._replace(tables=("a",))
    monkeypatch.setattr(blocks, "PARTS", {"only": part})
    folded = (
        "<details>\n<summary>first</summary>\n\n| x |  |\n| --- | --- |\n| 1 |  |\n\n</details>"
    )
    block = f"About.\n\n{folded}\n\nMore.\n\n**second** part\n\n| x |\n| --- |\n| 2 |"
    blocks.write_blocks(page, {"a": block})
    assert "-->\nAbout.\n\nMore.\n\n[Table as csv](tables/a.csv)\n\n*Made" in page.read_text()
    stored = pd.read_csv(page.parent / "tables" / "a.csv")
    assert stored["table"].tolist() == ["first", "second part"]
    assert stored["x"].tolist() == [1, 2] and stored["row"].isna().all()
