"""Figure of a comb over the contrast of envelope spectra, of real recordings.

``python -m benchmarks.figures.comb_figure`` writes docs/images/comb.svg. The recordings
are those of SpectraQuest at 900 rpm: a fault of the outer race, and a healthy bearing.
"""

import argparse
from pathlib import Path

from benchmarks.figures.style import BLUE, GREY, ORANGE, saved_figure
from benchmarks.recordings import fetch_hit_sm
from skarxlag import bearing_orders, make_fault_order_classifier
from skarxlag.plotting import EnvelopeSpectrumDisplay

RPM, BEARING, HIGHEST_ORDER = 900, "6205", 14.0
SHOWN = {"OR5": "fault of the outer race", "Normal": "healthy bearing"}
#: Lines that are marked: their colour, and the field's names.
COMBS = {"outer": (ORANGE, "BPFO", (1, 2, 3)), "inner": (BLUE, "BPFI", (1,))}


def envelope_displays(rig):
    """Return the contrast of a second of each shown condition.

    Parameters
    ----------
    rig : Bunch
        As `fetch_hit_sm` returns it, with windows of a second.
    """
    from matplotlib.figure import Figure

    displays = {}
    for condition, title in SHOWN.items():
        rows = rig.data[(rig.target == condition) & (rig.rpm == RPM)]
        classifier = make_fault_order_classifier(
            bearing=BEARING, sampling_rate=rig.sampling_rate
        ).fit(rows)
        ax = Figure().subplots()
        displays[title] = EnvelopeSpectrumDisplay.from_estimator(
            classifier, rows[0], rpm=RPM, ax=ax
        )
    return displays


def draw(path, displays):
    """Draw the contrasts with the orders of the races."""
    orders = bearing_orders(BEARING)
    with saved_figure(
        path, len(displays), size=(7.5, 4.2), sharex=True, sharey=True
    ) as axes:
        for ax, (title, display) in zip(axes[:, 0], displays.items(), strict=True):
            ax.plot(display.orders, display.contrast, color=GREY, linewidth=0.8)
            for location, (color, name, multiples) in COMBS.items():
                first = orders[location] * display.factors[location]
                for multiple in multiples:
                    order = multiple * first
                    ax.axvline(order, color=color, linestyle=":", linewidth=1)
                    label = name if multiple == 1 else f"{multiple} {name}"
                    _write_above(ax, order, label, color)
            ax.set_title(f"{title}, {RPM} rpm", fontsize=9, loc="left", pad=16)
            ax.set_ylabel("contrast (dB)")
        outer = displays[SHOWN["OR5"]]
        comb = outer.combs["outer"]
        heights = [outer.contrast[abs(outer.orders - order).argmin()] for order in comb]
        axes[0, 0].plot(comb, heights, "o", color=ORANGE, markersize=4)
        axes[-1, 0].set_xlim(0, HIGHEST_ORDER)
        axes[-1, 0].set_ylim(0, None)
        axes[-1, 0].set_xlabel("order: multiple of the frequency of the shaft")


def _write_above(ax, order, label, color):
    ax.annotate(
        label,
        (order, 1),
        xycoords=("data", "axes fraction"),
        xytext=(0, 2),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize=8,
        color=color,
    )


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded recordings")
    parser.add_argument("--figure", type=Path, default=Path("docs/images/comb.svg"))
    options = parser.parse_args(arguments)
    rig = fetch_hit_sm(window_length=51_200, data_home=options.data_home)
    draw(options.figure, envelope_displays(rig))


if __name__ == "__main__":
    main()
