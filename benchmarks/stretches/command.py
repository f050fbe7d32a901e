"""Accuracy on stretches at shaft speeds that a method was not fitted at.

Run ``python -m benchmarks.stretches`` from the root of the repository.
"""

import argparse
import sys
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd

from benchmarks.cross_speed.protocol import check_rig, first_and_second_half
from benchmarks.pages.blocks import markdown, write_blocks
from benchmarks.stretches.methods import CONDITIONS, RACES, SLOW
from benchmarks.stretches.rigs import BEARINGS, places, rig_of_stretches
from skarxlag import fault_orders

BLOCK = "stretches overview"
DEFAULTS = {"rig": ["hit_sm", "uestc"], "seconds": [0.5, 1.0, 2.0], "method": [*CONDITIONS, *RACES]}
_KEYS = ["rig", "seconds", "method"]


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rig", nargs="+", choices=list(BEARINGS), default=DEFAULTS["rig"])
    parser.add_argument(
        "--method",
        nargs="+",
        choices=[*CONDITIONS, *RACES, *SLOW],
        default=DEFAULTS["method"],
        metavar="METHOD",
    )
    parser.add_argument("--seconds", nargs="+", type=float, default=DEFAULTS["seconds"])
    parser.add_argument("--seed", type=int, default=0, help="of the simulated rig; default: 0")
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument("--output", type=Path, default=Path("skarxlag-results/stretches"))
    parser.add_argument("--write", type=Path, nargs="+", default=[], metavar="FILE")
    return parser.parse_args(arguments)


def speed_pairs(make_method, rig, *, of_place=False):
    """Fit on first halves at each speed, score second halves at every other.

    Parameters
    ----------
    make_method : callable
        Makes a method of ``methods``.
    rig : Bunch
        Stretches.
    of_place : bool, default=False
        Whether the method names places of faults. Compound faults are left out then.

    Yields
    ------
    dict
        ``train_rpm``, ``test_rpm``, ``accuracy``, ``place``, the accuracy on places, and
        ``ms``, processor time of a verdict in milliseconds.
    """
    first, second = first_and_second_half(rig.recording, rig.start, rig.data.shape[-1])
    of_row = places(rig.target)
    has_place = of_row != None  # noqa: E711
    speeds = np.unique(rig.rpm)
    for train_rpm in speeds:
        train = first & (rig.rpm == train_rpm) & (has_place | (not of_place))
        y = of_row if of_place else rig.target
        method = make_method().fit(rig.data[train], y[train], rig.rpm[train])
        for test_rpm in speeds[speeds != train_rpm]:
            test = second & (rig.rpm == test_rpm) & (has_place | (not of_place))
            clock = process_time()
            verdict = np.asarray(method.predict(rig.data[test], rig.rpm[test]))
            seconds = process_time() - clock
            named = verdict if of_place else places(verdict)
            right = np.nan if of_place else np.mean(verdict == rig.target[test])
            yield {
                "train_rpm": train_rpm,
                "test_rpm": test_rpm,
                "accuracy": right,
                "place": np.mean((named == of_row[test])[has_place[test]]),
                "ms": 1e3 * seconds / test.sum(),
            }


def summarise(pairs):
    """Mean and worst pair by rig, length and method, one row a method."""
    table = pairs.groupby(_KEYS, sort=False).agg(
        mean=("accuracy", "mean"), worst=("accuracy", "min"), place=("place", "mean")
    )
    cells = table.apply(_cell, axis=1).unstack("seconds").reset_index()
    cells.columns = [f"{c:g} s" if isinstance(c, float) else c for c in cells.columns]
    order = {name: n for n, name in enumerate([*CONDITIONS, *SLOW, *RACES])}
    return cells.sort_values(
        ["rig", "method"], key=lambda c: c.map(order) if c.name == "method" else c
    )


def _cell(row):
    if np.isnan(row["mean"]):
        return f"({row['place']:.3f})"
    return f"{row['mean']:.3f} / {row['worst']:.3f} ({row['place']:.3f})"


def overview(pairs, command):
    """Markdown table with the command that makes it."""
    text = (
        f"Made by `{command}`. Fitted on the first halves of the recordings of one speed, scored "
        "on the second halves at every other speed. Accuracy over stretches of the length above: "
        "mean over all pairs of speeds / worst pair (of the place of the fault alone: inner race, "
        "outer race, ball, healthy)."
    )
    return f"{text}\n\n{markdown(summarise(pairs))}"


def main(arguments=None):
    options = parse(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / "pairs.csv"
    pairs = pd.read_csv(path) if path.exists() else pd.DataFrame(columns=[*_KEYS, "accuracy"])
    for name in options.rig:
        for seconds in options.seconds:
            rig = rig_of_stretches(name, seconds, options.data_home, options.seed)
            check_rig(rig, rig.data.shape[-1])
            for method in options.method:
                rows = pd.DataFrame(_score(name, rig, method))
                rows.insert(0, "rig", name)
                rows.insert(1, "seconds", seconds)
                rows.insert(2, "method", method)
                known = (pairs[_KEYS] == [name, seconds, method]).all(axis=1)
                pairs = rows if pairs[~known].empty else pd.concat([pairs[~known], rows])
                pairs.to_csv(path, index=False)
                said = f"{name} | {seconds:g} s | {method}: {_cell(_means(rows))}"
                print(f"{said} {rows['ms'].mean():.1f} ms", file=sys.stderr, flush=True)
    block = overview(pairs, _command(pairs))
    for page in options.write:
        write_blocks(page, {BLOCK: block})
    print(block)


def _score(name, rig, method):
    if method in RACES:
        orders = fault_orders(BEARINGS[name])
        return speed_pairs(lambda: RACES[method](rig.sampling_rate, orders), rig, of_place=True)
    return speed_pairs(lambda: (CONDITIONS | SLOW)[method](rig.sampling_rate), rig)


def _means(rows):
    accuracy = rows["accuracy"]
    return {"mean": accuracy.mean(), "worst": accuracy.min(), "place": rows["place"].mean()}


def _command(pairs):
    """What makes all results that are there, in any number of runs."""
    said = ["python -m benchmarks.stretches"]
    for name, default in DEFAULTS.items():
        found = pairs[name].unique().tolist()
        chosen = [each for each in default if each in found]
        chosen += [each for each in found if each not in chosen]
        if chosen != default:
            quoted = [f"'{each}'" if " " in str(each) else str(each) for each in chosen]
            said.append(f"--{name} {' '.join(quoted)}")
    return " ".join(said)
