"""The list of formats is what the documentation and the extras say."""

import tomllib
from pathlib import Path

import pytest

from benchmarks.pages.formats import formats_table
from skarxlag.plant.readers.formats import FORMATS, find_format

ROOT = Path(__file__).parents[4]


def test_the_page_lists_all_formats():
    page = (ROOT / "docs" / "recordings.md").read_text("utf-8")
    assert formats_table() in page


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
    name = module.__name__.rpartition(".")[2]
    has_test = Path(__file__).with_name(f"test_{name}.py").exists()
    assert has_test or name in ("npy", "npz", "wav")


def test_no_ending_belongs_to_two_formats():
    suffixes = [suffix for module in FORMATS for suffix in module.FORMAT.suffixes]
    assert len(set(suffixes)) == len(suffixes)
