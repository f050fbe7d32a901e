"""Confusion matrix of README's first block, which is run as it is printed.

``python -m benchmarks.figures.first_page`` writes ``docs/images/first_page.svg``.
"""

import re

from sklearn.metrics import ConfusionMatrixDisplay

from benchmarks.blocks import ROOT
from benchmarks.figures.style import GREY, saved_figure


def main():
    """Run the block, print what it prints, and draw its matrix."""
    text = (ROOT / "README.md").read_text("utf-8")
    names = {}
    exec(re.search(r"```python\n(.*?)```", text, flags=re.S)[1], names)
    is_slow = names["rpm"] == 300
    path = ROOT / "docs" / "images" / "first_page.svg"
    with saved_figure(path, size=(5.2, 4.6)) as axes:
        ax = axes[0, 0]
        ConfusionMatrixDisplay.from_predictions(
            names["y"][is_slow],
            names["predicted"],
            xticks_rotation="vertical",
            cmap="Blues",
            colorbar=False,
            ax=ax,
        )
        ax.set_title("fitted at 500 rpm, asked at 300 rpm", color=GREY)


if __name__ == "__main__":
    main()
