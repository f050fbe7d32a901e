"""Rows of the speed benchmark on faults that are named by the orders of a bearing."""

import time
from concurrent.futures import ThreadPoolExecutor
from operator import itemgetter

import numpy as np

from benchmarks.fault_orders import methods
from benchmarks.fault_orders.rigs import Recording
from benchmarks.speed.peers import is_installed
from benchmarks.speed.stretches import struck
from benchmarks.speed.timing import matrix_product, ratio, spread, take_turns
from skarxlag import FaultOrderClassifier
from skarxlag.bearings import BEARINGS, bearing_orders

_RATE, _RPM, _BEARING = 51_200, 900, "6205"
#: Peers by the library that they need.
_PEERS = {
    "openconmo, envelope": "openconmo",
    "openconmo, prewhitening": "openconmo",
    "pyBearing": "pybearing",
}


def bearing(n_rounds=9, n_stretches=20, n_samples=_RATE):
    """`FaultOrderClassifier` on stretches of a second, compared with peers and on two threads."""
    orders = bearing_orders(_BEARING)
    orders_of_impacts = [None, *itemgetter("inner", "outer")(orders)]
    X = np.stack(
        [
            struck(
                orders_of_impacts[n % len(orders_of_impacts)], _RPM, [0, n], n_samples
            )
            for n in range(n_stretches)
        ]
    )
    one, two = (
        FaultOrderClassifier(bearing=_BEARING, sampling_rate=_RATE, n_jobs=n).fit(X)
        for n in (None, 2)
    )
    recorded = [
        Recording("", "", "", _RPM, _RATE, BEARINGS[_BEARING], samples) for samples in X
    ]
    turns = {
        "ours": lambda: one.predict(X, rpm=_RPM),
        "alone": lambda: one.predict(X[:1], rpm=_RPM),
    }
    for name, module in _PEERS.items():
        if is_installed(module):
            turns[name] = lambda peer=methods.PEERS[name]: [
                peer(recording) for recording in recorded
            ]
    seconds = take_turns(turns, n_rounds)
    milliseconds = 1e3 * seconds["ours"] / n_stretches
    length = f"{n_samples / _RATE:g} s at {_RATE / 1e3:g} kHz"
    what = f"`FaultOrderClassifier.predict`, {n_stretches} stretches of {length}"
    lines = [
        {
            "what": f"{what}: ms a stretch",
            "reached": float(np.median(milliseconds)),
            "spread": spread(milliseconds),
        },
        {
            "what": "the same, one stretch",
            "reached": 1e3 * float(np.median(seconds["alone"])),
            "spread": spread(seconds["alone"]),
        },
    ]
    for name in _PEERS:
        if name not in seconds:
            continue
        times, differs = ratio(seconds["ours"], seconds[name])
        of_peer = 1e3 * np.median(seconds[name]) / n_stretches
        lines.append(
            {
                "what": f"{what}: time over that of a peer's spectrum, and its peaks",
                "peer": f"{name}: {of_peer:.3g} ms a stretch",
                "reached": times,
                "target": 1,
                "at_most": True,
                "spread": differs,
            }
        )
    return [*lines, _two_threads(what, one, two, X, n_rounds)]


def _two_threads(what, one, two, X, n_rounds):
    """Return the line on two threads, next to matrix products on two threads."""
    product, _ = matrix_product()
    with ThreadPoolExecutor(2) as threads:
        seconds = take_turns(
            {
                "one": lambda: one.predict(X, rpm=_RPM),
                "two": lambda: two.predict(X, rpm=_RPM),
                "product": lambda: [product() for _ in range(4)],
                "products": lambda: list(threads.map(lambda _: product(), range(4))),
            },
            n_rounds,
            clock=time.perf_counter,  # two threads spend as much processor time as one
        )
    faster, differs = ratio(seconds["one"], seconds["two"])
    possible, _ = ratio(seconds["product"], seconds["products"])
    return {
        "what": f"{what}: times as fast with `n_jobs=2` as with one thread",
        "peer": f"matrix products on two threads, at the same time: {possible:.3g}",
        "reached": faster,
        "target": 1.6,
        "spread": differs,
    }
