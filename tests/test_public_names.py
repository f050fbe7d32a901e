import subprocess
import sys

import pytest

import skarxlag


def test_every_public_name_is_found_and_listed():
    for name in skarxlag.__all__:
        public = getattr(skarxlag, name)
        assert public.__name__ == name and public.__doc__
        assert name in dir(skarxlag)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="No skarxlag attribute make_coffee"):
        skarxlag.make_coffee  # noqa: B018
    with pytest.raises(ImportError, match="make_coffee"):
        exec("from skarxlag import make_coffee")


def test_what_is_imported_when():
    """Help needs nothing large, estimators do not compile, and displays do not need matplotlib."""
    code = """
import contextlib, os, sys
import skarxlag.plant.commands
for argument in ("--version", "--help"):
    with contextlib.suppress(SystemExit):
        skarxlag.plant.commands.main([argument])
assert not {"numba", "numpy", "scipy", "sklearn", "pandas", "joblib"} & set(sys.modules)
from skarxlag import *
import skarxlag.plotting
assert "skarxlag.kernels.observer" in sys.modules
assert not {"numba", "scipy.signal", "matplotlib"} & set(sys.modules)
os.environ["MPLBACKEND"] = "Agg"
skarxlag.plotting.ResidualDisplay([1.0, -1.0]).plot()
assert "matplotlib.pyplot" in sys.modules
"""
    command = [sys.executable, "-W", "error", "-c", code]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
