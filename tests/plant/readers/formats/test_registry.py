"""The list of formats is what the documentation and the extras say."""

import os
import re
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import numpy as np
import pytest

from benchmarks.listings import formats
from skarxlag.plant.readers.formats import FORMATS, find_format

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
    name = module.__name__.rpartition(".")[2]
    has_test = Path(__file__).with_name(f"test_{name}.py").exists()
    assert has_test or name in ("npy", "npz", "wav")


@pytest.mark.slow
def test_another_package_adds_a_format(tmp_path):
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
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", str(ROOT))])

    def info(name):
        return subprocess.run(
            [sys.executable, "-m", "skarxlag", "info", name],
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": path},
            capture_output=True,
            text=True,
        )

    assert re.search(r"acc +5(\.0)? +g", info("run.marked").stdout)
    assert (
        "bad.marked: cannot be read as .marked, damaged?" in info("bad.marked").stderr
    )


def test_no_ending_belongs_to_two_formats():
    suffixes = [suffix for module in FORMATS for suffix in module.FORMAT.suffixes]
    assert len(set(suffixes)) == len(suffixes)
