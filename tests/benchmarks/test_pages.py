"""Everything that is generated has one command, and states whether its code was changed."""

import hashlib
import os
import re
import time
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.pages import __main__ as command
from benchmarks.pages import (
    blocks,
    canaries,
    cells,
    digests,
    kept,
    modules,
    parts,
    states,
)
from benchmarks.pages.kept import kept_or_computed

PAGES = [*modules.ROOT.glob("*.md"), *modules.ROOT.glob("benchmarks/*.md")]
PAGES += modules.ROOT.glob("docs/*.md")
PAGES += modules.ROOT.glob("docs/paper/*.md")
#: Drawn by hand.
BY_HAND = {"docs/_static/logo.svg"}


def test_every_marked_block_is_written_by_one_part():
    marked = [
        f"{page.relative_to(modules.ROOT).as_posix()}: {name}"
        for page in PAGES
        for name in re.findall(
            r"^<!-- (.*): begin -->$", page.read_text("utf-8"), flags=re.M
        )
    ]
    listed = [
        output
        for part in parts.PARTS.values()
        for output in part.outputs()
        if ": " in output
    ]
    assert sorted(listed) == sorted(marked)


def test_every_image_is_written_by_one_part():
    patterns = [pattern for part in parts.PARTS.values() for pattern in part.images]
    listed = [path for pattern in patterns for path in modules.ROOT.glob(pattern)]
    stored = [
        path
        for folder in (
            "docs/_static",
            "docs/images",
            "docs/images/gallery",
            "docs/paper/images",
        )
        for suffix in ("*.svg", "*.png", "*.txt")
        for path in modules.ROOT.glob(f"{folder}/{suffix}")
        if path.relative_to(modules.ROOT).as_posix() not in BY_HAND
    ]
    assert sorted(listed) == sorted(stored)


@pytest.mark.parametrize("name", parts.PARTS)
def test_each_block_states_its_command_version_and_date(name):
    recorded = states.recorded()
    for page, names in parts.PARTS[name].blocks.items():
        text = (modules.ROOT / page).read_text("utf-8")
        for block in names:
            written = text.partition(f"<!-- {block}: begin -->\n")[2].partition(
                "\n<!-- "
            )[0]
            state = recorded[f"{page}: {block}"]
            maker = f"`python -m benchmarks.pages {name}`"
            if page == "README.md":
                maker = "[a benchmark](benchmarks/README.md)"
            made = f"with version {state['version']}, {state['date']} UTC.*"
            assert written.endswith(f"*Made by {maker} {made}")


def test_every_table_in_a_file_belongs_to_a_block():
    paths = {
        modules.ROOT / blocks.table_file(page, name)
        for part in parts.PARTS.values()
        for page, names in part.blocks.items()
        for name in set(names).intersection(part.tables)
    }
    assert paths == {*modules.ROOT.glob("docs/**/tables/*")}


@pytest.fixture
def page(tmp_path, monkeypatch):
    """A tree with a page, its record, and a program that imports a kernel."""
    page = tmp_path / "page.md"
    page.write_text("<!-- a: begin -->\nold\n<!-- a: end -->\n")
    for name, source in SOURCES.items():
        path = tmp_path / "benchmarks" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(source)
    (tmp_path / "data.sha256").write_text("1")
    part = parts.Part("-m benchmarks.program", {"page.md": ("a",)}, data=("*.sha256",))
    monkeypatch.setattr(parts, "PARTS", {"only": part._replace(canaries=("value",))})
    for module in (command, blocks, kept, states):
        monkeypatch.setattr(module, "PARTS", parts.PARTS)
    for module in (modules, digests, states, blocks, command):
        monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(states, "RECORD", tmp_path / "generated.json")
    # The files of this tree are newer than the test process.
    monkeypatch.setattr(states, "_STARTED", time.time() + 60)
    monkeypatch.setattr(cells, "value", lambda: {"cell": 0.5}, raising=False)
    canaries._recomputed.cache_clear()
    yield page
    canaries._recomputed.cache_clear()


SOURCES = {
    "__init__.py": "",
    "program.py": "from benchmarks.kernel import gain\nopen('ran', 'w').close()\n",
    "kernel.py": 'def gain(x):\n    """Return the gain."""\n    return 2 * x\n',
    "other.py": "x = 1\n",
}


def edit(page, name, old, new):
    path = page.parent / "benchmarks" / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def the_state():
    (state,) = states.states()
    return state.name, state.differs


def test_a_block_is_outdated_until_it_is_written(page, capsys):
    assert the_state() == (states.NEVER, "") and command.main(["--check"]) == 1
    assert re.fullmatch(r"only +never made *\n", capsys.readouterr().out)
    blocks.write_blocks(page, {"a": "new"})
    assert the_state() == (states.CURRENT, "") and command.main(["--check"]) == 0
    assert re.search(
        r"-->\nnew\n\n\*Made by `python -m benchmarks.pages only` with version .* UTC\.\*\n<!--",
        page.read_text(),
    )


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("kernel.py", "Return the gain.", "Compute the gain."),
        ("kernel.py", "2 * x", "(2 * x)  # the gain"),
        ("other.py", "1", "2"),
    ],
)
def test_comments_docstrings_and_other_modules_do_not_count(page, name, old, new):
    blocks.write_blocks(page, {"a": "new"})
    edit(page, name, old, new)
    assert the_state() == (states.CURRENT, "")


