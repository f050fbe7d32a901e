"""Images of the page of the paper's figures.

Block diagrams are drawn from their tables (SVG), the others from the simulated rig
(PNG). All are without a background, in colours that can be read on a white and on a
dark page.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from benchmarks.figures.diagrams import DIAGRAMS, draw
from benchmarks.paper.ladders import SINGLE_OBSERVER, make_single_ladder
from skarxlag import make_extended_state_pio
from skarxlag.datasets import simulate_rig
from skarxlag.plotting import (
    IdentificationDisplay,
    ResidualDisplay,
    ThresholdLadderDisplay,
    condition_styles,
)
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
#: Samples of a window that an identification is drawn of, and parts of a raw signal.
_SHOWN_SAMPLES, _BINS = 320, 800


def figures():
    """Return every figure that is drawn from signals, by the name of its file without suffix."""
    rig = simulate_rig(rpm=RPM, crack_mm=CRACK_MM)
    healthy, faulty = rig.target_names[0], rig.target_names[-1]
    is_first = rig.start < rig.start.max() / 2
    tested = np.flatnonzero(~is_first)
    ladder = make_single_ladder(SINGLE_OBSERVER, healthy=healthy)
    ladder.fit(rig.data[is_first], rig.target[is_first])
    bank = make_extended_state_pio(healthy=healthy).fit(
        rig.data[is_first], rig.target[is_first]
    )
    windows = {
        name: rig.data[tested[rig.target[tested] == name][0]]
        for name in rig.target_names
    }
    title = f"{TITLE}, {RPM} rpm"
    drawn = {
        "figure_07": identification_figure(
            ladder, rig, healthy, windows[healthy], title
        ),
        "figure_08": identification_figure(ladder, rig, faulty, windows[faulty], title),
        "figure_10": raw_signal_figure(rig, RPM, TITLE),
        "figure_11": ladder_figure(ladder, rig, tested, f"{title}: detection"),
        "ladder": ladder_figure(
            ladder, rig, tested, f"{title}: all rungs of the ladder", "isolation"
        ),
        "bank": ladder_figure(
            bank, rig, tested, f"{title}: a bank of residuals", "isolation"
        ),
    }
    for name, number in RESIDUAL_FIGURES.items():
        drawn[f"figure_{number}"] = residual_figure(
            ladder, rig, name, windows[name], title
        )
    return drawn


def new_figure(title, width, height):
    """Return a figure with a title, made without pyplot."""
    figure = Figure(figsize=(width, height), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    return figure


def identification_figure(diagnoser, rig, condition, window, title):
    """Draw the output of a window, its prediction by the healthy model, and their difference."""
    figure = new_figure(f"{title}, window of {condition}", 9, 4.6)
    display = IdentificationDisplay.from_estimator(
        diagnoser,
        window,
        condition=condition,
        conditions=rig.target_names,
        sampling_rate=rig.sampling_rate,
        axes=figure.subplots(2, sharex=True),
    )
    display.axes_[0].set_xlim(0, 1e3 * _SHOWN_SAMPLES / rig.sampling_rate)
    return figure


def raw_signal_figure(rig, rpm, title):
    """Draw the first recording of each condition at one speed.

    A signal is drawn as the area between the smallest and the largest sample of each of
    800 parts, so that no peak is lost.
    """
    names = rig.target_names
    figure = new_figure(f"{title}, {rpm:g} rpm", 9, 0.9 + 0.85 * len(names))
    styles = condition_styles(names)
    all_axes = figure.subplots(len(names), sharex=True, sharey=True, squeeze=False)[
        :, 0
    ]
    for ax, name in zip(all_axes, names, strict=True):
        chosen = (rig.target == name) & (rig.rpm == rpm)
        chosen &= rig.recording == rig.recording[chosen][0]
        windows = rig.data[chosen][np.argsort(rig.start[chosen])]
        signal = (windows[:, 0] if windows.ndim == 3 else windows).ravel()
        begins = np.unique(
            np.linspace(0, len(signal), _BINS, endpoint=False).astype(int)
        )
        low, high = (each.reduceat(signal, begins) for each in (np.minimum, np.maximum))
        color = styles[name]["color"]
        time = begins / rig.sampling_rate
        ax.fill_between(time, low, high, color=color, linewidth=0.5, step="post")
        ax.set_title(name, fontsize="small", loc="left", pad=2)
        ax.set_xlim(0, len(signal) / rig.sampling_rate)
    figure.supylabel("Output", fontsize="medium")
    all_axes[-1].set_xlabel("Time (s)")
    return figure


def ladder_figure(diagnoser, rig, chosen, title, decision="detection"):
    """Draw the levels of many windows with the thresholds of one of the ladder's decisions."""
    figure = new_figure(title, 9, 4.4)
    ThresholdLadderDisplay.from_estimator(
        diagnoser,
        rig.data[chosen],
        rig.target[chosen],
        decision=decision,
        conditions=rig.target_names,
        ax=figure.subplots(),
    )
    return figure


def residual_figure(ladder, rig, condition, window, title):
    """Draw the residual of a window, around its level and the thresholds."""
    figure = new_figure(title, 8.5, 3.2)
    display = ResidualDisplay.from_estimator(
        ladder,
        window,
        condition=condition,
        conditions=rig.target_names,
        ax=figure.subplots(),
    )
    lines = [display.level, display.detection_threshold]
    lines += display.isolation_thresholds.values()
    shown = np.array(lines)[np.isfinite(lines)]
    margin = (shown.max() - shown.min()) / 10
    display.ax_.set_ylim(shown.min() - margin, shown.max() + margin)
    return figure


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
    parser.add_argument(
        "folder", nargs="?", type=Path, default=Path("docs/paper/images")
    )
    folder = parser.parse_args(arguments).folder
    draw_diagrams(folder)
    draw_figures(folder)


if __name__ == "__main__":
    main()
