"""Count the mutants of the kernels that the tests kill: ``python -m tests.mutation``.

Each mutant is a copy of a kernel with one small error, see `mutants`. It is killed if a test fails
that passes without the error, or takes too long. The loops run as plain Python, so that nothing has
to be compiled. Mutants that no test can tell from the kernel are listed in `equivalent.txt`, each
with its reason, and are not counted.
"""

import argparse
import importlib.abc
import importlib.util
import os
import random
import signal
import sys
import time
from pathlib import Path

os.environ["NUMBA_DISABLE_JIT"] = "1"
os.environ.setdefault("SCIPY_ARRAY_API", "1")

import numba  # noqa: F401
import numpy as np  # noqa: F401
import pandas as pd  # noqa: F401
import pytest
import scipy.signal  # noqa: F401
import sklearn.utils.estimator_checks  # noqa: F401

from tests.mutation.mutants import mutants

ROOT = Path(__file__).parents[2]
KERNELS = ROOT / "skarxlag" / "kernels"
EQUIVALENT = Path(__file__).with_name("equivalent.txt")
#: Tests of a kernel that do not stand in the file of its name.
FURTHER_TESTS = {
    "ladder": ["tests/kernels/test_ladder_thresholds.py", "tests/test_ladder.py"],
}
#: Compiled loops, not what they compute.
NOT_NUMERIC = {"__init__", "compiled"}


class _Mutated(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module with the error."""

    def __init__(self, name, program, path):
        self.name, self.program, self.path = name, program, path

    def find_spec(self, fullname, path=None, target=None):
        if fullname == self.name:
            return importlib.util.spec_from_file_location(fullname, self.path, loader=self)
        return None

    def create_module(self, spec):
        return None

    def exec_module(self, module):
        exec(compile(self.program, self.path, "exec"), module.__dict__)


def survives(module, program, tests, seconds):
    """Whether all tests pass with the error, in a process of its own."""
    child = os.fork()
    if child == 0:
        os.setsid()
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), 1)
            os.dup2(nowhere.fileno(), 2)
        if program is not None:
            path = str(KERNELS / f"{module}.py")
            sys.meta_path.insert(0, _Mutated(f"skarxlag.kernels.{module}", program, path))
        options = ["-x", "-q", "-p", "no:cacheprovider", "--import-mode=append"]
        os._exit(int(pytest.main([*options, "-o", "addopts=", *tests])))
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.02)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


def known_equivalent():
    """Lines ``module: changed line`` before their reason."""
    lines = EQUIVALENT.read_text().splitlines() if EQUIVALENT.exists() else []
    return {line.split("  # ")[0].strip() for line in lines if line and not line.startswith("#")}


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    names = sorted(p.stem for p in KERNELS.glob("*.py") if p.stem not in NOT_NUMERIC)
    parser.add_argument("modules", nargs="*", default=names, help="kernels; all by default")
    parser.add_argument("--sample", type=int, help="mutants of each kernel, drawn at random")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    os.chdir(ROOT)
    equivalent, total, killed = known_equivalent(), 0, 0
    for module in args.modules:
        tests = [f"tests/kernels/test_{module}.py", *FURTHER_TESTS.get(module, [])]
        tests = [test for test in tests if Path(test).exists()]
        if not tests:
            print(f"{module}: no tests", flush=True)
            continue
        began = time.monotonic()
        if not survives(module, None, tests, 600):
            print(f"{module}: its tests fail without a mutant", flush=True)
            continue
        seconds = 10 + 5 * (time.monotonic() - began)
        found = list(mutants((KERNELS / f"{module}.py").read_text()))
        found = [each for each in found if f"{module}: {each[1]}" not in equivalent]
        n_all = len(found)
        if args.sample is not None and args.sample < n_all:
            found = random.Random(args.seed).sample(found, args.sample)
        alive = [each for each in found if survives(module, each[2], tests, seconds)]
        print(
            f"{module}: {len(found) - len(alive)} of {len(found)} killed, {n_all} in all, "
            f"{time.monotonic() - began:.0f} s",
            flush=True,
        )
        for line, change, _ in alive:
            print(f"  line {line}: {change}", flush=True)
        total, killed = total + len(found), killed + len(found) - len(alive)
    if total:
        print(f"{killed} of {total} mutants killed: {100 * killed / total:.1f} %")


if __name__ == "__main__":
    main()
