"""The list of formats is what the documentation and the extras say."""

import re
import textwrap
import tomllib
from pathlib import Path

import numpy as np
import pytest

from benchmarks.listings import formats
from skarxlag import list_channels
from skarxlag.plant.readers.formats import FORMATS, all_formats, find_format

ROOT = Path(__file__).parents[4]


def test_the_page_lists_all_formats():
    page = (ROOT / "docs" / "recordings.md").read_text("utf-8")
    assert formats() in page


@pytest.mark.parametrize(
    "module", FORMATS, ids=lambda module: module.__name__.split(".")[-1]
)
def test_a_format_is_complete(module):
    about = module.FORMAT
    assert about.suffixes
    for suffix in about.suffixes:
        assert find_format(Path("run" + suffix.upper())) is module
    if about.library is not None:
        project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
        extra = project["optional-dependencies"][about.extra]
        assert about.library in " ".join(extra).lower()
        # What other people's parsers do on damaged files is not known.
        assert about.isolated


def test_another_package_adds_a_format(tmp_path, monkeypatch):
    """The module and the entry point that CONTRIBUTING.md shows."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    section = text.partition("## Another format of recordings")[2]
    code, entry = (
        textwrap.dedent(block)
        for block in re.findall(r"```\w+\n(.*?)```", section, re.DOTALL)[:2]
    )
    (tmp_path / "my_package").mkdir()
    (tmp_path / "my_package" / "marked.py").write_text(code)
    about = tmp_path / "my_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my_package\n")
    points = tomllib.loads(entry)["project"]["entry-points"]
    ((group, ((name, module),)),) = ((g, p.items()) for g, p in points.items())
    (about / "entry_points.txt").write_text(f"[{group}]\n{name} = {module}\n")
    (tmp_path / "run.marked").write_bytes(b"mark" + np.arange(5.0, 9).tobytes())
    (tmp_path / "bad.marked").write_bytes(b"mar")
    monkeypatch.syspath_prepend(tmp_path)
    all_formats.cache_clear()
    try:
        (channel,) = list_channels(tmp_path / "run.marked").itertuples(index=False)
        assert channel[:3] == ("acc", 5.0, "g")
        with pytest.raises(ValueError, match=r"cannot be read as .marked, damaged\?"):
            list_channels(tmp_path / "bad.marked")
    finally:
        all_formats.cache_clear()


def test_no_ending_belongs_to_two_formats():
    suffixes = [suffix for module in FORMATS for suffix in module.FORMAT.suffixes]
    assert len(set(suffixes)) == len(suffixes)
