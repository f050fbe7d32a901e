"""Time and memory next to peers, each figure a ratio within one run.

``python -m benchmarks.speed`` measures all rows, and writes them to benchmarks/README.md.
``--method`` selects rows. Both sides of a ratio take turns, on one thread and in
processor time, unless the row states otherwise. The figure is the median of the ratios,
and the spread half the range between their quartiles.
"""

import os
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.blocks import ROOT
from benchmarks.fault_orders import order_contrasts
from benchmarks.peers import PEERS, minirocket
from skarxlag import (
    ConditionMonitor,
    FaultOrderClassifier,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
    save_diagnoser,
)

_ROUNDS = 3
#: Windows of the batches and their samples; Hz and rpm of stretches.
_N_WINDOWS, _LENGTH = 800, 1200
_RATE, _RPM, _BEARING = 51_200, 900, "6205"
#: Windows on which the memory of a fit is measured.
_FIT_WINDOWS = 20_000
DIAGNOSERS = {
    each.__name__: each
    for each in (make_diagnoser, make_extended_state_pio, make_alpio)
}


def take_turns(functions, n_rounds=_ROUNDS, clock=time.process_time):
    """Return the seconds of each function, called one after another in every round."""
    for function in functions.values():
        function()
    seconds = {name: np.empty(n_rounds) for name in functions}
    for turn in range(n_rounds):
        for name, function in functions.items():
            start = clock()
            function()
            seconds[name][turn] = clock() - start
    return seconds


def ratio(what, above, below, ours):
    """Return a line with the median of the ratios within a round, and their spread.

    Examples
    --------
    >>> ratio("a", np.array([2.0, 4.0]), np.array([1.0, 2.0]), 0.001)
    {'what': 'a', 'measured': 2.0, 'spread': 0.0, 'ours': '1 ms'}
    """
    ratios = above / below
    low, median, high = np.quantile(ratios, [0.25, 0.5, 0.75])
    line = {"what": what, "measured": round(float(median), 3)}
    line["spread"] = round(float((high - low) / (2 * median)), 3)
    return line | {"ours": f"{1e3 * ours:.3g} ms"}


def batches():
    """Coloured noise of four conditions."""
    rng = np.random.default_rng(0)
    X = rng.normal(size=(_N_WINDOWS, _LENGTH)).cumsum(axis=1)
    y = np.arange(_N_WINDOWS) % 4
    poles = np.array([0.0, 0.4, 0.8, -0.6])[y, np.newaxis]
    X[:, 1:] -= poles * X[:, :-1]
    return np.diff(X, axis=1, prepend=0), y


def predict():
    """`predict` of a batch next to peers."""
    yield from _beside(lambda fitted, X, y: fitted.predict(X), "`predict`")


def fit():
    """`fit` of a batch next to peers."""
    yield from _beside(lambda fitted, X, y: fitted.fit(X, y), "`fit`")


def _beside(task, name):
    X, y = batches()
    peers = {"log spectrum + SVM": PEERS["log spectrum + SVM"]}
    if find_spec("aeon"):
        peers["MiniRocket"] = minirocket
    fitted = {key: make().fit(X, y) for key, make in (DIAGNOSERS | peers).items()}
    turns = {key: lambda each=each: task(each, X, y) for key, each in fitted.items()}
    seconds = take_turns(turns)
    for peer in peers:
        for maker in DIAGNOSERS:
            what = f"{name} of {_N_WINDOWS} windows: {peer} over `{maker}`"
            yield ratio(what, seconds[peer], seconds[maker], np.median(seconds[maker]))


def one_row():
    """`predict` of one window, over its share of a batch."""
    X, y = batches()
    fitted = make_diagnoser().fit(X, y)
    turns = {
        "one": lambda: [fitted.predict(X[:1]) for _ in range(20)],
        "batch": lambda: fitted.predict(X),
    }
    seconds = take_turns(turns)
    one, share = seconds["one"] / 20, seconds["batch"] / _N_WINDOWS
    yield ratio("one window over its share of a batch", one, share, np.median(one))


