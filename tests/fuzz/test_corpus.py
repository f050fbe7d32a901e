"""Files that once crashed a reader, or got through it, do not do so again."""

import os
import random
from pathlib import Path

import pytest

from .damage import damaged, forged
from .executions import handle, run_apart
from .seeds import write_models, write_recordings

CORPUS = sorted(Path(__file__).with_name("corpus").iterdir())
needs_linux = pytest.mark.skipif(
    not os.path.exists("/proc/self/statm"), reason="memory is bounded as on Linux"
)


@needs_linux
@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.name)
def test_past_failure_is_handled(path):
    assert run_apart(path) is None


@pytest.mark.parametrize(
    "path", [p for p in CORPUS if p.suffix == ".skops"], ids=lambda path: path.name
)
def test_inconsistent_model_is_refused(path):
    assert handle(path) == "refused"


# The writer of universal files leaves them open.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_intact_files_are_read(tmp_path):
    (tmp_path / "models").mkdir()
    files = write_models(tmp_path / "models")
    (tmp_path / "recordings").mkdir()
    files += write_recordings(tmp_path / "recordings")
    assert {path.name: handle(path) for path in files} == {
        path.name: "read" for path in files
    }


@pytest.mark.slow
@needs_linux
def test_a_few_damaged_files_are_handled(tmp_path):
    source = random.Random(0)
    for seed in write_models(tmp_path):
        for damage in (damaged, forged, forged):
            path = tmp_path / f"damaged_{seed.name}"
            path.write_bytes(damage(seed.read_bytes(), source))
            assert run_apart(path) is None
