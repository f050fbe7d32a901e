"""Files that hosts and tools of the repository read: versions that agree. `checks.sh` does more."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
HOOKS = (ROOT / ".pre-commit-config.yaml").read_text("utf-8")


@pytest.mark.parametrize("tool", ["ruff", "check-jsonschema"])
def test_hooks_run_the_version_that_the_tests_install(tool):
    (pinned,) = (
        each.partition("==")[2]
        for each in PROJECT["optional-dependencies"]["test"]
        if each.startswith(f"{tool}==")
    )
    (revision,) = re.findall(rf"/{tool}(?:-pre-commit)?\n    rev: v?(\S+)", HOOKS)
    assert revision == pinned


def test_every_supported_python_is_tested_and_stated():
    tests = (ROOT / ".github" / "workflows" / "tests.yml").read_text("utf-8")
    tested = re.findall(
        r'"(3\.\d+)"', re.search(r"^ +python: \[(.*)\]$", tests, flags=re.M)[1]
    )
    stated = [
        each.rpartition(" ")[2] for each in PROJECT["classifiers"] if ":: 3." in each
    ]
    assert tested == stated
    assert PROJECT["requires-python"] == f">={tested[0]}"


def test_every_folder_of_tests_is_a_package():
    # Else two files of one name in two folders cannot be collected together.
    folders = {path.parent for path in (ROOT / "tests").rglob("test_*.py")}
    assert [each for each in folders if not (each / "__init__.py").exists()] == []
