"""Dot plots of the long tables of README, docs and benchmarks.

``python -m benchmarks.pages.dot_plots`` reads the csv files in docs/tables, which the
commands of these tables write, and draws docs/images/dots_NAME.svg next to each.
"""

import argparse
import re
from typing import NamedTuple

import numpy as np

from benchmarks.pages.dot_tables import RIG, TABLES, read_table
from benchmarks.pages.modules import ROOT
from benchmarks.pages.svg_figures import BLUE, GREEN, GREY, ORANGE, PURPLE, saved_figure

#: Colour and marker of each series, in the order of their first appearance.
SERIES = (
    (BLUE, "o"),
    (ORANGE, "D"),
    (GREEN, "s"),
    (PURPLE, "^"),
    ("#D55E00", "v"),
    ("#56B4E9", "P"),
)
#: Inches of a row, of all that is not a row, and of the width of a page.
ROW_HEIGHT, FRAME_HEIGHT, WIDTH = 0.21, 1.1, 8.0
LONGEST_LABEL = 58
#: Largest part of a row that series with intervals take, and that of two neighbours.
SPREAD, LANE = 0.6, 0.25


class Layout(NamedTuple):
    """Number of panels next to each other, and label, scale and limits of their axis."""

    columns: int = 2
    label: str = "share of right verdicts"
    scale: str = "linear"
    limits: tuple | None = None


LAYOUTS = {
    "ablation": Layout(columns=1, label="share of right verdicts at other speeds"),
    "detection_families": Layout(columns=1, label="missed faults, %"),
    "unknown": Layout(label="rows that are rejected, %"),
    "other_kinds": Layout(label="rows that are rejected, %"),
    "fault_orders_stretches": Layout(columns=1, label="stretches of 1 s, %"),
    "stretches_training": Layout(),
    "cross-speed_overview": Layout(label="share of right verdicts at other speeds"),
    "targets": Layout(label="share of right verdicts at other speeds"),
    "ablation_overview": Layout(label="accuracy that the part earns"),
    "another_bearing": Layout(label="share of right fault locations", limits=(0, 1.03)),
    "another_bearing_curve": Layout(
        label="share of right fault locations, 90 % interval", limits=(0, 1.03)
    ),
    "another_bearing_overview": Layout(
        columns=1,
        label="share of right fault locations, 90 % interval over bearings",
        limits=(0, 1.03),
    ),
    "another_bearing_noise": Layout(
        columns=1, label="rows that are named with a probability of at least 0.9, %"
    ),
    "fault_orders_runs": Layout(columns=1, label="seconds from the name to the end"),
    "soak": Layout(columns=1, label="memory of the process (MiB)", limits=(0, 400)),
    "recording_evidence": Layout(columns=1, label="share of right verdicts"),
    "few_healthy_snapshots": Layout(
        columns=1, label="time of the alarm, share of the run", limits=(0, 1.03)
    ),
    "bearings": Layout(columns=1, label="order (impacts per revolution of the shaft)"),
    "detection": Layout(label="share of rows, %"),
    "fault_orders_joint": Layout(
        label="share of right fault locations", limits=(0, 1.03)
    ),
    "fault_orders_methods": Layout(columns=1, label="share of right fault locations"),
    "fault_orders_named": Layout(columns=1, label="recordings, %"),
    "fleet-scale": Layout(columns=1, label="sensors at the limit", scale="log"),
    "signal_quality": Layout(
        columns=1, label="rows that are refused, %", limits=(-4, 104)
    ),
    "speed": Layout(columns=1, label="times as fast as the peer", scale="log"),
    "stretches_overview": Layout(label="share of right verdicts"),
    "stretches_simulated": Layout(label="share of right verdicts"),
}


