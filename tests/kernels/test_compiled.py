import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

import skarxlag
from skarxlag.kernels.compiled import compiled

PACKAGE = Path(skarxlag.__file__).parent

WORK = """
import numpy as np, skarxlag
from skarxlag.kernels.residual_levels import adapt_switching_gain
assert skarxlag.__file__.startswith({root!r}), skarxlag.__file__
sizes, gain = np.full((2, 1), 3.0), np.full(1, 3.0)
adapt_switching_gain(sizes, gain, 0.5)
assert adapt_switching_gain.dispatcher.signatures and sizes.tolist() == [[3.0], [3.0]]
"""


def run(code, folder, **environment):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_machine_code_is_cached_where_a_folder_can_be_written(tmp_path):
    root = str(PACKAGE.parent)
    run(WORK.format(root=root), root, NUMBA_CACHE_DIR=str(tmp_path))
    assert list(tmp_path.rglob("*.nbi"))


@pytest.mark.slow
@pytest.mark.any_version
@pytest.mark.parametrize("has_home", [True, False])
def test_installed_package_without_write_access_uses_the_cache_of_the_user(
    tmp_path, has_home
):
    # Files where folders would have to be: not even an administrator can write in
    # there.
    shutil.copytree(
        PACKAGE, tmp_path / "skarxlag", ignore=shutil.ignore_patterns("__pycache__")
    )
    for folder in (tmp_path / "skarxlag").rglob("*"):
        if folder.is_dir():
            (folder / "__pycache__").touch()
    home = tmp_path / "home"
    home.mkdir() if has_home else home.touch()
    run(
        WORK.format(root=str(tmp_path)),
        tmp_path,
        PYTHONDONTWRITEBYTECODE="1",
        NUMBA_CACHE_DIR="",
        HOME=str(home),
        LOCALAPPDATA=str(home),
        XDG_CACHE_HOME=str(home),
    )
    assert bool(list(home.rglob("*.nbi"))) == has_home
    assert len(list(tmp_path.rglob("*.nbi"))) == len(list(home.rglob("*.nbi")))


def thrice(x):
    return 3.0 * x


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_cache_is_compiled_again_and_mended(
    tmp_path, monkeypatch, suffix, share
):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert compiled(thrice)(2.0) == 6.0
    [damaged] = tmp_path.rglob(f"*.{suffix}")
    content = damaged.read_bytes()
    damaged.write_bytes(content[: int(share * len(content))])
    assert compiled(thrice)(2.0) == 6.0
    again = compiled(thrice)
    assert again(2.0) == 6.0 and sum(again.dispatcher.stats.cache_hits.values()) == 1


def test_full_disk_ends_nothing(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(numba.core.caching.IndexDataCacheFile, "_open_for_write", fail)
    assert compiled(thrice)(2.0) == 6.0
    assert not list(tmp_path.rglob("*.nb?"))


def test_compiled_function_keeps_its_name_and_what_it_was():
    @compiled
    def first(values):
        """The first value."""
        return values[0]

    assert first.__name__ == "first"
    assert first.__doc__ == "The first value."
    assert first(np.full(1, 3.0)) == first.__wrapped__(np.full(1, 3.0)) == 3.0
    # error_model="numpy": a division by zero is infinite, as in NumPy, and no
    # exception.
    assert compiled(lambda x: 1.0 / x)(0.0) == np.inf


@pytest.mark.any_version
def test_nothing_private_of_scikit_learn_is_imported():
    lines = [
        (source.name, line)
        for source in PACKAGE.rglob("*.py")
        for line in re.findall(
            r"^\s*(?:from|import)\s+sklearn.*$", source.read_text(), re.MULTILINE
        )
    ]
    assert len(lines) > 20
    assert not [each for each in lines if re.search(r"[.\s,(]_(?!_)", each[1])]


@pytest.mark.any_version
def test_kernels_know_nothing_of_scikit_learn():
    sources = list((PACKAGE / "kernels").glob("*.py"))
    assert len(sources) > 10
    assert not [source.name for source in sources if "sklearn" in source.read_text()]


def test_loops_that_are_not_compiled_are_announced(monkeypatch):
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    loop = compiled(lambda x: x + 1)
    with pytest.warns(UserWarning, match="NUMBA_DISABLE_JIT is set, so loops run as"):
        assert loop(1) == 2
