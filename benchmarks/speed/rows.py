"""Rows of the speed benchmark that run in this process: each function returns its measurements.

A measurement is a dict: ``what`` was measured, ``ours`` and ``peer`` in words,
``reached``, ``target`` (None where a line only informs), ``at_most`` where the target
is an upper bound, and ``spread``, how far rounds differed.
"""

import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.signal import lfilter
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, StratifiedKFold
from sklearn.pipeline import Pipeline

from benchmarks.cross_speed.peers import make_single_observer_pio
from benchmarks.speed import peers
from benchmarks.speed.counts import (
    bank_multiply_adds,
    linear_multiply_adds,
    multiply_adds,
    spectra_multiply_adds,
)
from benchmarks.speed.timing import matrix_product, ratio, take_turns
from skarxlag import (
    ARXLaguerre,
    ExtendedStatePIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
    make_extended_state_pio,
)


def coloured_windows(n_windows, n_samples=1200, n_conditions=4, seed=0):
    """Return windows of noise, with a spectral shape for each condition, and the conditions."""
    noise = np.random.default_rng(seed).normal(size=(n_windows, n_samples))
    y = np.arange(n_windows) % n_conditions
    poles = np.linspace(-0.8, 0.8, n_conditions)
    for condition in range(n_conditions):
        mine = y == condition
        noise[mine] = lfilter([1], [1, -poles[condition]], noise[mine], axis=-1)
    return noise, y


def rate(n_samples, seconds):
    """Format a rate as million samples a second."""
    return f"{n_samples / np.median(seconds) / 1e6:.3g} M samples/s"


