"""Commands refuse wrong arguments without the libraries that they compute with."""

import subprocess
import sys

import pytest

from skarxlag.commands.models import DIAGNOSERS
from skarxlag.commands.parsers.fit import KINDS

#: Libraries that take most of the time of a short command.
PROGRAM = """
import sys
from skarxlag.commands import main

status = 2
try:
    status = main(sys.argv[1:])
except SystemExit as stop:
    status = stop.code
heavy = ("numba", "pandas", "scipy", "sklearn", "skops")
print(status, *(name for name in heavy if name in sys.modules))
"""
REFUSED = {
    "unknown option": (2, ["diagnose", "m.skops", "x.npy", "--nope"]),
    "no model": (2, ["diagnose"]),
    "no recording": (2, ["diagnose", "m.skops"]),
    "model that does not exist": (1, ["diagnose", "gone.skops", "x.npy"]),
    "bad result": (2, ["diagnose", "m.skops", "x.npy", "-o", "x.doc"]),
    "info on nothing": (1, ["info", "gone.skops"]),
    "watch without a model": (1, ["watch", "gone.skops", "-"]),
    "bad number": (2, ["fit", "t.csv", "-o", "a.skops", "--n-jobs", "0"]),
    "bad model file": (2, ["fit", "t.csv", "-o", "nowhere/a.skops"]),
    "bad table": (1, ["fit", "bad.csv", "-o", "a.skops"]),
    "no table": (1, ["fit", "gone.csv", "-o", "a.skops"]),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_refusal_imports_no_numerics(tmp_path, case):
    (tmp_path / "m.skops").touch()
    (tmp_path / "t.csv").write_text("path,condition\nx.npy,good\n")
    (tmp_path / "bad.csv").write_text("path,condition\nx.npy,\n")
    status, arguments = REFUSED[case]
    command = [sys.executable, "-c", PROGRAM, *arguments]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [str(status)], done.stderr


def test_every_diagnoser_can_be_chosen():
    assert {*DIAGNOSERS} < {*KINDS}
