"""Rows of the speed benchmark that need fresh processes: start-up and peak memory."""

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.speed import children, peers
from benchmarks.speed.timing import ratio, spread, take_turns

ROOT = Path(__file__).parents[2]
#: Commands in a new process, which may take this share of the time of the imports.
_COMMANDS, _SHARE = ("diagnose", "info"), 0.6
#: Seconds that a command without numerics may take more than an empty program.
_MOST_SECONDS = 0.3


def run_python(*arguments, cache, status=0):
    """Return what a new process prints, which must end with this status."""
    environment = dict(os.environ, NUMBA_CACHE_DIR=str(cache), OMP_NUM_THREADS="1")
    # Bytecode is what an installed package has, whatever numba has cached.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL if "diagnose" in arguments or status else None,
        text=True,
    )
    if done.returncode != status:
        raise RuntimeError(f"{arguments} ended with status {done.returncode}")
    return done.stdout


def _run(unit, *arguments, cache):
    """Return the number that a child process prints after this word."""
    printed = run_python("-m", children.__name__, *arguments, cache=cache)
    return float(printed.rpartition(unit)[2])


def start_up(n_rounds=9):
    """Measure commands of the shell in new processes, and the first fit and prediction."""
    with tempfile.TemporaryDirectory() as folder:
        paths = children.write_model(Path(folder), 1200, n_windows=40)
        table = Path(folder, "table.csv")
        table.write_text("path,condition\nrun.npy,\n")
        arguments = {
            "python": ["-c", "pass"],
            "imports": ["-c", "import sklearn, pandas, skops.io"],
            "diagnose": ["-m", "skarxlag", "diagnose", *paths],
            "info": ["-m", "skarxlag", "info", paths[0]],
            "--version": ["-m", "skarxlag", "--version"],
            "--help": ["-m", "skarxlag", "--help"],
            "diagnose --unknown": ["-m", "skarxlag", "diagnose", *paths, "--unknown"],
            "fit TABLE": [
                "-m",
                "skarxlag",
                "fit",
                table,
                "-o",
                Path(folder, "new.skops"),
            ],
        }
        statuses = {"diagnose --unknown": 2, "fit TABLE": 1}
        tasks = {
            name: partial(run_python, *each, cache=folder, status=statuses.get(name, 0))
            for name, each in arguments.items()
        }
        seconds = take_turns(tasks, n_rounds, clock=_seconds_of_children)
    imports = np.median(seconds["imports"])
    lines = []
    for name in _COMMANDS:
        times, differs = ratio(seconds[name], seconds["imports"])
        lines.append(
            {
                "what": f"`skarxlag {name}`: time over the imports of scikit-learn, pandas, skops",
                "ours": f"{np.median(seconds[name]):.3g} s",
                "peer": f"imports: {imports:.3g} s",
                "reached": times,
                "target": _SHARE,
                "at_most": True,
                "spread": differs,
            }
        )
    short = {
        "--version": "",
        "--help": "",
        "diagnose --unknown": ", an unknown option",
        "fit TABLE": ", a table with an empty cell",
    }
    lines += [
        {
            "what": f"`skarxlag {name}`{why}: seconds more than an empty program of Python",
            "reached": float(np.median(seconds[name] - seconds["python"])),
            "target": _MOST_SECONDS,
            "at_most": True,
        }
        for name, why in short.items()
    ]
    return lines + _first_predictions()


def _seconds_of_children():
    """Return the processor time of all processes that this one started and that have ended."""
    times = os.times()
    return times.children_user + times.children_system


def _first_predictions(
    n_rounds=3, makers=("make_extended_state_pio", "make_diagnoser", "MiniRocket")
):
    """Measure the first fit and prediction in a new process, without the import of scikit-learn."""
    targets = {"cold": 3, "warm": 0.6}
    makers = [m for m in makers if m != "MiniRocket" or peers.is_installed("aeon")]
    seconds = {}
    with tempfile.TemporaryDirectory() as folder:
        for maker in makers:
            _run("seconds", "first_prediction", maker, cache=Path(folder, "first"))
        for turn in range(n_rounds):
            for maker in makers:
                cache = Path(folder, f"{maker}{turn}")
                for state in targets:
                    taken = _run("seconds", "first_prediction", maker, cache=cache)
                    seconds.setdefault((maker, state), []).append(taken)
    lines = []
    for (maker, state), taken in seconds.items():
        line = {
            "what": f"first fit and prediction in a fresh process, {maker}, {state} cache: seconds \
beyond `import sklearn`",
            "reached": float(np.median(taken)),
            "spread": spread(taken),
        }
        of_ours = {"target": targets[state], "at_most": True}
        lines.append(line if maker == "MiniRocket" else line | of_ours)
    return lines


def memory(n_windows=100_000, window_length=1200):
    """Return the peak memory above the imports while many windows are scored."""
    if not children.has_peak():
        return []
    tasks = {
        "`python -m skarxlag diagnose`, one recording": ("peak_of_command",),
        "`make_diagnoser().predict`, without the windows": (
            "peak_of_predict",
            "make_diagnoser",
        ),
        "`make_extended_state_pio().predict`, without the windows": (
            "peak_of_predict",
            "make_extended_state_pio",
        ),
    }
    lines = _memory_of_fit(window_length=window_length)
    with tempfile.TemporaryDirectory() as folder:
        for what, (task, *arguments) in tasks.items():
            first = [folder] if task == "peak_of_command" else arguments
            peak = _run("MiB", task, *first, n_windows, window_length, cache=folder)
            lines.append(
                {
                    "what": f"{what} of {n_windows} windows of {window_length}: MiB above the \
imports",
                    "peer": f"the windows: {n_windows * window_length * 8 / 2**20:.0f} MiB",
                    "reached": peak,
                    "target": 300,
                    "at_most": True,
                }
            )
    return lines


def _memory_of_fit(n_windows=20_000, window_length=1200):
    lines = []
    for maker in ("make_diagnoser", "make_alpio"):
        with tempfile.TemporaryDirectory() as folder:
            peak = _run(
                "MiB",
                "peak_of_fit",
                maker,
                folder,
                n_windows,
                window_length,
                cache=folder,
            )
        size = n_windows * window_length * 8 / 2**20
        lines.append(
            {
                "what": f"`{maker}().fit` on {n_windows} windows of {window_length} of four \
conditions, mapped from a file: MiB above the imports, over the size of the windows",
                "ours": f"{peak:.0f} MiB",
                "peer": f"the windows: {size:.0f} MiB",
                "reached": peak / size,
            }
        )
    return lines
