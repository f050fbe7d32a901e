"""Everything that is generated has one command, and a change of its code makes it stale."""

import re
from importlib.util import find_spec

import pytest

from benchmarks.pages import __main__ as command
from benchmarks.pages import parts
from benchmarks.pages.blocks import write_blocks

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
def test_the_command_and_the_sources_of_a_part_exist(part):
    module = part.command.split()[1]
    assert find_spec(module) is not None
    for pattern in (*parts.CORE, *part.reads):
        assert list(parts.ROOT.glob(pattern)), pattern


def test_each_block_tells_its_command():
    for part in parts.PARTS.values():
        for page, names in part.blocks.items():
            text = (parts.ROOT / page).read_text("utf-8")
            told = part.command.rpartition(" && ")[2].partition(" --")[0]
            for name in names:
                block = text.partition(f"<!-- {name}: begin -->")[2].partition("<!-- ")[0]
                if "Made by" in block:
                    assert f"`python {told}" in block, name
            assert f"python {told}" in text


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A tree with one source and one page, and the record beside it."""
    (tmp_path / "skarxlag").mkdir()
    (tmp_path / "source.py").write_text('"""About."""\nx: int = 1  # one\n')
    page = tmp_path / "page.md"
    page.write_text("<!-- a: begin -->\nold\n<!-- a: end -->\n")
    part = parts.Part("-c pass", ("source.py",), {"page.md": ("a",)})
    for module in (parts, command):
        monkeypatch.setattr(module, "PARTS", {"only": part})
        monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr("benchmarks.pages.blocks.ROOT", tmp_path)
    monkeypatch.setattr(parts, "RECORD", tmp_path / "generated.json")
    monkeypatch.setattr(parts.fingerprint, "__defaults__", (tmp_path,))
    parts._code.cache_clear()
    yield tmp_path
    parts._code.cache_clear()


def edit(folder, text):
    (folder / "source.py").write_text(text)
    parts._code.cache_clear()


def test_a_block_is_stale_until_it_is_written_and_when_code_changes(sources, capsys):
    assert parts.stale() == {"only": ["page.md: a"]}
    write_blocks(sources / "page.md", {"a": "new"})
    assert parts.stale() == {}
    edit(sources, '"""Another text."""\n# a comment\nx: float = 1\n')
    assert parts.stale() == {} and command.main(["--check"]) == 0
    edit(sources, "x: int = 2\n")
    assert command.main(["--check"]) == 1
    assert capsys.readouterr().out == "only: python -c pass\n    page.md: a\n"


def test_types_of_functions_do_not_make_a_block_stale(sources):
    edit(sources, "def f(x, *y, z=1): return x\n")
    write_blocks(sources / "page.md", {"a": "new"})
    edit(sources, "def f(x: int, *y: str, z: float = 1) -> int: return x\n")
    assert parts.stale() == {}


def test_blocks_of_every_part_are_recorded(sources, monkeypatch):
    earlier = parts.PARTS["only"]._replace(blocks={"other.md": ("b",)})
    monkeypatch.setattr(parts, "PARTS", {"earlier": earlier, **parts.PARTS})
    write_blocks(sources / "page.md", {"a": "new"})
    assert parts.stale() == {"earlier": ["other.md: b"]}


def test_what_is_stale_is_run(sources, monkeypatch):
    monkeypatch.setattr(
        parts, "PARTS", {"only": parts.PARTS["only"]._replace(command="-c \"open('ran','w')\"")}
    )
    monkeypatch.setattr(command, "PARTS", parts.PARTS)
    assert command.main([]) == 0
    assert (sources / "ran").exists() and parts.stale() == {}
    with pytest.raises(SystemExit):
        command.main(["unknown"])
