"""Rows of the speed benchmark on the cost of the checks of input."""

import sys
import time
from contextlib import contextmanager
from unittest import mock

import numpy as np

import skarxlag.core.validation
from benchmarks.speed.rows import coloured_windows
from benchmarks.speed.timing import ratio, take_turns
from skarxlag import make_diagnoser, make_extended_state_pio

#: Functions that check input. Fitted attributes are checked once for many calls.
_CHECKS = {
    "validate_data": skarxlag.core.validation,
    "validate_signals": skarxlag.core.validation,
}


@contextmanager
def timed(names):
    """Return the seconds that functions of the package take, wherever they were imported.

    Parameters
    ----------
    names : dict of str to module
        Functions, by name, and the module that has them.

    Yields
    ------
    list of float
        Seconds of each call from outside of these functions; calls of one by another
        count once.
    """
    seconds, inside = [], []

    def wrapped(function):
        def call(*args, **kwargs):
            if inside:
                return function(*args, **kwargs)
            inside.append(True)
            start = time.process_time()
            try:
                return function(*args, **kwargs)
            finally:
                seconds.append(time.process_time() - start)
                inside.pop()

        return call

    modules = [
        m
        for name, m in list(sys.modules.items())
        if name.partition(".")[0] == "skarxlag"
    ]
    wrappers = {name: wrapped(getattr(module, name)) for name, module in names.items()}
    originals = {name: getattr(module, name) for name, module in names.items()}
    patches = [
        mock.patch.object(module, name, wrappers[name])
        for module in modules
        for name, original in originals.items()
        if vars(module).get(name) is original
    ]
    for patch in patches:
        patch.start()
    try:
        yield seconds
    finally:
        for patch in patches:
            patch.stop()


def share(function, names):
    """Return the share of a call that goes into checks, and the seconds of the call.

    Parameters
    ----------
    function : callable
        What is called, once.
    names : dict of str to module
        As in `timed`.

    Returns
    -------
    share, seconds : float
        Both in processor time and of this call, so that a machine that is slow for a
        while, or has other work, slows both.
    """
    with timed(names) as seconds:
        start = time.process_time()
        function()
        whole = time.process_time() - start
    return sum(seconds) / whole, whole


def _one_row(what, predict, X, n_rounds, n_calls=50):
    """Return one line: how many times as long one row takes alone as in a batch."""
    alone = {"alone": lambda: [predict(X[:1]) for _ in range(n_calls)]}
    seconds = take_turns(alone | {"batch": lambda: predict(X)}, n_rounds)
    times, differs = ratio(seconds["alone"] / n_calls, seconds["batch"] / len(X))
    return {
        "what": f"{what}, 1 x {X.shape[1]}: time over that of a row of {len(X)}",
        "ours": f"{np.median(seconds['alone']) / n_calls * 1e6:.3g} us",
        "peer": f"in a batch: {np.median(seconds['batch']) / len(X) * 1e6:.3g} us",
        "reached": times,
        "target": 2,
        "at_most": True,
        "spread": differs,
    }


def checks(n_rounds=15, n_windows=800, n_samples=1200):
    """Return the time of one window over a window of many, and the shares of checks in both."""
    lines = []
    for make in (make_diagnoser, make_extended_state_pio):
        X, y = coloured_windows(n_windows, n_samples)
        diagnoser = make().fit(X, y)
        lines.append(
            _one_row(f"`{make.__name__}().predict`", diagnoser.predict, X, n_rounds)
        )
        for some, n_calls in ((X, 1), (X[:1], 50)):

            def calls(some=some, n_calls=n_calls, predict=diagnoser.predict):
                for _ in range(n_calls):
                    predict(some)

            calls()
            shares = np.array([share(calls, _CHECKS) for _ in range(n_rounds)])
            quarter, middle, three = np.quantile(shares[:, 0], [0.25, 0.5, 0.75])
            per_window = np.median(shares[:, 1]) / n_calls / len(some) * 1e6
            lines.append(
                {
                    "what": f"`{make.__name__}().predict`, {len(some)} x {n_samples}: "
                    "share of the checks of input",
                    "ours": f"{per_window:.3g} us a window",
                    "reached": middle,
                    "spread": (three - quarter) / 2 / middle,
                }
            )
    return lines
