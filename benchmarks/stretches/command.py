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
from benchmarks.cross_speed.reporting import merge
from benchmarks.pages.blocks import markdown, write_blocks
from benchmarks.stretches.methods import CONDITIONS, RACES, SLOW, TRAINING, TooFew
from benchmarks.stretches.rigs import BEARINGS, locations, rigs_of_stretches
from skarxlag import bearing_orders

BLOCK = "stretches {}"
DEFAULTS = {
    "rig": ["SpectraQuest", "UESTC"],
    "method": [*CONDITIONS, *TRAINING, *RACES],
    "seconds": [0.5, 1.0, 2.0],
    "seed": [0],
}
_ALL = CONDITIONS | SLOW | TRAINING | RACES
#: The row that the others are compared with.
_OURS = next(iter(CONDITIONS))


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--rig", nargs="+", choices=list(BEARINGS), default=DEFAULTS["rig"]
    )
    parser.add_argument(
        "--method",
        nargs="+",
        choices=list(_ALL),
        default=DEFAULTS["method"],
        metavar="METHOD",
    )
    parser.add_argument("--seconds", nargs="+", type=float, default=DEFAULTS["seconds"])
    parser.add_argument(
        "--seed",
        nargs="+",
        type=int,
        default=DEFAULTS["seed"],
        help="of the simulated rig; its table is of the mean and the spread over them; default: 0",
    )
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("skarxlag-results/stretches"),
        help="folder of the CSV file; results of other runs in it are kept, so that methods may "
        "run in separate environments",
    )
    parser.add_argument("--write", type=Path, nargs="+", default=[], metavar="FILE")
    return parser.parse_args(arguments)


def speed_pairs(make_method, rig, *, of_location=False):
    """Fit on first halves at each speed, score second halves at every other.

    Parameters
    ----------
    make_method : callable
        Makes a method of ``methods``.
    rig : Bunch
        Stretches.
    of_location : bool, default=False
        Whether the method names fault locations. Compound faults are left out then.

    Yields
    ------
    dict
        ``train_rpm``, ``test_rpm``, ``accuracy``, ``location``, the accuracy on locations,
        and ``ms``, processor time of a verdict in milliseconds.
    """
    first, second = first_and_second_half(rig.recording, rig.start, rig.data.shape[-1])
    of_row = locations(rig.target)
    has_location = of_row != None  # noqa: E711
    speeds = np.unique(rig.rpm)
    for train_rpm in speeds:
        train = first & (rig.rpm == train_rpm) & (has_location | (not of_location))
        y = of_row if of_location else rig.target
        method = make_method().fit(rig.data[train], y[train], rig.rpm[train])
        for test_rpm in speeds[speeds != train_rpm]:
            test = second & (rig.rpm == test_rpm) & (has_location | (not of_location))
            clock = process_time()
            verdict = np.asarray(method.predict(rig.data[test], rig.rpm[test]))
            seconds = process_time() - clock
            named = verdict if of_location else locations(verdict)
            right = np.nan if of_location else np.mean(verdict == rig.target[test])
            yield {
                "train_rpm": train_rpm,
                "test_rpm": test_rpm,
                "accuracy": right,
                "location": np.mean((named == of_row[test])[has_location[test]]),
                "ms": 1e3 * seconds / test.sum(),
            }


def table(pairs, methods, cell):
    """Return a Markdown table of the pairs of some methods, one row a rig and method.

    Parameters
    ----------
    pairs : DataFrame
        What `speed_pairs` yields, with ``rig``, ``method``, ``seconds`` and ``seed``.
    methods : iterable of str
        Methods in the order of the rows; others are left out.
    cell : callable
        Makes the text of a cell from its pairs.
    """
    order = {name: n for n, name in enumerate(methods)}
    pairs = pairs[pairs["method"].isin(list(order))]
    keys = ["rig", "method", "seconds"]
    cells = pd.Series(
        {key: cell(rows) for key, rows in pairs.groupby(keys, sort=False)}, dtype=object
    ).rename_axis(keys)
    wide = cells.unstack("seconds").fillna("").reset_index()
    wide.columns = [f"{c:g} s" if isinstance(c, float) else c for c in wide.columns]
    return markdown(
        wide.sort_values(
            ["rig", "method"], key=lambda c: c.map(order) if c.name == "method" else c
        )
    )


