"""How much the score on random rigs depends on each constant of the recommended diagnoser.

The rigs are half of those that choose in ``battery``. Nothing was chosen by this table: a constant
that matters little is worth more than one that is at its best.
"""

from functools import partial

import pandas as pd

from benchmarks.pages.blocks import markdown, page_parser, publish
from benchmarks.recipe.battery import (
    CHOOSING,
    SOURCES,
    battery,
    by_family,
    product,
    product_and_joint,
)
from skarxlag import ExtendedStatePIObserverBank, LogSpectra

#: Of the seeds that choose, as many.
N_SEEDS = 3
RECIPE, PROPOSAL = "recommended", "proposal"
#: Variants of what measures: model order, and what makes the measure.
MEASURES = {
    "model order 16": (16, LogSpectra),
    "model order 64": (64, LogSpectra),
    "segment 64": (32, partial(LogSpectra, segment=64)),
    "segment 256": (32, partial(LogSpectra, segment=256)),
    "spectrum order 64": (32, partial(LogSpectra, spectrum_order=64)),
    "power for colour": (32, partial(LogSpectra, measures=("power", "floor", "steadiness"))),
}
BANKS = {
    "32 members": (32, partial(ExtendedStatePIObserverBank, n_members=32)),
    "96 members": (32, partial(ExtendedStatePIObserverBank, n_members=96)),
    "bandwidth 1": (32, partial(ExtendedStatePIObserverBank, bandwidth=1.0)),
    "bandwidth 2.5": (32, partial(ExtendedStatePIObserverBank, bandwidth=2.5)),
    "saturation 0.02": (32, partial(ExtendedStatePIObserverBank, saturation=0.02)),
    "adaptation step 0.02": (32, partial(ExtendedStatePIObserverBank, adaptation_step=0.02)),
    "adaptation step 0.1": (32, partial(ExtendedStatePIObserverBank, adaptation_step=0.1)),
    "bank on model order 16": (16, ExtendedStatePIObserverBank),
}
DISTANCES = {
    "smooth drift 0.03": {"smooth_drift": 0.03},
    "smooth drift 0.3": {"smooth_drift": 0.3},
    "rough drift 0.003": {"rough_drift": 0.003},
    "rough drift 0.03": {"rough_drift": 0.03},
    "frequency drift 0": {"frequency_drift": 0.0},
    "frequency drift 0.3": {"frequency_drift": 0.3},
}


def variants():
    """Sources and candidates: the two recipes, and each with one constant changed."""
    sources = SOURCES | MEASURES | BANKS
    candidates = {RECIPE: product_and_joint("order 32")}
    candidates |= {f"{RECIPE}, {name}": product_and_joint(name) for name in MEASURES}
    for weight in (0.25, 0.75):
        candidates[f"{RECIPE}, joint weight {weight}"] = product_and_joint(
            "order 32", joint_weight=weight
        )
    for name, change in DISTANCES.items():
        candidates[f"{RECIPE}, {name}"] = product_and_joint("order 32", **change)
    candidates[PROPOSAL] = product("extended bank")
    candidates |= {f"{PROPOSAL}, {name}": product(name) for name in BANKS}
    for name, change in DISTANCES.items():
        candidates[f"{PROPOSAL}, {name}"] = product("extended bank", **change)
    for name, groups in (
        ("power and gain", (0, 1)),
        ("power and steadiness", (0, 2)),
        ("gain and steadiness", (1, 2)),
        ("power alone", (0,)),
        ("gain alone", (1,)),
        ("steadiness alone", (2,)),
    ):
        candidates[f"{PROPOSAL}, {name}"] = product("extended bank", groups)
    return sources, candidates


def change_table(scores):
    """Mean over families of each variant, its change, and its worst family.

    Parameters
    ----------
    scores : DataFrame
        As `battery` returns it.
    """
    families = by_family(scores)
    rows = []
    for name in families.index:
        base = families.loc[RECIPE if name.startswith(RECIPE) else PROPOSAL]
        change = families.loc[name] - base
        rows.append(
            {
                "recipe, what is changed": name,
                "mean": families.loc[name].mean(),
                "change": change.mean(),
                "largest loss": change.min(),
                "on": change.idxmin() if change.min() < 0 else "",
                "largest gain": change.max(),
            }
        )
    return pd.DataFrame(rows)


def main(arguments=None):
    """Run the command."""
    parser = page_parser(__doc__, "sensitivity")
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    sources, candidates = variants()
    scores = battery(CHOOSING[:N_SEEDS], candidates, sources=sources)
    scores.to_csv(options.output / "scores.csv", float_format="%.6g")
    publish(options, {"sensitivity": markdown(change_table(scores))})


if __name__ == "__main__":
    main()
