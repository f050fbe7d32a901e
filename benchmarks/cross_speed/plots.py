"""The chart above the tables: mean accuracy of each method at speeds that it was not fitted at."""

from itertools import cycle

from benchmarks.pages.svg_figures import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    legend_below,
    saved_figure,
)

MARKERS = [("o", BLUE), ("s", ORANGE), ("^", GREEN), ("D", PURPLE)]


def accuracy_figure(summary, path, ours):
    """Write a chart with a row for each method and a marker for each rig.

    Parameters
    ----------
    summary : DataFrame
        Rows of `reporting.summarise`; those of the shortest windows are drawn.
    path : Path
        SVG file to write.
    ours : collection of str
        Methods of this package, whose names stand in bold letters.
    """
    windows = summary[summary.verdict == "window"]
    length = windows.window_length.min()
    means = windows[windows.window_length == length].pivot(
        index="method", columns="rig", values="mean"
    )
    means = means[windows.rig.unique()]
    real = [rig for rig in means if not rig.startswith("simulated")] or list(means)
    # Open and filled markers: eight rigs with four colours that can be read on any
    # page.
    styles = [
        (marker, color, fill) for fill in ("full", "none") for marker, color in MARKERS
    ]
    means = means.loc[means[real].mean(axis=1).sort_values().index]
    height = 0.8 + 0.28 * len(means) + 0.11 * means.shape[1]
    with saved_figure(path, size=(7.0, height)) as axes:
        ax = axes[0, 0]
        for rig, (marker, color, fill) in zip(means, cycle(styles), strict=False):
            style = {"marker": marker, "color": color, "fillstyle": fill, "ls": "none"}
            ax.plot(means[rig], range(len(means)), label=rig, **style)
        ax.set_yticks(range(len(means)), means.index)
        for label in ax.get_yticklabels():
            label.set_fontweight("bold" if label.get_text() in ours else "normal")
        ax.set_xlabel(
            f"mean accuracy over pairs of different speeds, windows of {length} samples"
        )
        ax.grid(axis="x")
        legend_below(axes, n_columns=2)