def _real_cell(pairs):
    """Return the mean, worst pair and locations, or locations alone."""
    location = f"({pairs['location'].mean():.3f})"
    if pairs["accuracy"].isna().all():
        return location
    return f"{pairs['accuracy'].mean():.3f} / {pairs['accuracy'].min():.3f} {location}"


def _simulated_cell(pairs):
    """Mean and standard deviation over seeds of the mean over pairs, and worst pair of all."""
    by_seed = pairs.groupby("seed")["accuracy"].mean()
    spread = f" ± {by_seed.std():.3f}" if len(by_seed) > 1 else ""
    return f"{by_seed.mean():.3f}{spread} / {pairs['accuracy'].min():.3f}"


def blocks(pairs):
    """Return the Markdown blocks of a page by name."""
    protocol = (
        "Fitted on the first halves of the recordings of one speed, scored on the second halves at "
        "every other speed. Accuracy over stretches of the length above: mean over all pairs of "
        "speeds"
    )
    location = (
        "(of the location of the fault alone: inner race, outer race, ball, healthy)"
    )
    is_simulated = pairs["rig"].str.startswith("simulated")
    real = pairs[~is_simulated]
    simulated = pairs[is_simulated]
    texts = {}

    def add(name, rows, methods, text, cell):
        # In the order of the methods, in which order ever they were run.
        of_methods = pd.concat([rows[rows["method"] == method] for method in methods])
        if len(of_methods):
            texts[BLOCK.format(name)] = f"{text}\n\n{table(of_methods, methods, cell)}"

    add(
        "overview",
        real,
        CONDITIONS | SLOW | RACES,
        f"{protocol} / worst pair {location}. An empty cell was not run.",
        _real_cell,
    )
    if real["method"].isin(list(TRAINING)).any():
        add(
            "training",
            real,
            [*TRAINING, _OURS],
            "As in the table above, trained on the first stretches of each condition only; the "
            "last row of a rig is trained on all. A cell is empty where a condition has no more.",
            _real_cell,
        )
    n_seeds = simulated["seed"].nunique()
    add(
        "simulated",
        simulated,
        CONDITIONS | SLOW,
        f"Results of a simulation, over {n_seeds} seeds. {protocol}, its mean ± standard deviation "
        "over the seeds / worst pair of all.",
        _simulated_cell,
    )
    return texts


def main(arguments=None):
    options = parse(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    path = options.output / "pairs.csv"
    for name in options.rig:
        for seed in options.seed if name == "simulated" else [0]:
            for seconds in options.seconds:
                for label, rig in rigs_of_stretches(
                    name, seconds, options.data_home, seed
                ):
                    check_rig(rig, rig.data.shape[-1])
                    for method in options.method:
                        run = {
                            "rig": label,
                            "seconds": seconds,
                            "method": method,
                            "seed": seed,
                        }
                        _score_into(path, run, rig, BEARINGS[name])
    texts = blocks(pd.read_csv(path))
    for page in options.write:
        write_blocks(page, texts)
    print("\n\n".join(texts.values()))


def _score_into(path, run, rig, bearing):
    """Score a method on a rig, and put the result into the CSV file."""
    method = run["method"]
    label = f"{run['rig']} | seed {run['seed']} | {run['seconds']:g} s | {method}: "
    try:
        rows = pd.DataFrame(_score(method, rig, bearing))
    except TooFew:
        print(f"{label}too few stretches", file=sys.stderr, flush=True)
        return
    merge(path, rows, run)
    print(
        f"{label}{_real_cell(rows)} {rows['ms'].mean():.1f} ms",
        file=sys.stderr,
        flush=True,
    )


def _score(method, rig, bearing):
    if method in RACES:
        orders = bearing_orders(bearing)
        return speed_pairs(
            lambda: RACES[method](rig.sampling_rate, orders), rig, of_location=True
        )
    return speed_pairs(lambda: _ALL[method](rig.sampling_rate), rig)
