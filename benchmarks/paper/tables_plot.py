"""The chart above the tables: average accuracy of each method in the paper and in every run."""

import pandas as pd

from benchmarks.figures.style import BLUE, GREEN, ORANGE, legend_below, saved_figure

BASIS = "rows of Tables 2-5"


def averages_figure(averages, path):
    """Write a chart with a row for the paper and for each run, a marker for each method.

    Parameters
    ----------
    averages : DataFrame
        Texts of the averages that `tables.compared` gives: rows by source and basis,
        columns by method and crack size. Both crack sizes together are drawn.
    path : Path
        SVG file to write.
    """
    rows = averages.xs(BASIS, level=1)
    both = rows.xs("both", axis=1, level=1).apply(pd.to_numeric)
    names = [name.removeprefix("simulated rig, ") for name in both.index]
    with saved_figure(path, size=(6.0, 1.0 + 0.32 * len(both))) as axes:
        ax = axes[0, 0]
        for method, marker, color in zip(
            both, "osD", (ORANGE, BLUE, GREEN), strict=True
        ):
            ax.plot(
                both[method],
                range(len(both)),
                marker,
                color=color,
                label=method,
                ls="none",
            )
        ax.set_yticks(range(len(both)), names)
        ax.invert_yaxis()
        ax.set(xlim=(0, 102), xlabel="average accuracy in %, rows of Tables 2-5")
        ax.grid(axis="x")
        legend_below(axes)
