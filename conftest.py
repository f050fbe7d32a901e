"""What is slow, settings that must stand before SciPy is imported, and figures that are closed."""

import os
import sys

import pytest

# scikit-learn skips its array API check where SciPy was imported without this.
os.environ.setdefault("SCIPY_ARRAY_API", "1")


#: Files and folders of tests that the quick lane leaves out: pytest -m "not slow".
SLOW = (
    "tests/benchmarks",
    "tests/commands",
    "tests/datasets",
    "tests/kernels/test_compiled.py",
    "tests/monitoring",
    "tests/mutation",
    "tests/paper",
    "tests/plotting",
    "tests/recordings",
    "tests/test_common.py",
    "tests/test_contributing.py",
    "tests/test_docs.py",
    "tests/test_main.py",
    "tests/test_parameter_effects.py",
    "tests/test_persistence.py",
    "tests/test_pipelines.py",
    "tests/test_repository.py",
)


def pytest_collection_modifyitems(items):
    """Mark what is slow."""
    for item in items:
        if item.nodeid.startswith(SLOW):
            item.add_marker("slow")


@pytest.fixture(autouse=True)
def _close_figures():
    """Close what a test or a doctest drew, or later tests would count its figures."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")