def test_a_rename_moves_the_digest_and_no_canary(page, capsys):
    blocks.write_blocks(page, {"a": "new"})
    edit(page, "kernel.py", "gain(x)", "factor(x)")
    edit(page, "program.py", "import gain", "import factor")
    assert the_state() == (states.MOVED, "") and command.main(["--check"]) == 0
    assert " moved " in capsys.readouterr().out
    command.main(["--check", "--restamp"])
    assert the_state() == (states.CURRENT, "")


def test_a_changed_kernel_cannot_hide(page, monkeypatch, capsys):
    blocks.write_blocks(page, {"a": "new"})
    edit(page, "kernel.py", "2 * x", "3 * x")
    canaries._recomputed.cache_clear()
    monkeypatch.setattr(cells, "value", lambda: {"cell": 0.51})
    assert the_state() == (states.OUTDATED, "value: cell")
    assert command.main(["--check", "--restamp"]) == 1
    assert the_state() == (states.OUTDATED, "value: cell")
    assert "value: cell" in capsys.readouterr().out


def test_without_a_canary_changed_code_is_outdated(page):
    parts.PARTS["only"] = parts.PARTS["only"]._replace(canaries=())
    blocks.write_blocks(page, {"a": "new"})
    edit(page, "kernel.py", "2 * x", "3 * x")
    assert the_state() == (states.OUTDATED, "no canary")


def test_data_and_the_command_count(page):
    blocks.write_blocks(page, {"a": "new"})
    (page.parent / "data.sha256").write_text("2")
    assert the_state()[0] == states.MOVED
    (page.parent / "data.sha256").write_text("1")
    assert the_state()[0] == states.CURRENT
    parts.PARTS["only"] = parts.PARTS["only"]._replace(
        command="-m benchmarks.program --wide"
    )
    assert the_state()[0] == states.MOVED


def test_code_that_was_changed_during_a_run_gives_no_digest(page, monkeypatch):
    monkeypatch.setattr(states, "_STARTED", time.time() - 60)
    blocks.write_blocks(page, {"a": "new"})
    assert the_state() == (states.OUTDATED, "no digest")


def test_what_is_outdated_is_run(page):
    parts.PARTS["only"] = parts.PARTS["only"]._replace(blocks={}, images=("a.svg",))
    assert command.main([]) == 0
    assert (page.parent / "ran").exists() and states.outdated() == []
    with pytest.raises(SystemExit):
        command.main(["unknown"])


def test_a_kept_table_is_computed_again_when_code_or_data_change(page):
    path = page.parent / "kept.csv"
    values = iter(range(9))

    def kept():
        frame = kept_or_computed(
            path, "only", lambda: pd.DataFrame({"x": [next(values)]})
        )
        return frame["x"].tolist()

    assert kept() == kept() == [0]
    edit(page, "kernel.py", "2 * x", "3 * x")
    assert kept() == kept() == [1]
    (page.parent / "data.sha256").write_text("2")
    assert kept() == [2]
    (page.parent / "kept.digest").unlink()
    assert kept() == [3]


@pytest.mark.slow
def test_what_the_first_page_shows_is_of_the_present_code():
    shown = [
        name
        for name, part in parts.PARTS.items()
        if "README.md" in part.blocks or "docs/_static/overview.png" in part.images
    ]
    assert {"cross-speed", "overview"} <= set(shown)
    differs = {each.part: each for each in states.states(shown) if not each.is_valid}
    assert not differs, f"run python -m benchmarks.pages {' '.join(differs)}: {differs}"


@pytest.mark.parametrize("name", parts.PARTS)
def test_the_canaries_and_data_of_a_part_exist(name):
    part = parts.PARTS[name]
    assert all(callable(getattr(cells, each)) for each in part.canaries)
    assert all([*modules.ROOT.glob(pattern)] for pattern in part.data)


def test_the_package_that_names_are_imported_from_on_demand_is_followed():
    imported = modules.imported_modules(["benchmarks.recipe.targets"])
    assert {"skarxlag.diagnosers", "skarxlag.kernels.observer_bank"} <= set(imported)
    assert "skarxlag.monitoring.monitor" not in imported


def test_the_commands_of_the_package_are_followed():
    imported = modules.imported_modules(["benchmarks.pages.terminal_example"])
    assert {"skarxlag.plant.commands.fit", "skarxlag.kernels.observer_bank"} <= set(
        imported
    )


@pytest.mark.skipif("SKARXLAG_DATA" not in os.environ, reason="needs the recordings")
def test_recordings_are_those_of_the_checksums():
    home = Path(os.environ["SKARXLAG_DATA"])
    for line in (
        (modules.ROOT / "benchmarks/recipe/rigs.sha256").read_text().splitlines()
    ):
        checksum, name = line.split(maxsplit=1)
        assert hashlib.sha256((home / name).read_bytes()).hexdigest() == checksum


def test_tables_of_a_block_move_to_one_file(page):
    parts.PARTS["only"] = parts.PARTS["only"]._replace(tables=("a",))
    table = "| x |  |\n| --- | --- |\n| 1 |  |"
    folded = f"<details>\n<summary>first</summary>\n\n{table}\n\n</details>"
    block = f"About.\n\n{folded}\n\nMore.\n\n**second** part\n\n| x |\n| --- |\n| 2 |"
    blocks.write_blocks(page, {"a": block})
    assert (
        "-->\nAbout.\n\nMore.\n\n[Table as csv](docs/tables/a.csv)\n\n*Made"
        in page.read_text()
    )
    stored = pd.read_csv(page.parent / "docs" / "tables" / "a.csv")
    assert stored["table"].tolist() == ["first", "second part"]
    assert stored["x"].tolist() == [1, 2] and stored["row"].isna().all()
