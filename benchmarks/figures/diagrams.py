"""Block diagrams of the paper (Figures 4, 5, 6 and 9) in their repaired form, drawn from tables.

A diagram is a pair of tables. The first gives each block its column, its row and its
words; a word in the margin (no frame) begins with a blank, and a decision ends with a
question mark. The second gives the arrows: from, to, label. Rows run downwards, so that
a diagram fits a telephone.
"""

from typing import NamedTuple

#: Inches between columns and between rows; points of the text.
COLUMN, ROW, TEXT = 2.35, 0.95, 12


class Diagram(NamedTuple):
    """Blocks by name, arrows between them, and the sizes of the grid that differ from the usual."""

    blocks: dict
    arrows: list
    column: float = COLUMN
    row: float = ROW


def _network(side, filters, gains):
    """Blocks of one side of Figure 6: its filters, and the gains next to them."""
    first = r"$\frac{\sqrt{1-\zeta_s^2}}{z-\zeta_s}$".replace("_s", f"_{side}")
    other = r"$\frac{1-\zeta_s z}{z-\zeta_s}$".replace("_s", f"_{side}")
    rows = (
        ("0", 1, first, "0"),
        ("1", 2, other, "1"),
        ("n", 4, other, f"{{N_{side}-1}}"),
    )
    return {
        **{f"{side}{n}": (filters, row, words) for n, row, words, _ in rows},
        **{
            f"g{side}{n}": (gains, row, f"$g^{side}_{last}$")
            for n, row, _, last in rows
        },
    }


DIAGRAMS = {
    4: Diagram(
        {
            "machine": (0.5, 0, "Bearing and drive"),
            "identify": (0.5, 1, "ARX-Laguerre models,\nhealthy and faulty"),
            "observe": (0.5, 2, "Extended-state PI observer"),
            "residual": (0.5, 3, "Sliding-mode residuals $r_c$"),
            "detect": (0, 4, "Detection\n$|r| > \\Gamma$"),
            "isolate": (1, 4, "Identification\n$|r|$ and the $\\Delta_c$"),
        },
        [
            ("machine", "identify", "$y, u$"),
            ("identify", "observe", r"$\varepsilon_c$"),
            ("observe", "residual", "$e_c$"),
            ("residual", "detect", ""),
            ("residual", "isolate", ""),
        ],
        column=1.9,
    ),
    5: Diagram(
        {
            "machine": (0, 0, "Bearing and drive"),
            "identify": (
                0, 1, "System modelling (4)-(16)\n$\\hat y_c(k) = g_c^T x(k)$\n"
                "$\\varepsilon_c = y - \\hat y_c$",
            ),
            "observe": (
                0, 2, "PI observer (17), (18)\n$e = \\varepsilon - c$,  $p^+ = p + k_{Ia} e$\n"
                "$c^+ = \\zeta c + k_p e + \\hat\\delta$",
            ),
            "extend": (
                1, 2, "Evaluator (19), (20)\n$S = p + k_{Ib} e$\n"
                "$\\hat\\delta^+ = K_c p^+ \\times$\n$(1 + \\min(|S|, M)^\\kappa)$",
            ),
            "residual": (
                0, 3, "Residual generator (21)\n$\\sigma = \\lambda e + \\dot e$,  "
                "$K_s \\to |\\sigma|$\n$r = K_s\\,\\mathrm{sgn}\\, \\sigma$",
            ),
            "threshold": (
                1, 3, "Thresholds (22), (25)-(31)\n$\\Gamma$ and $\\Delta_c$ from\n"
                "the training levels",
            ),
            "decide": (0, 4, "Residual bank and\nlogic decision\n(23), (24), (32)"),
            "verdict": (0, 5, " condition"),
        },
        [
            ("machine", "identify", "$y, u$"),
            ("identify", "observe", r"$\varepsilon_c$"),
            ("observe", "extend", "$e, p$"),
            ("extend", "observe", r"$\hat\delta$"),
            ("observe", "residual", "$e$"),
            ("residual", "threshold", "$K_s$"),
            ("residual", "decide", "$K_s$"),
            ("threshold", "decide", r"$\Gamma, \Delta_c$"),
            ("decide", "verdict", ""),
        ],
        column=2.5,
        row=1.3,
    ),
    6: Diagram(
        {
            "y": (0, 0, " $y(k)$"),
            "u": (4, 0, " $u(k)$"),
            **_network("a", 0, 1),
            **_network("b", 4, 3),
            **{f"+{n}": (2, row, "$+$") for n, row in (("0", 1), ("1", 2), ("n", 4))},
            **{f".{column}": (column, 3, " ...") for column in (0, 2, 4)},
            "out": (2, 5, r" $\hat y(k)$"),
        },
        [
            ("y", "a0", ""), ("a0", "a1", "$x^y_0$"), ("a1", ".0", "$x^y_1$"), (".0", "an", ""),
            ("u", "b0", ""), ("b0", "b1", "$x^u_0$"), ("b1", ".4", "$x^u_1$"), (".4", "bn", ""),
            *[(f"{side}{n}", f"g{side}{n}", "") for side in "ab" for n in "01n"],
            *[(f"g{side}{n}", f"+{n}", "") for side in "ab" for n in "01n"],
            ("+0", "+1", ""), ("+1", ".2", ""), (".2", "+n", ""), ("+n", "out", ""),
        ],
        column=1.05,
        row=1.05,
    ),
    9: Diagram(
        {
            "window": (0, 0, " window $y, u$"),
            "identify": (0, 1, "ARX-Laguerre models\n(4), (11), (16)"),
            "observe": (0, 2, "Extended-state observer\n(19), (20)"),
            "levels": (0, 3, "Residual levels\n$|r_c| = K_{s,c}$ (21)"),
            "detect": (0, 4, "$|r| > \\Gamma$\n(23), (24)?"),
            "normal": (1, 4, " Normal"),
            "kind": (0, 5, "a bank of\nresiduals?"),
            "bank": (1, 5, "Smallest residual\n$\\arg\\min_c |r_c|$"),
            "ladder": (0, 6, "Ladder (32): the rung with\n$\\Delta_{c-1} < |r| \\leq \\Delta_c$"),
            "condition": (1, 6, " condition"),
        },
        [
            ("window", "identify", ""),
            ("identify", "observe", r"$\varepsilon_c$"),
            ("observe", "levels", "$e_c$"),
            ("levels", "detect", ""),
            ("detect", "normal", "no"),
            ("detect", "kind", "yes"),
            ("kind", "bank", "yes"),
            ("kind", "ladder", "no"),
            ("ladder", "condition", ""),
            ("bank", "condition", ""),
        ],
        column=2.5,
    ),
}  # fmt: skip


