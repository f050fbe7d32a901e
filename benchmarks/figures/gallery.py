"""Outputs of the examples on real recordings, which the site keeps.

``python -m benchmarks.figures.gallery`` runs all examples whose names begin with
``real_``. It writes what they print and draw to docs/images/gallery. A build of the
site shows these files, as it has no recordings.
"""

import argparse
import contextlib
import io
import os
import runpy
import warnings

import matplotlib

from benchmarks.blocks import ROOT

EXAMPLES = sorted((ROOT / "examples").rglob("real_*.py"))
KEPT = ROOT / "docs" / "images" / "gallery"
DPI = 80


def run(example, folder):
    """Run an example, and write its text and its figure.

    Parameters
    ----------
    example : Path
        The program.
    folder : Path
        Folder of the two files, which have the name of the program.

    Raises
    ------
    ValueError
        If the example does not draw exactly one figure.
    """
    from matplotlib import pyplot

    pyplot.close("all")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), warnings.catch_warnings():
        # The figures are saved here, and not shown.
        warnings.filterwarnings("ignore", "FigureCanvasAgg is non-interactive")
        runpy.run_path(str(example), run_name="__main__")
    numbers = pyplot.get_fignums()
    if len(numbers) != 1:
        raise ValueError(f"{example.name} draws {len(numbers)} figures, expected one.")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{example.stem}.png"
    pyplot.figure(numbers[0]).savefig(path, dpi=DPI, metadata={"Software": None})
    path.with_suffix(".txt").write_text(printed.getvalue(), encoding="utf-8")
    pyplot.close("all")


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded recordings")
    parser.add_argument("name", nargs="*", help="names of examples; all by default")
    options = parser.parse_args(arguments)
    if options.data_home:
        os.environ["SCIKIT_LEARN_DATA"] = options.data_home
    matplotlib.use("Agg")
    for example in EXAMPLES:
        if not options.name or example.stem in options.name:
            run(example, KEPT)


if __name__ == "__main__":
    main()
