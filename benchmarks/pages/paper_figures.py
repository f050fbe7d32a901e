"""Images of the page of the paper's figures.

Block diagrams are drawn from their tables (SVG), the others from the simulated rig (PNG). All are
without a background, in colours that can be read on a white and on a dark page.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np

from benchmarks.pages.diagrams import DIAGRAMS, draw
from benchmarks.paper.ladders import make_single_ladder
from skarxlag import ExtendedStatePIObserver, make_extended_state_pio
from skarxlag.commands.figures import (
    identification_figure,
    ladder_figure,
    raw_signal_figure,
    residual_figure,
)
from skarxlag.datasets import simulate_rig
from skarxlag.plotting._style import ANY_PAGE

RPM, CRACK_MM = 500, 6
#: The figure of the paper that shows the residual of each condition.
RESIDUAL_FIGURES = {
    "Normal": 12,
    "Ball": 13,
    "IR": 14,
    "OR": 15,
    "IR-Ball": 16,
    "OR-Ball": 17,
    "IR-OR": 18,
    "IR-OR-Ball": 19,
}
TITLE = f"Simulated rig, crack {CRACK_MM} mm"


def figures():
    """Return every figure that is drawn from signals, by the name of its file without suffix."""
    rig = simulate_rig(rpm=RPM, crack_mm=CRACK_MM)
    healthy, faulty = rig.target_names[0], rig.target_names[-1]
    is_first = rig.start < rig.start.max() / 2
    tested = np.flatnonzero(~is_first)
    ladder = make_single_ladder(ExtendedStatePIObserver, healthy=healthy)
    ladder.fit(rig.data[is_first], rig.target[is_first])
    bank = make_extended_state_pio(healthy=healthy).fit(rig.data[is_first], rig.target[is_first])
    windows = {name: rig.data[tested[rig.target[tested] == name][0]] for name in rig.target_names}
    title = f"{TITLE}, {RPM} rpm"
    drawn = {
        "figure_07": identification_figure(ladder, rig, healthy, windows[healthy], title),
        "figure_08": identification_figure(ladder, rig, faulty, windows[faulty], title),
        "figure_10": raw_signal_figure(rig, RPM, TITLE),
        "figure_11": ladder_figure(ladder, rig, tested, f"{title}: detection"),
        "ladder": ladder_figure(
            ladder, rig, tested, f"{title}: all rungs of the ladder", "isolation"
        ),
        "bank": ladder_figure(bank, rig, tested, f"{title}: a bank of residuals", "isolation"),
    }
    for name, number in RESIDUAL_FIGURES.items():
        drawn[f"figure_{number}"] = residual_figure(ladder, rig, {name: windows[name]}, title)
    return drawn


def draw_diagrams(folder):
    """Write the block diagrams."""
    # Without a date and with fixed ids a file changes only where its picture does.
    settings = {"svg.hashsalt": "skarxlag", "svg.fonttype": "path"}
    with matplotlib.rc_context(ANY_PAGE | settings):
        for number, diagram in DIAGRAMS.items():
            path = folder / f"figure_{number:02}.svg"
            fitted = {"bbox_inches": "tight", "pad_inches": 0.05}
            draw(diagram).savefig(path, metadata={"Date": None}, **fitted)


def draw_figures(folder):
    """Write the figures that are drawn from signals."""
    with matplotlib.rc_context(ANY_PAGE):
        for stem, figure in figures().items():
            figure.savefig(folder / f"{stem}.png", dpi=90, metadata={"Software": None})


def main(arguments=None):
    """Write all images into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=Path("docs/paper/images"))
    folder = parser.parse_args(arguments).folder
    draw_diagrams(folder)
    draw_figures(folder)


if __name__ == "__main__":
    main()
