"""Diagnosers whose constants were chosen without the rig that they are scored on."""

import pandas as pd

from benchmarks.pages.modules import ROOT
from skarxlag import make_diagnoser
from skarxlag.diagnosers import MODEL_ORDER

#: Written by ``python -m benchmarks.recipe constants``.
CHOICES = ROOT / "docs" / "tables" / "constants.csv"


def choices():
    """Constants that the other rigs choose, a row for each rig that is left out."""
    table = pd.read_csv(CHOICES).dropna(subset=["left out", "model order"])
    return table.set_index("left out")


def diagnoser_without(rig):
    """Make the diagnoser of windows with the constants that were chosen without a rig.

    Parameters
    ----------
    rig : str
        Name of a rig in `choices`.
    """
    constants = choices().loc[rig]
    return make_diagnoser().set_params(
        identify__order=(int(constants["model order"]), MODEL_ORDER[1]),
        decide__residual__measure__spectrum_order=int(constants["spectrum order"]),
        decide__residual__compare__smooth_drift=float(constants["smooth drift"]),
    )
