"""The tables of Piltan and Kim (2019) as printed, and comparisons under the same protocol."""

from .comparison import (
    METHODS,
    accuracy_beside_paper,
    averages,
    confusion_beside_paper,
    improvements,
    paper_averages,
    paper_improvements,
)
from .protocol import run_protocol
from .tables import load_tables

__all__ = [
    "METHODS",
    "accuracy_beside_paper",
    "averages",
    "confusion_beside_paper",
    "improvements",
    "load_tables",
    "paper_averages",
    "paper_improvements",
    "run_protocol",
]
