"""Rows of the speed benchmark on identification; measurements as in `rows`."""

import numpy as np
from scipy.signal import lfilter

from benchmarks.speed import peers
from benchmarks.speed.rows import rate
from benchmarks.speed.timing import ratio, spread, take_turns
from skarxlag import ARXLaguerre


def system_with_input(n_samples, seed=0):
    """Return the output and input of a stable system of second order."""
    rng = np.random.default_rng(seed)
    u, noise = rng.normal(size=(2, n_samples))
    return lfilter([1], [1, -1.5, 0.7], lfilter([0, 0.5, 0.3], [1], u) + 0.1 * noise), u


def identification(n_rounds=5, n_samples=1_000_000):
    """Identification of 8+8 coefficients with fixed poles against libraries and plain NumPy."""
    y, u = system_with_input(n_samples)
    X = np.stack([y, u])[np.newaxis]
    cut = np.moveaxis(X[0].reshape(2, -1, n_samples // 800), 1, 0).copy()
    model = ARXLaguerre(order=8)
    libraries = peers.identification_peers()
    ours = {"one window": lambda: model.fit(X), "800 windows": lambda: model.fit(cut)}
    plain = {"NumPy": lambda: peers.normal_equations(y, u, 8)}
    seconds = take_turns(ours | plain, n_rounds)
    # Each takes seconds and needs no more rounds.
    seconds |= take_turns(
        {n: (lambda f=f: f(y, u, 8)) for n, f in libraries.items()}, 1
    )
    what = f"`ARXLaguerre(order=8).fit`, one input, {n_samples} samples"
    lines = [
        {
            "what": f"{what} in {cutting}: million samples a second",
            "ours": rate(n_samples, seconds[cutting]),
            "reached": n_samples / np.median(seconds[cutting]) / 1e6,
            "target": 20,
            "spread": spread(seconds[cutting]),
        }
        for cutting in ours
    ]
    faster, differs = ratio(seconds["NumPy"], seconds["one window"])
    lines.append(
        {
            "what": f"{what}: times as fast as normal equations in NumPy",
            "peer": f"NumPy: {rate(n_samples, seconds['NumPy'])}",
            "reached": faster,
            "spread": differs,
        }
    )
    best = min(libraries, key=lambda name: seconds[name][0], default=None)
    for name in libraries:
        line = {
            "what": f"{what}: times as fast as a library"
            + (", the fastest of them" if name == best else ""),
            "peer": f"{name}: {rate(n_samples, seconds[name])}",
            "reached": seconds[name][0] / np.median(seconds["one window"]),
        }
        lines.append(line | ({"target": 10} if name == best else {}))
    return lines


def pole_search(n_rounds=5, lengths=(1, 10, 100, 1000), n_samples=1200):
    """The fit that searches its poles against the fit with given ones, for several lengths."""
    lines = []
    for n_inputs in (0, 1):
        for n_windows in lengths:
            X = np.stack(system_with_input(n_windows * n_samples)[: 1 + n_inputs])
            X = np.moveaxis(X.reshape(1 + n_inputs, n_windows, n_samples), 1, 0).copy()
            given, searched = (
                ARXLaguerre(order=8),
                ARXLaguerre(order=8, pole="optimise"),
            )
            seconds = take_turns(
                {
                    "given": lambda m=given, X=X: m.fit(X),
                    "searched": lambda m=searched, X=X: m.fit(X),
                },
                n_rounds,
            )
            times, differs = ratio(seconds["searched"], seconds["given"])
            lines.append(
                {
                    "what": f"`ARXLaguerre(order=8).fit` with a pole search, {n_windows} x \
{n_samples}, {n_inputs} inputs: times as long as with given poles",
                    "ours": f"{np.median(seconds['searched']) * 1e3:.3g} ms",
                    "peer": f"given: {np.median(seconds['given']) * 1e3:.3g} ms",
                    "reached": times,
                    "target": 3,
                    "at_most": True,
                    "spread": differs,
                }
            )
    return lines
