"""Draw the picture of the README and of the landing page: recordings, model, residuals, verdict.

``python -m benchmarks.pages.overview [--data-home FOLDER]`` reads the UESTC recordings
(see docs/data.md), fits `make_diagnoser` at 800 rpm and diagnoses what was recorded at
1400 rpm. The picture has no background, in colours that can be read on a white and on a
dark page.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from skarxlag import make_diagnoser, recording_verdicts
from skarxlag.datasets import fetch_uestc
from skarxlag.plotting import condition_styles
from skarxlag.plotting._style import ANY_PAGE, NEUTRAL

TRAIN_RPM, TEST_RPM, WINDOW_LENGTH = 800, 1400, 4800
NAMES = {"N": "healthy", "B": "ball", "I": "inner race", "O": "outer race"}
SHOWN = ("N", "O")


def overview(rig):
    """The four panels of the picture.

    Parameters
    ----------
    rig : Bunch
        As `fetch_uestc` returns it.

    Returns
    -------
    matplotlib Figure
        Signals, innovations, residuals and verdicts.
    """
    half = np.median(rig.start)
    known = np.flatnonzero((rig.rpm == TRAIN_RPM) & (rig.start < half))
    new = np.flatnonzero((rig.rpm == TEST_RPM) & (rig.start >= half))
    diagnoser = make_diagnoser(healthy="N").fit(rig.data[known], rig.target[known])
    figure = Figure(figsize=(10, 7.2), layout="constrained")
    top, bottom = figure.subplots(2, 2)
    styles = condition_styles(rig.target_names)
    _draw_recordings(top[0], rig, known, new, styles)
    _draw_innovations(top[1], rig, diagnoser, new, styles)
    _draw_residuals(bottom[0], rig, diagnoser, new)
    _draw_verdicts(bottom[1], rig, diagnoser, new, styles)
    return figure


def _first(rig, rows, name):
    return rig.data[rows[rig.target[rows] == name][0]]


def _draw_recordings(ax, rig, known, new, styles):
    shown = 800
    time = 1e3 * np.arange(shown) / rig.sampling_rate
    lines = [(name, rows) for name in SHOWN for rows in (known, new)]
    for place, (name, rows) in enumerate(lines):
        window = _first(rig, rows, name)[:shown]
        ax.plot(
            time,
            window / np.abs(window).max() / 3.2 - place,
            lw=0.8,
            **_color(styles, name),
        )
        rpm = TRAIN_RPM if rows is known else TEST_RPM
        ax.text(0, 0.33 - place, f"{NAMES[name]}, {rpm} rpm", fontsize=11, va="bottom")
    ax.set_ylim(-3.5, 0.7)
    _finish(ax, "1. Recordings: one speed is known", "Time (ms)")


def _draw_innovations(ax, rig, diagnoser, new, styles):
    shown = 400
    window = _first(rig, new, "O")[np.newaxis]
    left = diagnoser[0].transform(window)[0, 0]
    scaled = ((window - window.mean()) / window.std())[0, -len(left) :]
    time = 1e3 * np.arange(shown) / rig.sampling_rate
    ax.plot(time, scaled[:shown], color=NEUTRAL, lw=1.0)
    ax.plot(time, left[:shown] - 14, lw=1.0, **_color(styles, "O"))
    ax.text(0, 4, "signal", fontsize=11)
    ax.text(0, -9.5, "what the model cannot predict", fontsize=11)
    ax.set_ylim(-22, 8)
    _finish(ax, "2. A model predicts the signal", "Time (ms)")


def _draw_residuals(ax, rig, diagnoser, new):
    residuals = diagnoser[:-1].transform(rig.data[new])
    order = np.argsort(
        [rig.target_names.index(name) for name in rig.target[new]], kind="stable"
    )
    columns = [diagnoser.classes_.tolist().index(name) for name in rig.target_names]
    relative = residuals[order][:, columns] / residuals[order].min(
        axis=1, keepdims=True
    )
    ax.imshow(
        relative,
        aspect="auto",
        cmap="viridis_r",
        vmin=1,
        vmax=2,
        interpolation="nearest",
    )
    counts = [np.sum(rig.target[new] == name) for name in rig.target_names]
    edges = np.concatenate([[0], np.cumsum(counts)]) - 0.5
    for edge in edges[1:-1]:
        ax.axhline(edge, color="white", lw=1.5)
    ax.set_yticks(
        (edges[1:] + edges[:-1]) / 2, [NAMES[name] for name in rig.target_names]
    )
    ax.set_xticks(range(len(columns)), [NAMES[name] for name in rig.target_names])
    ax.tick_params(length=0, labelsize=11)
    ax.set_title("3. Distance to each condition", fontsize=14, loc="left")
    ax.set_ylabel(f"windows at {TEST_RPM} rpm", fontsize=11)
    ax.set_xlabel("bright: near", fontsize=11)


def _draw_verdicts(ax, rig, diagnoser, new, styles):
    table = recording_verdicts(
        diagnoser, rig.data[new], rig.target[new], rig.target_names
    )
    for place, name in enumerate(rig.target_names):
        share = table.loc[name, f"share of {name}"]
        ax.barh(-place, share, height=0.55, **_color(styles, name))
        ax.text(
            0.02,
            -place,
            f"verdict: {NAMES[table.loc[name, 'verdict']]}",
            va="center",
            fontsize=12,
            color="white",
        )
    ax.set_yticks([-place for place in range(len(rig.target_names))])
    ax.set_yticklabels([f"{NAMES[name]}" for name in rig.target_names], fontsize=11)
    ax.set_xlim(0, 1)
    ax.set_xticks([0, 0.5, 1], ["0", "50 %", "100 %"])
    _finish(ax, "4. Verdict at the new speed", "Share of windows that agree")
    ax.spines["left"].set_visible(False)


def _color(styles, name):
    return {"color": styles[name]["color"]}


def _finish(ax, title, label):
    ax.set_title(title, fontsize=14, loc="left")
    ax.set_xlabel(label, fontsize=11)
    if ax.get_yticklabels() and not ax.containers:
        ax.set_yticks([])
    for side in ("top", "right", "left") if not ax.containers else ("top", "right"):
        ax.spines[side].set_visible(False)


def main():
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded recordings")
    parser.add_argument("-o", "--output", default=Path("docs/_static/overview.png"))
    options = parser.parse_args()
    rig = fetch_uestc(data_home=options.data_home, window_length=WINDOW_LENGTH)
    with matplotlib.rc_context(ANY_PAGE | {"font.size": 11}):
        overview(rig).savefig(options.output, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
