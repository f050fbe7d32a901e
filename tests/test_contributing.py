"""The changes that CONTRIBUTING.md describes, made in a copy of the package and run there."""

import ast
import inspect
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import skarxlag
from skarxlag import datasets

ROOT = Path(__file__).parents[1]


def tutorial_files():
    """Return the files that CONTRIBUTING.md shows, by their paths, without indentation."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    blocks = re.findall(
        r"^ +`(\S+\.py)`:\n\n( +)```python\n(.*?)^ +```$", text, re.M | re.S
    )
    return {
        path: inspect.cleandoc(f"{indent}\n{code}") for path, indent, code in blocks
    }


@pytest.mark.slow
def test_tutorials_of_a_measure_and_a_decision(tmp_path):
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    for folder in ("skarxlag", "tests"):
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignore)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    files = tutorial_files()
    assert len(files) == 4
    for path, code in files.items():
        (tmp_path / path).write_text(code, "utf-8")
    registry = tmp_path / "skarxlag" / "core" / "registry.py"
    lines = re.findall(r'`("\w+": "[\w.]+",)`', text)
    listed = registry.read_text("utf-8").replace("}\n", "\n".join([*lines, "}\n"]))
    registry.write_text(listed, "utf-8")
    with (tmp_path / "skarxlag" / "__init__.pyi").open("a") as stub:
        stub.write(
            "\n".join(re.findall(r"`(from \.\w+\.\w+ import \w+ as \w+)`", text))
        )
    tests = [path for path in files if path.startswith("tests/")]
    tests += [
        "tests/test_common.py",
        "tests/core/test_state.py",
        "tests/test_public_names.py",
    ]
    quiet = ["-q", "-p", "no:cacheprovider", "-W", "ignore:NUMBA_DISABLE_JIT"]
    command = [sys.executable, "-m", "pytest", *quiet, *tests]
    names = ["crest_factor", "nearest_levels", "CrestFactor", "NearestLevels"]
    command += ["-k", " or ".join([*names, "same_names or registry"])]
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout
    # The contract of scikit-learn alone has more checks of the two.
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) > 100


def documented_defaults(public):
    """Defaults that the docstring of a class or function states, by parameter."""
    text = inspect.getdoc(public).partition("Parameters\n----------\n")[2]
    text = re.split(r"\n\n\w+\n-+\n", text)[0]
    return dict(re.findall(r"^(\w+) : .*, default=(.+?)\.?$", text, flags=re.M))


def defaults_that_differ(public):
    """Parameters whose default is another than the docstring states."""
    parameters = inspect.signature(public).parameters
    differing = {}
    for name, text in documented_defaults(public).items():
        # A name of a constant says which one it is, not its value.
        if not re.fullmatch(r"[A-Z]\w+", text) or text in ("None", "True", "False"):
            stated = ast.literal_eval(text)
            if stated != parameters[name].default:
                differing[name] = (stated, parameters[name].default)
    return differing


PUBLIC = {
    f"{module.__name__}.{name}": getattr(module, name)
    for module in (skarxlag, datasets)
    for name in module.__all__
    if callable(getattr(module, name)) and not name.startswith("_")
}


@pytest.mark.parametrize("public", PUBLIC.values(), ids=PUBLIC)
def test_stated_defaults_are_those_of_the_signature(public):
    assert defaults_that_differ(public) == {}
