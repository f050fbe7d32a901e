"""Picture of an ensemble of diagnosers as a notebook shows it.

``python -m benchmarks.pages.diagram_image`` writes docs/images/diagram.png. It needs
Chromium or Chrome.
"""

import argparse
from pathlib import Path

import numpy as np
from sklearn.ensemble import StackingClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer, StandardScaler
from sklearn.utils import estimator_html_repr

from benchmarks.pages.browser import picture
from skarxlag import DiagnosisPipeline, make_alpio, make_diagnoser

#: Of the screen, in pixels.
WIDTH = 560
HEAD = '<!doctype html><meta charset="utf-8">'


def as_windows(rows):
    """Return windows of two channels, of which each row holds one after the other."""
    return np.reshape(rows, (len(rows), 2, -1))


def ensemble():
    """Return the ensemble of docs/scripts.md, not fitted."""
    windows = ("windows", FunctionTransformer(as_windows))
    members = {"diagnoser": make_diagnoser(), "alpio": make_alpio()}
    return StackingClassifier(
        [
            (name, DiagnosisPipeline([windows, *each.steps]))
            for name, each in members.items()
        ],
        make_pipeline(StandardScaler(), LogisticRegression()),
        passthrough=True,
    )


def main(argv=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", type=Path, default=Path("docs/images/diagram.png"))
    args = parser.parse_args(argv)
    picture(HEAD + estimator_html_repr(ensemble()), args.figure, WIDTH, ["light"])


if __name__ == "__main__":
    main()
