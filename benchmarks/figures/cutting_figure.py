"""Figure of a recording that is cut into windows and into stretches.

``python -m benchmarks.figures.cutting_figure`` writes docs/images/cutting.svg. The
recording is of SpectraQuest, a fault of the outer race at 900 rpm.
"""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.figures.style import BLUE, GREEN, GREY, ORANGE, saved_figure
from benchmarks.recordings import fetch_hit_sm
from skarxlag import bearing_orders

CONDITION, RPM, BEARING = "OR5", 900, "6205"
#: Samples of a window, and seconds of a stretch.
WINDOW, STRETCH = 4800, 1.0
#: Windows that are shown, and parts of a signal of which the extremes are drawn.
N_SHOWN, BINS = 5, 900


def envelope(signal, n_bins):
    """Return the smallest and the largest sample of each part of a signal.

    Examples
    --------
    >>> envelope(np.array([0, 3, 1, -2]), 2)
    (array([ 0, -2]), array([3, 1]))
    """
    begins = np.linspace(0, len(signal), n_bins, endpoint=False).astype(int)
    return np.minimum.reduceat(signal, begins), np.maximum.reduceat(signal, begins)


def draw(path, recording, rate):
    """Draw the recording with its stretches, a part with its windows, and one window."""
    part = recording[: N_SHOWN * WINDOW]
    window = recording[:WINDOW]
    with saved_figure(path, 3, size=(7.5, 5.2)) as axes:
        whole, windows, single = axes[:, 0]
        _draw_signal(whole, recording, len(recording) / rate)
        n_stretches = int(len(recording) / rate / STRETCH)
        _mark(whole, STRETCH, n_stretches, BLUE, "stretch {}")
        whole.set_xlabel("time (s)")
        whole.set_title(
            f"A recording of {len(recording) / rate:.1f} s: {n_stretches} stretches of a second",
            fontsize=9,
            loc="left",
        )
        _draw_signal(windows, part, 1e3 * len(part) / rate)
        _mark(windows, 1e3 * WINDOW / rate, N_SHOWN, ORANGE, "window {}")
        windows.set_xlabel("time (ms)")
        windows.set_title(
            f"The first five windows of {WINDOW} samples of a stretch",
            fontsize=9,
            loc="left",
        )
        _draw_signal(single, window, 1e3 * len(window) / rate)
        single.set_xlabel("time (ms)")
        _draw_intervals(single, window, rate)
        for ax in axes[:, 0]:
            ax.set_yticks([])
            ax.spines["left"].set_visible(False)


def _draw_signal(ax, signal, duration):
    low, high = envelope(signal, BINS)
    time = np.linspace(0, duration, BINS, endpoint=False)
    ax.fill_between(time, low, high, color=GREY, linewidth=0.4)
    ax.set_xlim(0, duration)


def _mark(ax, length, number, color, label):
    top = ax.get_ylim()[1]
    for index in range(number):
        ax.axvspan(
            index * length,
            (index + 1) * length,
            color=color,
            alpha=0.12 + 0.1 * (index % 2),
            lw=0,
        )
        center = (index + 0.5) * length
        ax.text(center, top, label.format(index + 1), ha="center", va="top", fontsize=8)


def _draw_intervals(ax, window, rate):
    """Draw the time of a revolution, and that between two impacts."""
    revolution = 60e3 / RPM
    interval = revolution / bearing_orders(BEARING)["outer"]
    bottom, top = ax.get_ylim()
    start = 1e3 * np.argmax(np.abs(window[: int(interval * rate / 1e3)])) / rate
    ax.set_ylim(1.4 * bottom, top)
    for height, length, color, label in (
        (1.2 * bottom, revolution, BLUE, "one revolution"),
        (top, interval, GREEN, "one interval of the outer race (BPFO)"),
    ):
        ends = {"arrowstyle": "<->", "color": color}
        ax.annotate("", (start, height), (start + length, height), arrowprops=ends)
        ax.text(start + length + 1, height, label, va="center", fontsize=8, color=color)
    ax.set_title("One window holds a few impacts", fontsize=9, loc="left")


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded recordings")
    parser.add_argument("--figure", type=Path, default=Path("docs/images/cutting.svg"))
    options = parser.parse_args(arguments)
    rig = fetch_hit_sm(window_length=WINDOW, data_home=options.data_home)
    chosen = (rig.target == CONDITION) & (rig.rpm == RPM)
    draw(options.figure, rig.data[chosen].ravel(), rig.sampling_rate)


if __name__ == "__main__":
    main()
