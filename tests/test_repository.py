"""What the repository's hosts and tools read: versions that agree, workflows that are valid."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
HOOKS = (ROOT / ".pre-commit-config.yaml").read_text("utf-8")
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


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


@pytest.mark.slow
def test_workflows_and_updates_are_valid():
    pytest.importorskip("check_jsonschema")
    check = [sys.executable, "-m", "check_jsonschema", "--quiet", "--builtin-schema"]
    subprocess.run([*check, "vendor.github-workflows", *WORKFLOWS], check=True)
    subprocess.run(
        [*check, "vendor.dependabot", ROOT / ".github" / "dependabot.yml"], check=True
    )


def test_every_folder_of_tests_is_a_package():
    # Else two files of one name in two folders cannot be collected together.
    folders = {path.parent for path in (ROOT / "tests").rglob("test_*.py")}
    assert [each for each in folders if not (each / "__init__.py").exists()] == []
