"""Settings that must stand before SciPy is imported, and figures that are closed."""

import os
import sys

import pytest

# scikit-learn skips its array API check where SciPy was imported without this.
os.environ.setdefault("SCIPY_ARRAY_API", "1")


@pytest.fixture(autouse=True)
def _close_figures():
    """Close what a test or a doctest drew, or later tests would count its figures."""
    yield
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is not None:
        pyplot.close("all")
