"""Plots of the sensitivity studies, for light and dark pages."""

import numpy as np

from benchmarks.pages.svg_figures import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    legend_below,
    saved_figure,
)
from benchmarks.paper.sensitivity.compound import COMPOUND, KNOWN
from benchmarks.paper.sensitivity.tables import varied

COLOURS = {"ALPIO": ORANGE, "Extended state": BLUE, "Diagnoser": GREEN}
MARKERS = {"ALPIO": "s", "Extended state": "^", "Diagnoser": "o"}
VERDICTS = dict(zip(KNOWN, (GREY, ORANGE, BLUE, GREEN), strict=True))


def _over_draws(frame, keys):
    within = frame.groupby([*keys, "seed"], sort=False).accuracy.mean()
    return within.groupby(keys, sort=False).agg(["mean", "std"]).fillna({"std": 0.0})


def lines(frame, path, *, x, scale="linear", split=None):
    """Accuracy against a setting, one panel for each crack size, bars of one standard deviation.

    Parameters
    ----------
    frame : DataFrame
        Of a study.
    path : Path
        SVG to write.
    x : str
        Column of the setting; text is spaced evenly.
    scale : {"linear", "log"}
        Of the setting.
    split : str or None
        Column with two values: the second is drawn dashed.
    """
    ticks = list(dict.fromkeys(frame[x]))
    even = any(isinstance(tick, str) for tick in ticks)
    kinds = [None] if split is None else list(dict.fromkeys(frame[split]))
    with saved_figure(path, 1, 2, sharey=True) as axes:
        for ax, (crack_mm, part) in zip(
            axes[0], frame.groupby("crack_mm"), strict=True
        ):
            for name, of_diagnoser in part.groupby("diagnoser", sort=False):
                for kind, dash in zip(kinds, ("-", "--"), strict=False):
                    rows = of_diagnoser
                    if kind is not None:
                        rows = rows[rows[split] == kind]
                    spread = _over_draws(rows, [x])
                    where = (
                        [ticks.index(each) for each in spread.index]
                        if even
                        else spread.index
                    )
                    ax.errorbar(
                        where,
                        spread["mean"],
                        spread["std"],
                        color=COLOURS[name],
                        marker=MARKERS[name],
                        markersize=4,
                        linestyle=dash,
                        linewidth=1.2,
                        label=name if dash == "-" else None,
                    )
            ax.set(
                title=f"{crack_mm:g} mm crack", xlabel=x, xscale=scale, ylim=(0, 103)
            )
            if even or scale == "log":
                ax.set_xticks(
                    range(len(ticks)) if even else ticks, [f"{t}" for t in ticks]
                )
                ax.minorticks_off()
            ax.grid()
        axes[0, 0].set_ylabel("Accuracy (%)")
        if split is not None:
            for kind, dash in zip(kinds, ("-", "--"), strict=True):
                axes[0, 0].plot([], [], dash, color=GREY, label=f"{split} {kind}")
        legend_below(axes)


def bars(frame, path, *, panel, group, label):
    """Accuracy of each diagnoser by group, bars of one standard deviation.

    Parameters
    ----------
    frame : DataFrame
        Of a study.
    path : Path
        SVG to write.
    panel : str
        Column with two values, one for each panel.
    group : list of str
        Columns that identify groups of bars.
    label : str
        What the names of the groups say.
    """
    panels = frame.groupby(panel, sort=False)
    with saved_figure(path, 1, panels.ngroups, size=(8.5, 2.8), sharey=True) as axes:
        for ax, (title, part) in zip(axes[0], panels, strict=True):
            spread = _over_draws(part, [*group, "diagnoser"]).reset_index()
            names = list(
                dict.fromkeys(spread[group].astype(str).agg("\n".join, axis=1))
            )
            for n, (name, rows) in enumerate(spread.groupby("diagnoser", sort=False)):
                where = np.arange(len(rows)) + 0.27 * (n - 1)
                style = {"color": COLOURS[name], "ecolor": GREY, "label": name}
                ax.bar(where, rows["mean"], 0.25, yerr=rows["std"], **style)
            ax.set_xticks(range(len(names)), names, fontsize=7)
            ax.set(title=title, xlabel=label, ylim=(0, 103))
            ax.grid(axis="y")
            ax.set_axisbelow(True)
        axes[0, 0].set_ylabel("Accuracy (%)")
        legend_below(axes)


def gain_maps(frame, path):
    """Accuracy over each grid of gains; refused cells are empty and crossed."""
    grids = [(name, grid) for name, grid in frame.groupby("grid", sort=False)]
    grids = [
        (name, grid.dropna(axis=1, how="all"))
        for name, grid in grids
        if name != "evaluation"
    ]
    ratios = [grid[varied(grid)[1]].nunique() for _, grid in grids]
    with saved_figure(
        path, 1, len(grids), size=(8.5, 3.2), width_ratios=ratios
    ) as axes:
        for ax, (name, grid) in zip(axes[0], grids, strict=True):
            rows, columns = varied(grid)
            table = grid.groupby([rows, columns]).accuracy.mean().unstack()
            ax.imshow(
                table, vmin=0, vmax=100, cmap="cividis", aspect="auto", origin="lower"
            )
            for (row, column), value in np.ndenumerate(table.to_numpy()):
                refused = np.isnan(value)
                ax.text(
                    column,
                    row,
                    "x" if refused else f"{value:.0f}",
                    ha="center",
                    va="center",
                    color=GREY if refused else "black" if value > 55 else "white",
                    fontsize=8,
                )
            ax.set_xticks(
                range(table.shape[1]), [f"{each:g}" for each in table.columns]
            )
            ax.set_yticks(range(table.shape[0]), [f"{each:g}" for each in table.index])
            ax.set(title=name, xlabel=columns, ylabel=rows)
            ax.title.set_fontsize(9)
            ax.spines[:].set_visible(False)


def verdict_shares(frame, path):
    """Verdicts on the conditions that are not in the calibration, at other speeds."""
    unseen = frame[frame.condition.isin(COMPOUND) & (frame["tested at"] != "500 rpm")]
    unseen = unseen.dropna(subset="named")
    names = list(dict.fromkeys(unseen.diagnoser))
    with saved_figure(
        path, 2, len(names), size=(7.5, 3.8), sharex=True, sharey=True
    ) as axes:
        for row, (crack_mm, part) in zip(axes, unseen.groupby("crack_mm"), strict=True):
            for ax, name in zip(row, names, strict=True):
                shares = (
                    part[part.diagnoser == name]
                    .groupby("condition")
                    .mean(numeric_only=True)
                )
                shares = shares.loc[list(reversed(COMPOUND))]
                start = np.zeros(len(COMPOUND))
                for verdict, colour in VERDICTS.items():
                    share = shares[f"as {verdict}"].to_numpy()
                    ax.barh(
                        range(len(COMPOUND)),
                        share,
                        left=start,
                        color=colour,
                        label=verdict,
                    )
                    start += share
                ax.set_yticks(range(len(COMPOUND)), shares.index)
                ax.set(title=f"{name}, {crack_mm:g} mm", xlim=(0, 100))
        for ax in axes[-1]:
            ax.set_xlabel("Share of windows (%)")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        axes[0, 0].figure.legend(
            handles,
            labels,
            title="Verdict",
            loc="outside right upper",
            frameon=False,
        )