def draw(diagram):
    """Draw a diagram.

    Parameters
    ----------
    diagram : Diagram
        Its tables.

    Returns
    -------
    matplotlib Figure
        In the colours of the style in use.

    Raises
    ------
    KeyError
        If an arrow names a block that the first table does not have.
    """
    from matplotlib import rcParams
    from matplotlib.figure import Figure

    columns, rows, _ = zip(*diagram.blocks.values(), strict=True)
    width, height = (max(columns) + 1) * diagram.column, (max(rows) + 1) * diagram.row
    figure = Figure(figsize=(width, height))
    ax = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(height, 0))
    ax.set_axis_off()
    drawn, ends = {}, {arrow[:2] for arrow in diagram.arrows}
    for name, (column, row, words) in diagram.blocks.items():
        frame = {
            "facecolor": "none",
            "edgecolor": "none" if words.startswith(" ") else rcParams["text.color"],
            "boxstyle": "round,pad=.4,rounding_size=.8"
            if words.endswith("?")
            else "square,pad=.4",
        }
        size = TEXT + 5 * ("frac" in words)
        centre = (column + 0.5) * diagram.column, (row + 0.5) * diagram.row
        centred = {"ha": "center", "va": "center", "fontsize": size, "bbox": frame}
        drawn[name] = ax.text(*centre, words.strip(), **centred)
    for start, end, label in diagram.arrows:
        _draw_arrow(ax, drawn[start], drawn[end], label, (end, start) in ends)
    return figure


def _draw_arrow(ax, start, end, label, is_answered):
    """One arrow between the frames of two blocks; it lies on its side of one that answers it."""
    from matplotlib import rcParams

    (x0, y0), (x1, y1) = start.get_position(), end.get_position()
    shift = 0.16 * ((x0 < x1) - (x0 > x1)) * is_answered
    line = {
        "arrowstyle": "-|>",
        "color": rcParams["text.color"],
        "shrinkA": 0,
        "shrinkB": 2,
    }
    frames = {"patchA": start.get_bbox_patch(), "patchB": end.get_bbox_patch()}
    ax.annotate("", (x1, y1 - shift), (x0, y0 - shift), arrowprops=line | frames)
    across, middle = x0 != x1, ((x0 + x1) / 2, (y0 + y1) / 2 - shift)
    if across and y0 == y1:
        above = shift >= 0
        nudge = {"xytext": (0, 3 if above else -3), "va": "bottom" if above else "top"}
        nudge["ha"] = "center"
    else:
        nudge = {"xytext": (16 if across else 5, 0), "va": "center", "ha": "left"}
    ax.annotate(label, middle, textcoords="offset points", fontsize=TEXT, **nudge)