def transforms(n_rounds=9, n_windows=800, n_samples=1200):
    """Innovations and residual levels of 8 models of order 16 against a matrix product."""
    X, y = coloured_windows(n_windows, n_samples, n_conditions=8)
    identify = ARXLaguerre(order=16).fit(X, y)
    observe = ExtendedStatePIObserver(n_observers=1).fit(identify.transform(X[:8]))
    product, n_product = matrix_product()
    coef = identify.coef_[0, :8]
    few = X[: max(n_windows // 400, 1)]
    loops = {
        "numba, a window at a time": (peers.window_at_a_time, X),
        "NumPy over windows": (peers.over_windows, X),
    }
    if peers.is_installed("filterpy"):
        loops["filterpy"] = (peers.filterpy_loop, few)
    functions = {
        "ours": lambda: observe.transform(identify.transform(X)),
        "identify": lambda: identify.transform(X),
        "product": product,
    } | {name: (lambda f=f, W=W: f(W, 0.3, coef)) for name, (f, W) in loops.items()}
    seconds = take_turns(functions, n_rounds)
    parts = multiply_adds(order=16, n_models=8)
    needed = X.size * sum(parts.values())
    what = (
        f"`ARXLaguerre.transform` + `ExtendedStatePIObserver.transform`, 8 models of order 16, \
{n_windows} x {n_samples}"
    )
    share, differs = ratio(seconds["product"] / n_product, seconds["ours"] / needed)
    product_rate = (
        f"{n_product / np.median(seconds['product']) / 1e9:.3g} G multiply-adds/s"
    )
    lines = [
        {
            "what": f"{what}: share of the matrix product's rate, {sum(parts.values())} \
multiply-adds a sample",
            "ours": rate(X.size, seconds["ours"]),
            "peer": f"matrix product: {product_rate}",
            "reached": share,
            "target": 0.35,
            "spread": differs,
        }
    ]
    only = parts["scaling"] + parts["cascade"] + parts["prediction"]
    share, differs = ratio(
        seconds["product"] / n_product, seconds["identify"] / (X.size * only)
    )
    lines.append(
        {
            "what": f"of which `ARXLaguerre.transform`, {only} multiply-adds a sample",
            "ours": rate(X.size, seconds["identify"]),
            "peer": "matrix product",
            "reached": share,
            "spread": differs,
        }
    )
    for name, (_, W) in loops.items():
        faster, differs = ratio(seconds[name] / W.size, seconds["ours"] / X.size)
        lines.append(
            {
                "what": "the same, times as fast as a plain loop of 8 states and one model",
                "ours": rate(X.size, seconds["ours"]),
                "peer": f"{name}: {rate(W.size, seconds[name])}",
                "reached": faster,
                "spread": differs,
            }
        )
    return lines


def _against_minirocket(what, seconds, target, n_samples):
    """One line: how many times as fast as MiniRocket."""
    faster, differs = ratio(seconds["others"], seconds["ours"])
    return {
        "what": what,
        "ours": rate(n_samples, seconds["ours"]),
        "peer": f"MiniRocket: {rate(n_samples, seconds['others'])}",
        "reached": faster,
        "target": target,
        "spread": differs,
    }


def alpio_predict(n_rounds=5, n_windows=800, n_samples=1200):
    """make_alpio().predict against MiniRocket's, and its share of the machine's rate."""
    X, y = coloured_windows(n_windows, n_samples)
    diagnoser = make_alpio().fit(X, y)
    n_models, order = diagnoser["identify"].coef_.shape
    counts = linear_multiply_adds(order, n_models)
    return _predict("make_alpio", diagnoser, counts, 55, X, y, n_rounds)


def extended_state_predict(n_rounds=5, n_windows=800, n_samples=1200):
    """Measure make_extended_state_pio().predict in the same way."""
    X, y = coloured_windows(n_windows, n_samples)
    diagnoser = make_extended_state_pio().fit(X, y)
    _, order = diagnoser["identify"].coef_.shape
    counts = bank_multiply_adds(order, diagnoser["observe"].n_observers)
    return _predict("make_extended_state_pio", diagnoser, counts, 45, X, y, n_rounds)


def diagnoser_predict(n_rounds=5, n_windows=800, n_samples=1200):
    """Measure make_diagnoser().predict in the same way."""
    X, y = coloured_windows(n_windows, n_samples)
    diagnoser = make_diagnoser().fit(X, y)
    innovations = diagnoser["identify"].transform(X[:1])
    _, order = diagnoser["identify"].coef_.shape
    counts = spectra_multiply_adds(order, innovations.shape[-1])
    return _predict("make_diagnoser", diagnoser, counts, 35, X, y, n_rounds)


def _predict(name, diagnoser, counts, target, X, y, n_rounds):
    """Lines of one diagnoser; `counts` are the multiply-adds per sample of its parts."""
    product, n_product = matrix_product()
    functions = {"ours": lambda: diagnoser.predict(X), "product": product}
    if peers.is_installed("aeon"):
        rocket = peers.minirocket().fit(X, y)
        functions["others"] = lambda: rocket.predict(X)
    seconds = take_turns(functions, n_rounds)
    what = f"`{name}().predict`, {len(X)} x {X.shape[1]}"
    per_sample = sum(counts.values())
    share, differs = ratio(
        seconds["product"] / n_product, seconds["ours"] / (X.size * per_sample)
    )
    parts = ", ".join(f"{part} {count}" for part, count in counts.items())
    lines = [
        {
            "what": f"{what}: share of the matrix product's rate, {per_sample} multiply-adds a \
sample ({parts})",
            "ours": rate(X.size, seconds["ours"]),
            "reached": share,
            "spread": differs,
        }
    ]
    if "others" in seconds:
        lines.insert(0, _against_minirocket(what, seconds, target, X.size))
    return lines


def diagnoser_fit(n_rounds=5, n_windows=400, n_samples=1200):
    """make_diagnoser().fit against MiniRocket's, with the given pole and with a search."""
    if not peers.is_installed("aeon"):
        return []
    X, y = coloured_windows(n_windows, n_samples)
    rocket, searched = peers.minirocket(), make_diagnoser()
    searched.set_params(identify__pole="optimise")
    lines = []
    for how, diagnoser in {
        "pole searched": searched,
        "pole given": make_diagnoser(),
    }.items():
        fits = {
            "ours": lambda diagnoser=diagnoser: diagnoser.fit(X, y),
            "others": lambda: rocket.fit(X, y),
        }
        what = f"`make_diagnoser().fit`, {n_windows} x {n_samples}, {how}"
        seconds = take_turns(fits, n_rounds)
        lines.append(_against_minirocket(what, seconds, 10, X.size))
    return lines


class CountedARXLaguerre(ARXLaguerre):
    """Counts how often models are identified."""

    n_fits = 0

    def fit(self, X, y=None):
        """Identify the models."""
        CountedARXLaguerre.n_fits += 1
        return super().fit(X, y)


def grid_search(n_rounds=3, n_windows=800, n_samples=1200, n_gains=25):
    """A search over observer gains with a cached identification against its own parts."""
    X, y = coloured_windows(n_windows, n_samples)
    folds = StratifiedKFold(2)
    gains = np.linspace(0.01, 0.04, n_gains)
    observe = ExtendedStatePIObserver(n_observers=1)
    later = Pipeline([("observe", observe), ("decide", ThresholdLadder())])
    parts = []
    for train, test in folds.split(X, y):
        identify = ARXLaguerre().fit(X[train], y[train])
        parts.append(
            (
                identify.transform(X[train]),
                y[train],
                identify.transform(X[test]),
                y[test],
            )
        )

    def fit_and_score():
        for train, y_train, test, y_test in parts:
            clone(later).fit(train, y_train).score(test, y_test)

    counts = []

    def search():
        with tempfile.TemporaryDirectory() as folder:
            diagnoser = make_single_observer_pio(memory=folder)
            diagnoser.set_params(identify=CountedARXLaguerre())
            before = CountedARXLaguerre.n_fits
            GridSearchCV(diagnoser, {"observe__ki": gains}, cv=folds, refit=False).fit(
                X, y
            )
            counts.append(CountedARXLaguerre.n_fits - before)

    seconds = take_turns({"search": search, "once": fit_and_score}, n_rounds)
    times, differs = ratio(seconds["search"] / n_gains, seconds["once"])
    what = (
        f"`GridSearchCV`, {n_gains} observer gains, 2 folds of {n_windows} x {n_samples}, \
`Pipeline(memory=...)`"
    )
    return [
        {
            "what": f"{what}: time a gain over one fit and score of observer and ladder",
            "ours": f"{np.median(seconds['search']) / n_gains * 1e3:.3g} ms a gain",
            "peer": f"observer and ladder: {np.median(seconds['once']) * 1e3:.3g} ms",
            "reached": times,
            "target": 3,
            "at_most": True,
            "spread": differs,
        },
        {
            "what": "the same: identifications a fold",
            "ours": f"{max(counts)} fits",
            "reached": max(counts) / 2,
            "target": 1,
            "at_most": True,
        },
    ]


def two_threads(n_rounds=9, n_windows=4000, n_samples=1200):
    """Measure two threads against one on a large batch, and matrix products on two threads."""
    X, y = coloured_windows(n_windows, n_samples)
    product, _ = matrix_product()
    lines = []
    for make in (make_extended_state_pio, make_diagnoser):
        one, two = (make(n_jobs=n).fit(X[:80], y[:80]) for n in (1, 2))
        with ThreadPoolExecutor(2) as threads:
            seconds = take_turns(
                {
                    "one": lambda d=one: d.predict(X),
                    "two": lambda d=two: d.predict(X),
                    "product": lambda: [product() for _ in range(4)],
                    "products": lambda t=threads: list(
                        t.map(lambda _: product(), range(4))
                    ),
                },
                n_rounds,
                clock=time.perf_counter,  # two threads spend as much processor time as one
            )
        faster, differs = ratio(seconds["one"], seconds["two"])
        possible, _ = ratio(seconds["product"], seconds["products"])
        lines.append(
            {
                "what": f"`{make.__name__}(n_jobs=2).predict`, {n_windows} x {n_samples}: times as \
fast as with `n_jobs=1`",
                "ours": rate(X.size, seconds["two"]),
                "peer": f"one thread: {rate(X.size, seconds['one'])}; matrix products on two \
threads, at the same time: {possible:.3g}",
                "reached": faster,
                "target": 1.8,
                "spread": differs,
            }
        )
    return lines
