"""Settings that must stand before SciPy is imported, and figures that are closed."""

import gc
import os
import sys

import pytest

# scikit-learn skips its array API check where SciPy was imported without this.
os.environ.setdefault("SCIPY_ARRAY_API", "1")

# Modules and tests are many objects that stay. A quarter of the time of the collection
# of tests would be a search for garbage among them.
gc.set_threshold(100_000)


def pytest_collection_finish():
    """Search for garbage only among the objects that tests create."""
    gc.freeze()


@pytest.fixture(autouse=True)
def _close_figures():
    """Close what a test or a doctest drew, or later tests would count its figures."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")
