"""Count the mutants of modules that the tests kill: ``python -m tests.mutation``.

The modules are the kernels, the decision and the verdicts of an
interrupted run. Each mutant is a copy of a module with one small error, see `mutants`.
It is killed if a test fails that passes without the error, or takes too long. Tests
that are slow without the error are left out. If an error is in a loop, or in a constant
next to one, all loops run as plain Python, so that nothing has to be compiled; an index
out of bounds is then an error, which a compiled loop would not notice. Otherwise the
loops are those that are compiled already. Mutants that are equivalent to the module are
listed in `equivalent.txt`, each with its reason, and are not counted. The list holds
changes without names, so that it survives renaming; a report shows the entry of each
mutant that is alive. Exit status: 0 if at least 99 % of each module are killed, 1
otherwise.
"""

import argparse
import gc
import os
import random
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import redirect_stdout
from multiprocessing import get_context
from pathlib import Path

os.environ["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"
os.environ.setdefault("SCIPY_ARRAY_API", "1")

import matplotlib.pyplot  # noqa: F401
import numba
import numpy as np
import pandas as pd  # noqa: F401
import pytest
import scipy.interpolate
import scipy.ndimage
import scipy.optimize
import scipy.signal
import scipy.sparse.linalg
import scipy.stats  # noqa: F401
import sklearn.utils.estimator_checks  # noqa: F401

from tests.mutation.mutants import (
    SOURCES,
    compiled_functions,
    known_equivalent,
    mutants,
)
from tests.mutation.one_mutant import run_tests

ROOT = Path(__file__).parents[2]
#: Tests of a module that do not stand in the file of its name.
FURTHER_TESTS = {
    "row_outliers": [
        "tests/decisions/test_fault_detector.py",
        "tests/decisions/test_known_conditions.py",
    ],
    "fault_detector": [
        "tests/decisions/test_row_outliers.py",
        "tests/decisions/test_known_conditions.py",
    ],
    "known_conditions": ["tests/decisions/test_row_outliers.py"],
    "ladder": [
        "tests/kernels/test_ladder_thresholds.py",
        "tests/decisions/test_ladder.py",
    ],
    "laguerre": ["tests/kernels/test_arx_laguerre.py"],
    "observer": ["tests/kernels/test_residual_levels.py"],
    "judge": ["tests/verdicts/test_recordings.py", "tests/decisions/test_fusion.py"],
    "members": ["tests/verdicts/test_recordings.py", "tests/decisions/test_fusion.py"],
    "limits": ["tests/verdicts/test_recordings.py"],
    "lanes": ["tests/kernels/test_observer.py", "tests/kernels/test_arx_laguerre.py"],
}
#: Share of the mutants of a module that the tests must kill.
LEAST_KILLED = 0.99


def examine(module, chosen):
    """Run the tests of a module with each of its mutants.

    Parameters
    ----------
    module : str
        Name of the module, see `SOURCES`.
    chosen : set of int
        Numbers of the mutants, in the order of `mutants`.

    Returns
    -------
    alive : list of str
        Line, key and changed line of the mutants that all tests let pass.
    report : str
        Lines that count the mutants and show those that are alive.
    """
    began = time.monotonic()
    source = SOURCES[module].relative_to(ROOT)
    path, name = str(ROOT / source), ".".join(source.with_suffix("").parts)
    test_of_file = Path("tests", *source.parts[1:-1], f"test_{source.stem}.py")
    tests = [str(test_of_file), *FURTHER_TESTS.get(module, [])]
    tests = [path, *(test for test in tests if Path(test).exists())]
    text = Path(path).read_text()
    tests += ["tests/kernels/test_memory.py"] * ("@compiled" in text)
    loops = compiled_functions(text)
    usual = {}
    kills = Counter()
    alive = []
    lines = []
    for number, mutant in enumerate(mutants(text)):
        if number in chosen:
            is_plain = mutant.function in loops
            numba.config.DISABLE_JIT = int(is_plain)
            if is_plain not in usual:
                # The first time, tests that compile a loop may seem to be slow.
                run_tests(name, path, None, tests)
                usual[is_plain], failed = run_tests(name, path, None, tests)
                lines += [
                    f"{module}: {test} fails or is slow without an error"
                    for test in failed
                ]
            _, failed = run_tests(
                name, path, mutant.program, tests, usual[is_plain], kills
            )
            kills.update(failed)
            if not failed:
                alive.append(
                    f"  line {mutant.line}: {module}.{mutant.key}  # {mutant.text}"
                )
    n_killed = len(chosen) - len(alive)
    seconds = time.monotonic() - began
    lines.append(f"{module}: {n_killed} of {len(chosen)} killed, {seconds:.0f} s")
    return alive, "\n".join([*lines, *alive])


def interval(killed, total):
    """Return Wilson's interval, at 95 %, of a share that a sample estimates."""
    share, z = killed / total, 1.96
    middle = (share + z**2 / (2 * total)) / (1 + z**2 / total)
    half = (
        np.sqrt(share * (1 - share) / total + z**2 / (4 * total**2))
        * z
        / (1 + z**2 / total)
    )
    return middle - half, middle + half


def main():
    """Run the command."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutation", description=__doc__
    )
    parser.add_argument(
        "modules", nargs="*", default=list(SOURCES), help="default: all"
    )
    parser.add_argument(
        "--sample", type=int, help="number of mutants in all, drawn at random"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the sample; default 0")
    parser.add_argument(
        "--jobs", type=int, default=2, help="processes at once; default 2"
    )
    args = parser.parse_args()
    os.chdir(ROOT)
    # Children begin with all that pytest imports, and leave what is here to itself.
    with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
        pytest.main(["--collect-only", "-qq", "tests/mutation"])
    gc.freeze()
    population = [
        (module, number, f"{module}.{mutant.key}")
        for module in args.modules
        for number, mutant in enumerate(mutants(SOURCES[module].read_text()))
    ]
    sample = population
    if args.sample is not None and args.sample < len(population):
        sample = random.Random(args.seed).sample(population, args.sample)
    equivalent = known_equivalent()
    examined = [entry for entry in sample if entry[2] not in equivalent]
    chosen = {
        module: {number for name, number, _ in examined if name == module}
        for module in args.modules
    }
    context = get_context("fork")
    n_alive = 0
    holds = True
    with ProcessPoolExecutor(args.jobs, context, max_tasks_per_child=None) as pool:
        # The largest first, so that no process waits for the last one for long.
        order = sorted(
            filter(chosen.get, chosen), key=lambda module: -len(chosen[module])
        )
        tasks = {pool.submit(examine, m, chosen[m]): len(chosen[m]) for m in order}
        for task in as_completed(tasks):
            alive, report = task.result()
            n_alive += len(alive)
            holds = holds and len(alive) <= (1 - LEAST_KILLED) * tasks[task]
            print(report, flush=True)
    n_examined = len(examined)
    n_killed = n_examined - n_alive
    n_equivalent = len(sample) - n_examined
    print(f"{n_equivalent} of {len(sample)} mutants are known to be equivalent")
    print(
        f"{n_killed} of the other {n_examined} killed: "
        f"{100 * n_killed / n_examined:.1f} %"
    )
    if len(sample) < len(population):
        low, high = interval(n_killed, n_examined)
        print(
            f"a sample of {len(population)}: between {100 * low:.1f} and "
            f"{100 * high:.1f} % (95 %)"
        )
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
