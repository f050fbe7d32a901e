"""Plots of fault estimates, for light and dark pages."""

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
from benchmarks.paper.fault_estimation.signals import (
    bearing_fault,
    identified,
    recordings,
    synthetic_fault,
)
from benchmarks.paper.fault_estimation.studies import OTHER, compared

COLOURS = (BLUE, ORANGE, GREEN, PURPLE)
#: Samples before and after the event that are drawn.
BEFORE = 20
AFTER = 80


def trajectories(path, seed, n_samples):
    """True signal and estimates around a step and around the largest impact of a 6 mm crack."""
    healthy = identified(seed + OTHER, n_samples)
    rig = recordings(seed, n_samples)
    step = synthetic_fault(healthy, rig, "step")
    impact = bearing_fault(healthy, rig, "OR", 6.0)
    peak = np.unravel_index(np.abs(impact.true).argmax(), impact.true.shape)
    onset = int(np.flatnonzero(step.true[0] > 0.5)[0])
    events = {
        "Step of 1 (synthetic)": (step, 0, onset),
        "Impact, OR 6 mm, 500 rpm": (impact, *peak),
    }
    with saved_figure(path, 1, 2, size=(8.0, 3.2)) as axes:
        for ax, (title, (fault, window, event)) in zip(
            axes[0], events.items(), strict=True
        ):
            shown = slice(max(event - BEFORE, 0), event + AFTER)
            time = np.arange(fault.true.shape[1])[shown] - event
            ax.plot(
                time, fault.true[window, shown], color=GREY, linewidth=2.5, label="true"
            )
            for colour, (name, observer) in zip(
                COLOURS, compared().items(), strict=True
            ):
                seen = fault.innovations[window : window + 1]
                estimate = observer.fit(seen).observe(seen).fault_estimate[0, :-1]
                ax.plot(time, estimate[shown], color=colour, linewidth=1.0, label=name)
            ax.set(title=title, xlabel="Samples after the event")
            ax.grid()
        axes[0, 0].set_ylabel("Fault, in RMS of the healthy output")
        legend_below(axes)


def trade_off(frame, path):
    """Error against integral gain for each fault; dashed: with the delay taken out.

    Parameters
    ----------
    frame : DataFrame
        Of ``fault_estimation_studies.gains``.
    path : Path
        SVG to write.
    """
    linear = frame[frame.observer == "linear"].groupby("ki").mean(numeric_only=True)
    lines = {
        "step: error": (BLUE, "-"),
        "ramp: error": (GREEN, "-"),
        "OR, 6 mm: error": (ORANGE, "-"),
        "OR, 6 mm: aligned error": (ORANGE, "--"),
        "noise": (GREY, ":"),
    }
    with saved_figure(path, size=(6.0, 3.4)) as axes:
        ax = axes[0, 0]
        for name, (colour, dash) in lines.items():
            ax.loglog(
                linear.index, linear[name], dash, color=colour, marker="o", markersize=3
            )
            ax.lines[-1].set_label(name)
        ax.axhline(1.0, color=GREY, linewidth=0.8)
        ax.set_xticks(linear.index, [f"{ki:g}" for ki in linear.index])
        ax.minorticks_off()
        ax.set(
            xlabel="Integral gain of the linear observer (last: dead-beat)",
            ylabel="Error",
        )
        ax.grid()
        legend_below(axes)
