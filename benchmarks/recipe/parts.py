"""Table of what each part of `make_diagnoser` earns, in the words of the first page."""

import pandas as pd

from benchmarks.cross_speed.intervals import draws, interval
from benchmarks.pages.blocks import markdown

OVERVIEW = "ablation overview"
RECIPE = "make_diagnoser"
PROPOSAL = "make_extended_state_pio"
#: Name of a variant of `benchmarks.recipe.ablation`, by the part that it leaves out or
#: replaces.
WITHOUT = {
    "model of the signal": f"{RECIPE}, plain windows, no model",
    "measured inputs": f"{RECIPE}, measured inputs left out",
    "expected change with speed": f"{RECIPE}, no drift at all",
    "spectral shape": f"{RECIPE}, impulsiveness alone",
    "impulsiveness": f"{RECIPE}, spectral shape alone",
    "short-time spectra, in place of a bank of observers": PROPOSAL,
}
#: The columns of the table: the mean over the real rigs, and each rig.
_MEAN = "mean of rigs"


def part_table(recordings):
    """Markdown: accuracy with all parts, and what is lost without each of them.

    Parameters
    ----------
    recordings : DataFrame
        Rows of ``reporting.recording_frame`` of the variants, with one or more window
        lengths.

    Returns
    -------
    text : str
        A table for each window length. The simulated rigs do not count in the mean.
    """
    parts = [
        "Accuracy of single windows at speeds that were not used for training, and the accuracy "
        "that each part earns: with all parts, minus without this part. The mean is over the real "
        "rigs, and its interval holds 90 % of 1000 bootstrap draws of rigs and recordings."
    ]
    for length, rows in recordings.groupby("window_length"):
        table = _of_length(rows)
        if len(table):
            parts += [f"Windows of {length} samples:", markdown(table)]
    return "\n\n".join(parts)


def _of_length(recordings):
    pairs = recordings.groupby(["rig", "method", "train_rpm", "test_rpm"], sort=False)
    sums = pairs[["right", "windows"]].sum()
    accuracy = (
        (sums.right / sums.windows)
        .groupby(["method", "rig"], sort=False)
        .mean()
        .unstack()
    )
    accuracy = accuracy[recordings.rig.unique()].dropna()
    is_real = ~accuracy.columns.str.startswith("simulated")
    accuracy.insert(0, _MEAN, accuracy.loc[:, is_real].mean(axis=1))
    if RECIPE not in accuracy.index:
        return pd.DataFrame()
    real = recordings[recordings.rig.isin(accuracy.columns[1:][is_real])]
    lines = [
        {"part": "all parts"} | accuracy.loc[RECIPE].map("{:.3f}".format).to_dict()
    ]
    for part, variant in WITHOUT.items():
        if variant not in accuracy.index:
            continue
        earned = (accuracy.loc[RECIPE] - accuracy.loc[variant]).map("{:+.3f}".format)
        mean_draws = draws(real[real.method.isin([RECIPE, variant])])[_MEAN]
        limits = interval(mean_draws[RECIPE] - mean_draws[variant])
        lines.append({"part": part} | earned.to_dict() | {"90 % interval": limits})
    table = pd.DataFrame(lines).fillna("")
    columns = ["part", _MEAN, "90 % interval", *accuracy.columns[1:]]
    return table[[name for name in columns if name in table]]
