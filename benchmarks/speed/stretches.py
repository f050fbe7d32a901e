"""Rows of the speed benchmark on stretches of a second."""

import numpy as np

from benchmarks.speed.timing import take_turns
from skarxlag import make_diagnoser

_RATE, _RPM = 51_200, 900
#: Orders of the shaft at which the conditions are struck; the first is healthy.
_ORDERS = (None, 3.58, 4.71, 5.42)
_TARGET = 8.0


def struck(order, rpm, seed, n_samples):
    """Noise with impacts at an order of the shaft."""
    signal = np.random.default_rng(seed).normal(size=n_samples)
    if order is not None:
        signal[np.arange(0, n_samples, 60 * _RATE / (rpm * order)).astype(int)] += 20
    return signal


def stretches(n_rounds=9, n_stretches=20, n_samples=_RATE):
    """Milliseconds for a stretch of a second at 51.2 kHz: several, one, and without a speed."""

    def rows(rpm, each, seed):
        return np.stack(
            [
                struck(order, rpm, [seed, number, n], n_samples)
                for number, order in enumerate(_ORDERS)
                for n in range(each)
            ]
        )

    y = np.repeat(["healthy", "outer", "ball", "inner"], 4)
    diagnoser = make_diagnoser(sampling_rate=_RATE).fit(rows(_RPM, 4, 0), y, rpm=_RPM)
    X = rows(700, -(-n_stretches // len(_ORDERS)), 1)[:n_stretches]
    rpm = np.full(len(X), 700.0)
    orders = diagnoser["decide"].residual_.order_residual_
    innovations = diagnoser[:1].transform(X)
    seconds = take_turns(
        {
            "several": lambda: diagnoser.predict(X, rpm=rpm),
            "one": lambda: diagnoser.predict(X[:1], rpm=rpm[:1]),
            "no speed": lambda: diagnoser.predict(X),
            "orders": lambda: orders.transform(innovations, rpm=rpm),
            "orders, no speed": lambda: orders.transform(innovations),
        },
        n_rounds,
    )
    length = f"{n_samples / _RATE:g} s at {_RATE / 1e3:g} kHz"
    predict = "`make_diagnoser().predict`"
    what = {
        "several": f"{predict}, {len(X)} stretches of {length}: ms a stretch",
        "one": "the same, one stretch",
        "no speed": f"the same, {len(X)} stretches without `rpm`",
        "orders": f"`OrderResidual.transform`, {len(X)} stretches: ms a stretch",
        "orders, no speed": "the same without `rpm`",
    }
    return [
        {
            "what": what[name],
            "reached": 1e3 * float(np.median(each)) / (1 if name == "one" else len(X)),
            "target": _TARGET if name == "several" else None,
            "at_most": True,
            "spread": float(
                np.subtract(*np.quantile(each, [0.75, 0.25])) / 2 / np.median(each)
            ),
        }
        for name, each in seconds.items()
    ]
