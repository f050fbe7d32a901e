"""Speed, start-up and memory next to peers and to the machine's own limit, in one run.

    python -m benchmarks.speed
    python -m benchmarks.speed --only transforms identification
    python -m benchmarks.speed --write benchmarks/README.md

The sides of a ratio are timed in turn in the same run, on one thread and in CPU time
unless the line states otherwise. The median of the ratios is printed and, as spread,
half the range between their quartiles. Libraries that are not installed are left out,
and named below the table.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from benchmarks.pages.blocks import markdown, write_blocks
from benchmarks.speed import (
    bearing,
    checks,
    fleet,
    identification,
    monitor,
    peers,
    processes,
    rows,
    scale,
    stretches,
)
from benchmarks.speed.timing import matrix_product, ratio, take_turns

ROWS = {
    "transforms": rows.transforms,
    "alpio-predict": rows.alpio_predict,
    "extended-state-predict": rows.extended_state_predict,
    "diagnoser-predict": rows.diagnoser_predict,
    "diagnoser-fit": rows.diagnoser_fit,
    "checks": checks.checks,
    "monitor": monitor.monitor,
    "sensors": monitor.sensors,
    "stretches": stretches.stretches,
    "bearing": bearing.bearing,
    "identification": identification.identification,
    "pole-search": identification.pole_search,
    "grid-search": rows.grid_search,
    "two-threads": rows.two_threads,
    "start-up": processes.start_up,
    "memory": processes.memory,
    "fleet": fleet.fleet,
    "scale": scale.scale,
}


def table(measurements):
    """Measurements as a data frame with the columns that are published.

    Parameters
    ----------
    measurements : list of dict
        As `rows` describes them.

    Examples
    --------
    >>> lines = [{"what": "a", "reached": 2.5, "target": 3, "at_most": True, "spread": 0.04}]
    >>> table(lines).to_dict("records")
    [{'what': 'a', 'ours': '', 'next to': '', 'measured': '2.5', 'spread': '4%'}]
    """
    return pd.DataFrame(
        {
            "what": line["what"],
            "ours": line.get("ours", ""),
            "next to": line.get("peer", ""),
            "measured": f"{line['reached']:.3g}",
            "spread": f"{line['spread']:.0%}" if "spread" in line else "",
        }
        for line in measurements
    )


def missed_targets(measurements):
    """One sentence for each measurement that is worse than the target of its row.

    Parameters
    ----------
    measurements : list of dict
        As `rows` describes them.
    """
    sentences = []
    for line in measurements:
        target, reached = line.get("target"), line["reached"]
        at_most = line.get("at_most", False)
        if target is not None and (reached > target if at_most else reached < target):
            bound = "at most" if at_most else "at least"
            sentences.append(
                f"{line['what']}: {reached:.3g}, target {bound} {target:g}"
            )
    return sentences


def machine():
    """Describe the machine: rate of the matrix product, and its spread between runs."""
    product, n_product = matrix_product()
    seconds = take_turns({"first": product, "second": product}, 15)
    rate = n_product / np.median(seconds["first"]) / 1e9
    spread = ratio(seconds["first"], seconds["second"])[1]
    return (
        f"Matrix product in float64 on one thread: {rate:.3g} G multiply-adds/s. The ratio of one "
        f"product to the next has a spread of {spread:.0%}, which is the machine's noise."
    )


def main(arguments=None):
    """Measure, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--only", nargs="+", choices=ROWS, default=list(ROWS), metavar="ROW"
    )
    parser.add_argument(
        "--write", type=Path, metavar="FILE", help="Markdown file for the table"
    )
    options = parser.parse_args(arguments)
    measurements = []
    with threadpool_limits(1):
        about = machine()
        for name in options.only:
            print(f"{name} ...", file=sys.stderr, flush=True)
            measurements += ROWS[name]()
    missing = peers.missing_libraries()
    block = "\n\n".join(
        [markdown(table(measurements)), about]
        + ([f"Not installed, so left out: {', '.join(missing)}."] if missing else [])
    )
    print(block)
    print(*missed_targets(measurements), sep="\n", file=sys.stderr)
    if options.write:
        write_blocks(options.write, {"speed": block})