def stretches():
    """Stretches of a second: alone over a batch, and with a bearing over plain envelopes."""
    rng = np.random.default_rng(0)
    X = rng.normal(size=(16, _RATE))
    X[::2, :: _RATE // 50] += 10
    y = np.arange(16) % 2
    fitted = make_diagnoser(sampling_rate=_RATE).fit(X, y, rpm=_RPM)
    combs = FaultOrderClassifier(bearing=_BEARING, sampling_rate=_RATE).fit(X)
    turns = {
        "one": lambda: fitted.predict(X[:1], rpm=_RPM),
        "batch": lambda: fitted.predict(X, rpm=_RPM),
        "combs": lambda: combs.predict(X, rpm=_RPM),
        "envelopes": lambda: order_contrasts(X, _RPM, _RATE, _BEARING),
    }
    seconds = take_turns(turns)
    one, batch = seconds["one"], seconds["batch"] / len(X)
    yield ratio("one stretch over its share of a batch", one, batch, np.median(one))
    what = "`FaultOrderClassifier` over the plain order contrasts of 15 bands"
    combs = seconds["combs"]
    yield ratio(what, combs, seconds["envelopes"], np.median(combs) / len(X))


def monitor():
    """A running sensor in blocks, over `diagnose` of the same samples."""
    X, y = batches()
    fitted = make_diagnoser().fit(X, y)
    signal = X.ravel()[: 4 * 25_600]
    windows = signal[: len(signal) // _LENGTH * _LENGTH].reshape(-1, _LENGTH)
    for seconds_of_block in (0.1, 1.0):
        blocks = np.split(signal, round(4 / seconds_of_block))
        running = ConditionMonitor(fitted, 25_600.0)
        turns = {
            "monitor": lambda blocks=blocks, running=running: [
                running.update(block) for block in blocks
            ],
            "diagnose": lambda: fitted.diagnose(windows),
        }
        seconds = take_turns(turns)
        what = f"`ConditionMonitor` in blocks of {seconds_of_block:g} s over `diagnose`"
        ours = np.median(seconds["monitor"]) / 4
        yield ratio(what, seconds["monitor"], seconds["diagnose"], ours)


def threads():
    """One thread over two, in time that passes."""
    X, y = batches()
    X, y = np.tile(X, (4, 1)), np.tile(y, 4)
    one, two = (make_diagnoser().set_params(**_jobs(n)).fit(X, y) for n in (None, 2))
    turns = {"one": lambda: one.predict(X), "two": lambda: two.predict(X)}
    seconds = take_turns(turns, clock=time.perf_counter)
    what = "`predict`: one thread over two, in time that passes"
    yield ratio(what, seconds["one"], seconds["two"], np.median(seconds["two"]))


def _jobs(n_jobs):
    names = make_diagnoser().get_params()
    return {name: n_jobs for name in names if name.endswith("n_jobs")}


def start():
    """Commands and the first verdict in new processes, over the imports that they need."""
    code = (
        "import numpy as np, skarxlag; X = np.random.default_rng(0).normal(size=(40, 1200));"
        "skarxlag.make_diagnoser().fit(X, np.arange(40) % 4).predict(X)"
    )
    commands = {
        "an empty program": ["-c", "pass"],
        "imports of scikit-learn and pandas": ["-c", "import sklearn, pandas"],
        "`skarxlag --version`": ["-m", "skarxlag", "--version"],
        "first fit and prediction, compiled before": ["-c", code],
    }
    with tempfile.TemporaryDirectory() as cache:
        turns = {
            name: lambda arguments=arguments: _child(arguments, cache)
            for name, arguments in commands.items()
        }
        seconds = take_turns(turns, clock=_seconds_of_children)
    imports = seconds["imports of scikit-learn and pandas"]
    for name in list(commands)[2:]:
        what = f"{name}, over the imports of scikit-learn and pandas"
        yield ratio(what, seconds[name], imports, np.median(seconds[name]))
    cold = []
    for _ in range(3):
        with tempfile.TemporaryDirectory() as cache:
            before = _seconds_of_children()
            _child(commands["first fit and prediction, compiled before"], cache)
            cold.append(_seconds_of_children() - before)
            # numba keeps one such file for each function and types of its arguments.
            n_compiled = len([*Path(cache).rglob("*.nbc")])
    what = "the same with an empty cache"
    yield ratio(what, np.array(cold), imports[:3], np.median(cold))
    yield {"what": "functions that it compiles", "measured": float(n_compiled)}


def _child(arguments, cache):
    environment = dict(os.environ, NUMBA_CACHE_DIR=cache, OMP_NUM_THREADS="1")
    command = [sys.executable, *arguments]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=environment,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return done.stdout


def _seconds_of_children():
    used = os.times()
    return used.children_user + used.children_system


def memory():
    """Peak memory of a fit on mapped windows, above the imports and without the windows."""
    code = """
import sys, numpy as np, skarxlag
def state(name):
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith(name)) / 1024
make = getattr(skarxlag, sys.argv[1])
X = np.load(sys.argv[2], mmap_mode="r")
make().fit(X[:40], np.arange(40) % 4)
before = state("VmRSS")
make().fit(X, np.arange(len(X)) % 4)
print(state("VmHWM") - before)
"""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "windows.npy")
        size = (_FIT_WINDOWS, _LENGTH)
        windows = np.lib.format.open_memmap(path, "w+", np.float64, size)
        rng = np.random.default_rng(0)
        for part in np.split(windows, 20):
            part[:] = rng.normal(size=part.shape)
        mapped = windows.nbytes / 2**20
        del windows
        for maker in DIAGNOSERS:
            # Pages of the mapped file count in the peak.
            peak = float(_child(["-c", code, maker, str(path)], folder)) - mapped
            what = (
                f"memory of `{maker}().fit` on {_FIT_WINDOWS} windows, over the windows"
            )
            line = {"what": what, "measured": round(peak / mapped, 2)}
            yield line | {"ours": f"{peak:.0f} MiB"}


def recordings(n_recordings=100):
    """`skarxlag diagnose` of recordings of a second, over `diagnose` of their samples."""
    X, y = batches()
    names = [str(label) for label in range(4)]
    fitted = make_diagnoser().fit(X, np.array(names)[y])
    with tempfile.TemporaryDirectory() as folder:
        save_diagnoser(
            fitted,
            Path(folder, "m.skops"),
            conditions=names,
            sampling_rate=25_600.0,
            window_length=_LENGTH,
        )
        for number in range(n_recordings):
            rows = np.take(X, range(number, number + 21), axis=0, mode="wrap")
            np.save(Path(folder, f"{number}.npy"), rows.ravel())
        diagnose = ["-m", "skarxlag", "diagnose", f"{folder}/m.skops", "-q"]
        files = sorted(map(str, Path(folder).glob("*.npy")))
        output = ["-o", f"{folder}/out.csv", "--force"]
        turns = {
            "one": lambda: _child([*diagnose, files[0], *output], folder),
            "all": lambda: _child([*diagnose, *files, *output], folder),
        }
        command = take_turns(turns, clock=_seconds_of_children)
        windows = X[:21]
        samples = take_turns({"ours": lambda: fitted.diagnose(windows)})["ours"]
    of_one = (command["all"] - command["one"]) / (n_recordings - 1)
    what = (
        "a recording of a second in `skarxlag diagnose`, over `diagnose` of its windows"
    )
    yield ratio(what, of_one, samples, np.median(of_one))


ROWS = {
    each.__name__: each
    for each in (
        *(predict, fit, one_row, stretches, monitor),
        *(threads, start, memory, recordings),
    )
}


def lines(home=None, methods=ROWS):
    """Yield the lines of some rows."""
    # Threads of a peer that wait for their next loop would count as our time.
    with threadpool_limits(1):
        for method in methods:
            for line in ROWS[method]():
                yield {"method": method} | line


if __name__ == "__main__":
    from benchmarks.tables import main

    main(["speed", *sys.argv[1:]])
