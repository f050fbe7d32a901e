"""Name the fault location on another bearing, at the same and at other speeds and loads.

Run ``python -m benchmarks.another_bearing`` from the root of the repository. The folder
of the rigs is ``$SKARXLAG_DATA``. Rows are 1 s long; `protocol.py` describes the folds.
Results of a rig are kept in a csv file in the output folder. They are not computed again
until the code changes. `fit` receives the specimens, as the curve does.
"""

import sys
from functools import partial

import pandas as pd

from benchmarks.another_bearing.arguments import parse
from benchmarks.another_bearing.methods import METHODS
from benchmarks.another_bearing.metrics import labelled, table
from benchmarks.another_bearing.protocol import (
    ANOTHER,
    ANOTHER_LOAD,
    ANOTHER_SPEED,
    SAME_BEARING,
    folds,
)
from benchmarks.pages.blocks import markdown, publish
from benchmarks.pages.kept import kept_or_computed
from benchmarks.recipe.rigs import real_rigs

_ORDER = [ANOTHER, ANOTHER_SPEED, ANOTHER_LOAD, SAME_BEARING]
_OURS = list(METHODS)[:2]
_CELLS = (
    "Rows of 1 s. A cell has the share of right locations / the expected calibration error / the "
    "share of rows stated with a probability of at least .9 : the share of these that is right, "
    "which is left out below 30 rows."
)
_NOTE = (
    "Rows of 1 s. *right*: share of right locations, with an interval of 90 % from a bootstrap of "
    "specimens. *error*: expected calibration error. *stated*: share of rows stated with a "
    "probability of at least .9, and *of these* the share that is right, empty below 30 rows. "
    "Training and test rows share no bearing, no mounting and no recording, but for “same bearing, "
    "other speed”, where they share the bearing and its mounting. The rows of Paderborn at another "
    "load share the rig and the speed."
)


def scored(rig):
    """Return the probabilities of the locations of all test rows, by all methods."""
    parts = []
    for fold in folds(rig):
        for name, method in METHODS.items():
            for protocol, probability in method(rig, fold.train, fold.tests):
                rows = fold.tests[protocol]
                facts = {"rig": rig.name, "protocol": protocol, "method": name}
                parts.append(labelled(probability, rows, facts))
        print(rig.name, len(parts), file=sys.stderr, flush=True)
    return pd.concat(parts, ignore_index=True)


def overview(measures):
    """Return the table of README: our recommended diagnoser on another bearing, by rig."""
    shown = measures[
        measures["method"].isin(_OURS) & (measures["protocol"] == ANOTHER_SPEED)
    ]
    return shown.drop(columns=["protocol", "AUROC", "log loss"])


def side_by_side(measures):
    """Return a table with a column for each method, and the main measures in its cells."""
    cells = [
        f"{row['right'].partition(' ')[0]} / {row['error']:.2f} / {row['stated']:.2f}"
        + ("" if pd.isna(row["of these"]) else f" : {row['of these']:.2f}")
        for _, row in measures.iterrows()
    ]
    keys = ["protocol", "rig", "rows", "method"]
    table = measures[keys].assign(cell=cells).set_index(keys)["cell"].unstack()
    order = list(
        dict.fromkeys(
            zip(measures["protocol"], measures["rig"], measures["rows"], strict=True)
        )
    )
    return table.loc[order, list(METHODS)].reset_index()


def main(arguments=None):
    """Run the command."""
    options = parse(arguments, __doc__, "another_bearing")
    frames = [
        kept_or_computed(
            options.output / f"{rig.name}.csv", "another-bearing", partial(scored, rig)
        )
        for rig in real_rigs(options.rig, options.data_home)
    ]
    measures = table(pd.concat(frames))
    measures["protocol"] = pd.Categorical(measures["protocol"], _ORDER, ordered=True)
    measures = measures.sort_values("protocol", kind="stable")
    publish(
        options,
        {
            "another bearing": f"{_CELLS}\n\n{markdown(side_by_side(measures))}",
            "another bearing measures": f"{_NOTE}\n\n{markdown(measures)}",
            "another bearing overview": markdown(overview(measures)),
        },
    )
