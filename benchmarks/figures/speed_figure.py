"""Figure of the distances from each condition over the speed of the shaft.

``python -m benchmarks.figures.speed_figure`` writes docs/images/distances.svg. Windows of
a fault of the outer race of the UESTC rig are compared with references at one speed,
and with references that are interpolated between two speeds.
"""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.figures.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    legend_below,
    saved_figure,
)
from benchmarks.recordings import fetch_uestc
from skarxlag import make_diagnoser

WINDOW_LENGTH, SHOWN = 4800, "O"
CONDITIONS = {
    "O": ("outer race (the true condition)", ORANGE, "o"),
    "I": ("inner race", BLUE, "s"),
    "B": ("ball", GREEN, "^"),
    "N": ("healthy", PURPLE, "D"),
}
TRAINED = {
    "references at one speed": [800],
    "references at two speeds, interpolated": [800, 1400],
}


def distances(rig, trained):
    """Compute the distances of windows of second halves, fitted on first halves.

    Parameters
    ----------
    rig : Bunch
        As `fetch_uestc` returns it.
    trained : list of float
        Speeds with references.

    Returns
    -------
    dict of str to ndarray of shape (n_speeds, 3)
        Quartiles of the distance from each condition, at all speeds of the rig.
    """
    is_first = rig.start < np.median(rig.start)
    trained_rows = is_first & np.isin(rig.rpm, trained)
    diagnoser = make_diagnoser(healthy="N")
    diagnoser.fit(
        rig.data[trained_rows], rig.target[trained_rows], rpm=rig.rpm[trained_rows]
    )
    quartiles = []
    for speed in np.unique(rig.rpm):
        tested = ~is_first & (rig.rpm == speed) & (rig.target == SHOWN)
        levels = diagnoser.diagnose(rig.data[tested], rpm=rig.rpm[tested]).levels
        quartiles.append(np.percentile(levels, [25, 50, 75], axis=0))
    of_conditions = np.moveaxis(quartiles, 2, 0)
    return dict(zip(diagnoser.classes_, of_conditions, strict=True))


def draw(path, rig):
    """Draw the distances with each choice of speeds for the fit."""
    speeds = np.unique(rig.rpm)
    with saved_figure(path, 1, 2, size=(7.5, 3.6), sharex=True, sharey=True) as axes:
        for ax, (title, trained) in zip(axes[0], TRAINED.items(), strict=True):
            of_conditions = distances(rig, trained)
            for condition, (name, color, marker) in CONDITIONS.items():
                lower, median, upper = of_conditions[condition].T
                ax.fill_between(speeds, lower, upper, color=color, alpha=0.2, lw=0)
                ax.plot(speeds, median, marker=marker, color=color, label=name)
            for speed in trained:
                ax.axvline(speed, color=GREY, linestyle=":", linewidth=1)
            ax.set_title(title, fontsize=9)
            ax.set_xlabel("speed of the shaft (rpm); dotted: with references")
            ax.set_xticks(speeds)
        axes[0, 0].set_ylabel("distance from the condition")
        axes[0, 0].set_yscale("log")
        axes[0, 0].set_ylim(0.4, 2.6)
        axes[0, 0].set_yticks([0.5, 1, 2], ["0.5", "1", "2"])
        axes[0, 0].minorticks_off()
        legend_below(axes, n_columns=4)


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded recordings")
    parser.add_argument(
        "--figure", type=Path, default=Path("docs/images/distances.svg")
    )
    options = parser.parse_args(arguments)
    draw(
        options.figure,
        fetch_uestc(window_length=WINDOW_LENGTH, data_home=options.data_home),
    )


if __name__ == "__main__":
    main()
