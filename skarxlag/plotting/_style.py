"""Colours, line styles and markers of conditions, the same in every figure."""

from collections.abc import Sequence
from typing import Any

#: Grey that stands out alike from white and from a dark page, for what is no condition.
NEUTRAL = "#7a7a7a"

#: Contrast of at least 3 with white and with a dark page, apart from each other and from `NEUTRAL`
#: for normal, deuteranopic and protanopic eyes; found by random search for the largest of the
#: smallest distances. The tests compute all of this.
PALETTE = (
    "#2aa564",
    "#6982ff",
    "#cb7207",
    "#960efc",
    "#c82b31",
    "#f839bd",
    "#336d8e",
    "#b304c0",
)
#: matplotlib settings for images without a background, readable on a white and on a dark page.
ANY_PAGE = {
    **dict.fromkeys(
        ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), NEUTRAL
    ),
    **dict.fromkeys(("figure.facecolor", "axes.facecolor", "savefig.facecolor"), "none"),
}
#: Told apart without colour.
LINE_STYLES = (
    "-",
    "--",
    "-.",
    ":",
    (0, (6, 1, 1, 1, 1, 1)),
    (0, (3, 1)),
    (0, (8, 3)),
    (0, (1, 1)),
)
MARKERS = ("o", "s", "^", "d", "v", "P", "X", "<")


def condition_styles(conditions: Sequence[Any]) -> dict[str, Any]:
    """Colour, line style and marker of each condition, by its place.

    Parameters
    ----------
    conditions : sequence of label
        Conditions in the order of the rig's ``target_names``, the healthy one first. From the
        ninth on colours come again, with another line style and marker.

    Returns
    -------
    dict of str to dict of str to object
        For each condition ``color``, ``linestyle`` and ``marker``, as matplotlib names them.

    Examples
    --------
    >>> styles = condition_styles(["Normal", "Ball"])
    >>> styles["Normal"]["marker"], styles["Ball"]["marker"]
    ('o', 's')
    """
    styles = {}
    for place, name in enumerate(conditions):
        turn, number = divmod(place, len(PALETTE))
        shifted = (number + turn) % len(LINE_STYLES)
        styles[str(name)] = {
            "color": PALETTE[number],
            "linestyle": LINE_STYLES[shifted],
            "marker": MARKERS[shifted],
        }
    return styles


def ink() -> Any:
    """Colour of text in the style in use, for lines that belong to no condition."""
    from matplotlib import rcParams

    return rcParams["text.color"]
