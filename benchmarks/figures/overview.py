"""Draw the picture of the README: recordings, model, distances, verdicts.

``python -m benchmarks.figures.overview [--data-home FOLDER]`` reads the UESTC recordings
(see docs/data.md), fits `make_diagnoser` at 800 rpm and diagnoses what was recorded at
1400 rpm. The picture has no background, in colours that can be read on a white and on a
dark page.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from scipy.signal import welch

from benchmarks.recordings import fetch_uestc
from skarxlag import make_diagnoser, recording_verdicts
from skarxlag.plotting import condition_styles
from skarxlag.plotting._style import ANY_PAGE, NEUTRAL

TRAIN_RPM, TEST_RPM, WINDOW_LENGTH, STRETCH_LENGTH = 800, 1400, 4800, 20_000
NAMES = {"N": "healthy", "B": "ball", "I": "inner race", "O": "outer race"}
SHOWN = ("N", "O")
#: Speeds of the last panel with their markers, and samples of a segment of a spectrum.
NEW_SPEEDS, SEGMENT = {1000: "o", 1200: "s", 1400: "D"}, 256


def overview(rig, stretches):
    """The four panels of the picture.

    Parameters
    ----------
    rig, stretches : Bunch
        As `fetch_uestc` returns it, with windows, and with stretches of a second.

    Returns
    -------
    matplotlib Figure
        Signals, spectra, distances and verdicts.
    """
    half = np.median(rig.start)
    training = np.flatnonzero((rig.rpm == TRAIN_RPM) & (rig.start < half))
    new = np.flatnonzero((rig.rpm == TEST_RPM) & (rig.start >= half))
    diagnoser = make_diagnoser(healthy="N").fit(
        rig.data[training], rig.target[training]
    )
    figure = Figure(figsize=(10, 7.2), layout="constrained")
    top, bottom = figure.subplots(2, 2)
    styles = condition_styles(rig.target_names)
    _draw_recordings(top[0], rig, training, new, styles)
    _draw_innovations(top[1], rig, diagnoser, new, styles)
    _draw_residuals(bottom[0], rig, diagnoser, new)
    _draw_verdicts(bottom[1], stretches, styles)
    return figure


def _first(rig, rows, name):
    return rig.data[rows[rig.target[rows] == name][0]]


def _draw_recordings(ax, rig, training, new, styles):
    shown = 800
    time = 1e3 * np.arange(shown) / rig.sampling_rate
    lines = [(name, rows) for name in SHOWN for rows in (training, new)]
    for line, (name, rows) in enumerate(lines):
        window = _first(rig, rows, name)[:shown]
        ax.plot(
            time,
            window / np.abs(window).max() / 3.2 - line,
            lw=0.8,
            **_color(styles, name),
        )
        rpm = TRAIN_RPM if rows is training else TEST_RPM
        ax.text(0, 0.33 - line, f"{NAMES[name]}, {rpm} rpm", fontsize=11, va="bottom")
    ax.set_ylim(-3.5, 0.7)
    _finish(ax, "1. Recordings: one speed is known", "Time (ms)")


def _draw_innovations(ax, rig, diagnoser, new, styles):
    windows = rig.data[new[rig.target[new] == "O"]]
    innovations = diagnoser[0].transform(windows)[:, 0]
    lines = (
        ("signal", windows, {"color": NEUTRAL}),
        ("what the model cannot predict", innovations, _color(styles, "O")),
    )
    for label, rows, style in lines:
        rows = (rows - rows.mean(axis=1, keepdims=True)) / rows.std()
        frequency, power = welch(rows, rig.sampling_rate, nperseg=SEGMENT)
        level = 10 * np.log10(power.mean(axis=0) * rig.sampling_rate / 2)
        ax.plot(frequency[1:-1] / 1000, level[1:-1], lw=1.4, label=label, **style)
    ax.legend(frameon=False, fontsize=11, loc="lower center")
    ax.set_ylabel("Power (dB)", fontsize=11)
    ax.set_title("2. A model predicts the signal", fontsize=14, loc="left")
    ax.set_xlabel("Frequency (kHz), outer race", fontsize=11)
    ax.spines[["top", "right"]].set_visible(False)


def _draw_residuals(ax, rig, diagnoser, new):
    residuals = diagnoser.diagnose(rig.data[new]).levels
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


def _draw_verdicts(ax, stretches, styles):
    """Draw the verdicts of second halves, fitted on stretches of one speed."""
    is_first = stretches.start < np.median(stretches.start)
    training = is_first & (stretches.rpm == TRAIN_RPM)
    diagnoser = make_diagnoser(healthy="N", sampling_rate=stretches.sampling_rate)
    diagnoser.fit(stretches.data[training], stretches.target[training], rpm=TRAIN_RPM)
    names = stretches.target_names
    for speed, marker in NEW_SPEEDS.items():
        tested = ~is_first & (stretches.rpm == speed)
        table = recording_verdicts(
            diagnoser,
            stretches.data[tested],
            stretches.target[tested],
            names,
            rpm=speed,
            train_rpm=[TRAIN_RPM],
        )
        for line, name in enumerate(names):
            verdict = table.loc[name]
            color = styles[name]["color"] if verdict["verdict"] == name else NEUTRAL
            ax.plot(verdict["probability"], -line, marker, color=color, ms=9)
        ax.plot([], [], marker, color=NEUTRAL, label=f"{speed} rpm", ls="", ms=9)
    ax.set_yticks(-np.arange(len(names)), [NAMES[name] for name in names], fontsize=11)
    ax.set_ylim(0.6 - len(names), 0.9)
    ax.set_xlim(0, 1.02)
    ax.set_xticks([0, 0.5, 1], ["0", "50 %", "100 %"])
    ax.grid(axis="y", alpha=0.3)
    ax.legend(frameon=False, fontsize=10, loc="upper left", ncols=3, columnspacing=1)
    ax.set_title("4. Verdicts on recordings at new speeds", fontsize=14, loc="left")
    ax.set_xlabel("Probability; grey: a fault, location uncertain", fontsize=11)
    ax.spines[["top", "right", "left"]].set_visible(False)


def _color(styles, name):
    return {"color": styles[name]["color"]}


def _finish(ax, title, label):
    ax.set_title(title, fontsize=14, loc="left")
    ax.set_xlabel(label, fontsize=11)
    ax.set_yticks([])
    ax.spines[["top", "right", "left"]].set_visible(False)


def main():
    """Write the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded recordings")
    parser.add_argument("-o", "--output", default=Path("docs/_static/overview.png"))
    options = parser.parse_args()
    rig, stretches = (
        fetch_uestc(data_home=options.data_home, window_length=length)
        for length in (WINDOW_LENGTH, STRETCH_LENGTH)
    )
    with matplotlib.rc_context(ANY_PAGE | {"font.size": 11}):
        overview(rig, stretches).savefig(
            options.output, dpi=110, metadata={"Software": None}
        )


if __name__ == "__main__":
    main()
