"""Figure of the steps of a diagnosis, with the shape of the array on each arrow.

``python -m benchmarks.figures.pipeline_figure`` writes docs/images/pipeline.svg. The
shapes are those that the steps return for windows of the simulated rig.
"""

import argparse
from pathlib import Path

from benchmarks.figures.diagrams import Diagram, draw
from benchmarks.figures.style import STYLE
from skarxlag import LogSpectra, SpectralDistance, make_diagnoser
from skarxlag.datasets import simulate_rig

WINDOW_LENGTH = 1200


def shapes():
    """Compute the shapes of the arrays between the steps.

    Returns
    -------
    dict of str to tuple of int
        By the name of what the array holds; the number of windows comes first.
    """
    conditions = ["Normal", "IR", "OR", "Ball"]
    rig = simulate_rig(rpm=500, crack_mm=6, conditions=conditions, n_samples=36_000)
    diagnoser = make_diagnoser(healthy="Normal").fit(rig.data, rig.target)
    innovations = diagnoser["identify"].transform(rig.data)
    spectra = LogSpectra().fit_transform(innovations)
    distances = SpectralDistance().fit(spectra, rig.target).transform(spectra)
    probabilities = diagnoser.predict_proba(rig.data)
    return {
        "recording": (rig.data.shape[1], 36_000),
        "windows": rig.data.shape,
        "innovations": innovations.shape,
        "spectra": spectra.shape,
        "distances": distances.shape,
        "probabilities": probabilities.shape,
    }


def pipeline_diagram():
    """Return the diagram of the steps."""
    arrays = {
        name: f"{name} {shape}".replace("(120,", "(n,")
        for name, shape in shapes().items()
    }
    blocks = {
        "recording": (0, 0, "a recording (a file, or a running sensor)"),
        "cut": (0, 1, "cut\nmake_windows"),
        "identify": (0, 2, "identify: what can be predicted?\nARXLaguerre"),
        "measure": (0, 3, "measure: shape, impulsiveness\nLogSpectra"),
        "compare": (
            0,
            4,
            "compare with each condition at this speed\nSpectralDistance",
        ),
        "decide": (0, 5, "decide\nConditionClassifier"),
        "collect": (0, 6, "collect the windows of a recording\nrecording_verdicts"),
        "verdict": (0, 7, " one verdict, its probability, and an alarm"),
    }
    arrows = [
        ("recording", "cut", arrays["recording"]),
        ("cut", "identify", arrays["windows"]),
        ("identify", "measure", arrays["innovations"]),
        ("measure", "compare", arrays["spectra"]),
        ("compare", "decide", arrays["distances"]),
        ("decide", "collect", arrays["probabilities"]),
        ("collect", "verdict", ""),
    ]
    return Diagram(blocks, arrows, column=5.2, row=0.92)


def main(arguments=None):
    """Run the command."""
    import matplotlib

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", type=Path, default=Path("docs/images/pipeline.svg"))
    options = parser.parse_args(arguments)
    with matplotlib.rc_context(STYLE):
        draw(pipeline_diagram()).savefig(options.figure, metadata={"Date": None})


if __name__ == "__main__":
    main()
