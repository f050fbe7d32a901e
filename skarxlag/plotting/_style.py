"""Colours, line styles and markers of the conditions, which are the same in every figure."""

from collections.abc import Sequence
from typing import Any

#: Grey with similar contrast to white and to a dark page, for elements that are not a condition.
NEUTRAL = "#7a7a7a"

#: Colours of the conditions. Each has a contrast of at least 3 with white and with a dark page.
#: They differ from each other and from `NEUTRAL` in normal, deuteranopic and protanopic vision.
#: A random search that maximised the smallest distance between two colours found them. The tests
#: check these properties.
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
#: Line styles that can be distinguished without colour.
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
#: Properties of a condition that a line without markers has.
LINE = ("color", "linestyle")
MARKERS = ("o", "s", "^", "d", "v", "P", "X", "<")


def condition_styles(conditions: Sequence[Any]) -> dict[str, Any]:
    """Assign a colour, a line style and a marker to each condition, by its position.

    Parameters
    ----------
    conditions : sequence of label
        Conditions in the order of the rig's ``target_names``, the healthy one first. From the
        ninth condition on, the colours repeat with another line style and marker.

    Returns
    -------
    dict of str to dict of str to object
        The properties ``color``, ``linestyle`` and ``marker`` of each condition, with the names
        and values that matplotlib uses.

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


def ink() -> str:
    """Return the text colour of the current style, for lines that belong to no condition."""
    from matplotlib import rcParams

    return rcParams["text.color"]
