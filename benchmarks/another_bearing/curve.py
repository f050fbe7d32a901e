"""Measure how verdicts on another bearing depend on the number of bearings in the training.

Run ``python -m benchmarks.another_bearing curve`` from the root of the repository. The
rigs are those with three specimens of a location. Of the specimens that a fold keeps, the
first one or two of each location train, as in the main command.
"""

import sys

import numpy as np
import pandas as pd

from benchmarks.another_bearing.arguments import parse
from benchmarks.another_bearing.methods import fitted
from benchmarks.another_bearing.metrics import labelled, table
from benchmarks.another_bearing.protocol import ANOTHER, ANOTHER_SPEED, BEARINGS, folds
from benchmarks.pages.blocks import markdown, publish
from benchmarks.recipe.rigs import real_rigs

_NUMBERS = (1, 2)


def chosen(train, n_specimens):
    """Return the rows of the first specimens of each location."""
    keep = np.zeros(len(train.X), dtype=bool)
    for location in set(train.location):
        names = sorted(set(train.specimen[train.location == location]))[:n_specimens]
        keep |= (train.location == location) & np.isin(train.specimen, names)
    return train[keep]


def scored(rig):
    """Yield tables of the location probabilities of all rows of left-out specimens."""
    for fold in folds(rig):
        tests = {name: rows for name, rows in fold.tests.items() if name in _PROTOCOLS}
        for number in _NUMBERS if tests else ():
            train = chosen(fold.train, number)
            for bearing in (BEARINGS[rig.name], None):
                probabilities = fitted(rig, train, bearing, train.specimen)
                method = f"{number} of each location{', with the bearing' if bearing else ''}"
                for protocol, rows in tests.items():
                    probability = probabilities(rows.X, rows.rpm)
                    facts = {"rig": rig.name, "protocol": protocol, "method": method}
                    yield labelled(probability, rows, facts)


_PROTOCOLS = (ANOTHER, ANOTHER_SPEED)


def main(arguments=None):
    """Run the command."""
    names = [name for name in BEARINGS if name != "UESTC"]
    options = parse(arguments, __doc__, "another_bearing_curve", names)
    parts = []
    for rig in real_rigs(options.rig, options.data_home):
        parts += scored(rig)
        print(rig.name, file=sys.stderr, flush=True)
    measures = table(pd.concat(parts, ignore_index=True)).rename(
        columns={"method": "training"}
    )
    measures = measures.sort_values(["protocol", "rig"], kind="stable")
    measures.to_csv(options.output / "curve.csv", index=False)
    publish(options, {"another bearing curve": markdown(measures)})
