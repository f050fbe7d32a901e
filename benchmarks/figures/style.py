"""SVG figures for light and dark pages."""

from contextlib import contextmanager

#: Okabe and Ito's colours, which colour-blind readers can distinguish.
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#E69F00", "#009E73", "#CC79A7"
#: Legible on white and on black.
GREY = "#7F7F7F"
STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "skarxlag",
    "font.size": 9,
    "savefig.transparent": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.alpha": 0.35,
    **{
        name: GREY
        for name in (
            "text.color",
            "axes.edgecolor",
            "axes.labelcolor",
            "axes.titlecolor",
            "xtick.color",
            "ytick.color",
            "grid.color",
        )
    },
}


@contextmanager
def saved_figure(path, n_rows=1, n_columns=1, size=(7.0, 2.8), **axes):
    """Yield the axes of a figure that is saved as SVG at the end.

    Parameters
    ----------
    path : Path
        File to write.
    n_rows, n_columns : int
        Grid of axes.
    size : tuple of float
        Width and height in inches.
    **axes : dict
        Passed to ``Figure.subplots``.
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        yield figure.subplots(n_rows, n_columns, squeeze=False, **axes)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, format="svg", metadata={"Date": None})


def legend_below(axes, n_columns=3):
    """Legend of the first axes under all of them."""
    handles, labels = axes[0, 0].get_legend_handles_labels()
    where = {
        "loc": "outside lower center",
        "ncols": n_columns,
        "frameon": False,
        "fontsize": 8,
    }
    axes[0, 0].figure.legend(handles, labels, **where)