def draw(name, path):
    """Draw the dot plot of a table.

    Parameters
    ----------
    name : str
        Key of `TABLES` and `LAYOUTS`.
    path : Path
        File to write.
    """
    table = read_table(name)
    layout = LAYOUTS[name]
    panels = list(table["panel"].unique())
    n_columns = layout.columns
    grid = [panels[i : i + n_columns] for i in range(0, len(panels), n_columns)]
    # Panels next to each other share their rows.
    labels = [table.loc[table["panel"].isin(line), "row"].unique() for line in grid]
    heights = [max(len(rows), 2) for rows in labels]
    series = [label for label in table["series"].unique() if label != RIG]
    styles = dict(zip(series, SERIES, strict=False))
    is_spread = len(series) > 1 and table["low"].notna().any()
    row_height = ROW_HEIGHT * (2 if is_spread else 1)
    size = (WIDTH, row_height * sum(heights) + FRAME_HEIGHT * len(grid))
    with saved_figure(
        path,
        len(grid),
        n_columns,
        size=size,
        height_ratios=heights,
        sharex=True,
        sharey="row",
    ) as axes:
        for line, rows, line_of_axes in zip(grid, labels, axes, strict=True):
            for ax in line_of_axes:
                ax.set_axis_off()
            for ax, panel in zip(line_of_axes, line, strict=False):
                ax.set_axis_on()
                _draw_panel(ax, table[table["panel"] == panel], list(rows), styles)
                ax.set_title(panel, fontsize=9, loc="left")
                ax.set_xscale(layout.scale)
                if layout.limits:
                    ax.set_xlim(layout.limits)
        axes[0, 0].figure.supxlabel(layout.label, fontsize=9)
        _draw_legend(axes[0, 0].figure, styles, RIG in set(table["series"]))


def _draw_panel(ax, table, rows, styles):
    """Draw the rows of one panel: dots of each series, and intervals as lines."""
    rigs = table[table["series"] == RIG]
    positions = [rows.index(row) for row in rigs["row"]]
    ax.plot(rigs["value"], positions, "|", color=GREY, alpha=0.8, markersize=6)
    has_intervals = table["low"].notna().any()
    spread = min(SPREAD, (len(styles) - 1) * LANE) if has_intervals else 0.0
    shifts = spread * np.linspace(-0.5, 0.5, len(styles))
    for shift, (label, style) in zip(shifts, styles.items(), strict=True):
        dots = table[table["series"] == label]
        height = shift + np.array([rows.index(row) for row in dots["row"]])
        color, marker = style
        ax.hlines(height, dots["low"], dots["high"], color=color, linewidth=1)
        ax.plot(dots["value"], height, marker, color=color, markersize=5, alpha=0.85)
    ax.set_yticks(range(len(rows)), [_shorten(row) for row in rows], fontsize=8)
    ax.set_ylim(len(rows) - 0.5, -0.5)
    ax.grid(axis="both", linewidth=0.5)
    ax.tick_params(length=0)


def _shorten(label):
    plain = re.sub("[`*]", "", label)
    return plain if len(plain) <= LONGEST_LABEL else plain[: LONGEST_LABEL - 1] + "…"


def _draw_legend(figure, styles, has_rigs):
    from matplotlib.lines import Line2D

    marks = {**styles, "one rig": (GREY, "|")} if has_rigs else styles
    if len(marks) < 2:
        return
    handles = [
        Line2D([], [], color=color, linestyle="", marker=marker, label=label)
        for label, (color, marker) in marks.items()
    ]
    has_long_labels = max(map(len, marks)) > LONGEST_LABEL / 2
    figure.legend(
        handles=handles,
        loc="outside upper left",
        ncols=1 if has_long_labels else 3,
        frameon=False,
        fontsize=8,
    )


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", nargs="*", help=f"one or more of {', '.join(TABLES)}")
    for name in parser.parse_args(arguments).name or TABLES:
        draw(name, ROOT / "docs" / "images" / f"dots_{name}.svg")


if __name__ == "__main__":
    main()
