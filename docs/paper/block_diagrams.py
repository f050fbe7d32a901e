"""The block diagrams of the paper (Figures 4, 5, 6 and 9) in their repaired form, drawn from text.

A line of a description is one of

    box NAME X Y WIDTH HEIGHT text        a block; diamond NAME ... a decision
    sum NAME X Y                          a summing junction; dot NAME X Y a branching point
    text NAME X Y text                    words alone
    FROM.SIDE -> TO.SIDE : label          an arrow; side is n, e, s or w
    FROM.SIDE -- TO.SIDE : label          a line without a head

with ``-|>`` for an arrow that goes across first and then up or down, ``|->`` for the reverse, and
``SIDE@SHIFT`` for a place beside the middle of a side. In texts a / breaks the line, also where it
begins the next line of the description, ``$...$`` is mathematics, a label that begins with _ stands
below its line, and numbers in parentheses are the paper's equations.
"""

import re

FIGURE_4 = r"""
box  machine  0.0 0 3.0 1.3 Bearing and / drive
box  identify 4.6 0 3.8 1.3 ARX-Laguerre models, / healthy and faulty
box  observe  9.2 0 3.0 1.3 Extended-state / PI observer
box  residual 13.6 0 3.4 1.3 Sliding-mode / residuals $r_c$
box  detect   18.6 0.9 3.8 1.3 Detection / $|r| > \Gamma$
box  isolate  18.6 -0.9 3.8 1.3 Identification / $|r|$ and the $\Delta_c$
machine.e  -> identify.w : $y, u$
identify.e -> observe.w : $\varepsilon_c$
observe.e  -> residual.w : $e_c$
dot branch 16.0 0
residual.e -- branch.w :
branch.n |-> detect.w :
branch.s |-> isolate.w :
"""

FIGURE_5 = r"""
box machine   0.0 3 3.0 1.3 Bearing and / drive
box identify  5.0 3 4.4 2.1 System modelling (4)-(16)
    / $\hat y_c(k) = g_c^T x(k)$
    / $\varepsilon_c = y - \hat y_c$
box observe  10.9 3 5.0 2.1 PI observer (17), (18)
    / $e = \varepsilon - c$,  $p^+ = p + k_{Ia}\, e$
    / $c^+ = \zeta c + k_p e + \hat\delta$
box extend   10.9 -0.4 5.0 2.1 Observer evaluator (19), (20)
    / $S = p + k_{Ib}\, e$
    / $\hat\delta^+ = K_c (1 + \min(|S|, M)^\kappa)\, p^+$
box residual 17.2 3 5.0 2.1 Residual generator (21)
    / $\sigma = \lambda e + \dot e$,  $K_s \to |\sigma|$
    / $r = K_s\,\mathrm{sgn}\, \sigma$
box threshold 17.2 -0.4 5.0 2.1 Threshold process
    / (22), (25)-(31): $\Gamma$ and $\Delta_c$
    / calibrated on training levels
box decide   17.2 -3.8 5.0 2.1 Residual bank and / logic decision / (23), (24), (32)
text verdict 12.0 -3.8 condition
dot level    20.4 3
machine.e  -> identify.w : $y, u$
identify.e -> observe.w : $\varepsilon_c$
observe.e  -> residual.w : $e$
observe.s@-1.2 -> extend.n@-1.2 : $e, p$
extend.n@1.2 -> observe.s@1.2 : $\hat\delta$
residual.s -> threshold.n : $K_s$ in training
residual.e -- level.w : $K_s$
level.s |-> decide.e :
threshold.s -> decide.n : $\Gamma, \Delta_c$
decide.w -> verdict.e :
"""

FIGURE_6 = r"""
text y  0.0 4 $y(k)$
box  a0 2.6 4 2.3 1.3 $\frac{\sqrt{1-\zeta_a^2}}{z-\zeta_a}$
box  a1 6.4 4 2.3 1.3 $\frac{1-\zeta_a z}{z-\zeta_a}$
text a2 9.4 4 ...
box  a3 12.2 4 2.3 1.3 $\frac{1-\zeta_a z}{z-\zeta_a}$
dot  p0 4.5 4
dot  p1 8.3 4
dot  p3 14.4 4
box  g0 4.5 2.4 1.3 0.8 $g^a_0$
box  g1 8.3 2.4 1.3 0.8 $g^a_1$
box  g3 14.4 2.4 1.3 0.8 $g^a_{N_a-1}$
text u  0.0 -2 $u(k)$
box  b0 2.6 -2 2.3 1.3 $\frac{\sqrt{1-\zeta_b^2}}{z-\zeta_b}$
box  b1 6.4 -2 2.3 1.3 $\frac{1-\zeta_b z}{z-\zeta_b}$
text b2 9.4 -2 ...
box  b3 12.2 -2 2.3 1.3 $\frac{1-\zeta_b z}{z-\zeta_b}$
dot  q0 4.5 -2
dot  q1 8.3 -2
dot  q3 14.4 -2
box  h0 4.5 -0.4 1.3 0.8 $g^b_0$
box  h1 8.3 -0.4 1.3 0.8 $g^b_1$
box  h3 14.4 -0.4 1.3 0.8 $g^b_{N_b-1}$
sum  s0 4.5 1
sum  s1 8.3 1
sum  s3 14.4 1
text dots 11.3 1 ...
text out 17.2 1 $\hat y(k)$
y.e -> a0.w :
a0.e -> a1.w : $x^y_0$
a1.e -> a2.w : $x^y_1$
a2.e -> a3.w :
a3.e -- p3.w : $x^y_{N_a-1}$
p0.s -> g0.n :
p1.s -> g1.n :
p3.s -> g3.n :
u.e -> b0.w :
b0.e -> b1.w : _$x^u_0$
b1.e -> b2.w : _$x^u_1$
b2.e -> b3.w :
b3.e -- q3.w : _$x^u_{N_b-1}$
q0.n -> h0.s :
q1.n -> h1.s :
q3.n -> h3.s :
g0.s -> s0.n :
g1.s -> s1.n :
g3.s -> s3.n :
h0.n -> s0.s :
h1.n -> s1.s :
h3.n -> s3.s :
s0.e -> s1.w :
s1.e -> dots.w :
dots.e -> s3.w :
s3.e -> out.w :
"""

FIGURE_9 = r"""
text window   0.0 2 window / $y, u$
box identify  3.8 2 3.8 1.5 ARX-Laguerre models / (4), (11), (16)
box observe   8.8 2 3.8 1.5 Extended-state / observer (19), (20)
box levels   13.8 2 3.8 1.5 Residual levels / $|r_c| = K_{s,c}$ (21)
diamond detect 13.8 -1.2 4.4 2.6 $|r| > \Gamma$ ? / (23), (24)
text normal   8.8 -1.2 Normal
diamond kind 13.8 -5.2 4.4 2.6 a bank of / residuals ?
box ladder    7.8 -5.2 5.0 1.7 Ladder (32): the rung with / $\Delta_{c-1} < |r| \leq \Delta_c$
box bank      7.8 -7.6 5.0 1.7 Smallest residual / $\arg\min_c |r_c|$
text single   2.6 -5.2 condition
text several  2.6 -7.6 condition
window.e -> identify.w :
identify.e -> observe.w : $\varepsilon_c$
observe.e -> levels.w : $e_c$
levels.s -> detect.n :
detect.w -> normal.e : no
detect.s -> kind.n : yes
kind.w -> ladder.e : no
kind.s |-> bank.e : yes
ladder.w -> single.e :
bank.w -> several.e :
"""

FIGURES = {4: FIGURE_4, 5: FIGURE_5, 6: FIGURE_6, 9: FIGURE_9}

_NODE = re.compile(r"(box|diamond|sum|dot|text) +(\w+) +([-.\d]+) +([-.\d]+) *(.*)")
_EDGE = re.compile(
    r"(\w+)\.([nesw])(?:@([-.\d]+))? +(->|--|-\|>|\|->) +(\w+)\.([nesw])(?:@([-.\d]+))? *: *(.*)"
)
_SIDES = {"n": (0, 1), "e": (1, 0), "s": (0, -1), "w": (-1, 0)}
_UNIT = 0.45  # inches


def parse(description):
    """Nodes and edges of a description.

    Parameters
    ----------
    description : str
        Lines as the module describes them.

    Returns
    -------
    nodes : dict of str to dict
        ``kind``, ``x``, ``y``, ``width``, ``height`` and ``text`` by name.
    edges : list of dict
        ``start`` and ``end``, points; ``route``; ``label``.

    Raises
    ------
    ValueError
        If a line is neither, or an edge names a node that is not above it.
    """
    nodes, edges = {}, []
    joined = re.sub(r"\n */ ", " / ", description)
    for line in filter(None, map(str.strip, joined.splitlines())):
        if node := _NODE.fullmatch(line):
            kind, name, x, y, rest = node.groups()
            nodes[name] = _node(kind, float(x), float(y), rest)
        elif edge := _EDGE.fullmatch(line):
            a, side_a, shift_a, route, b, side_b, shift_b, label = edge.groups()
            missing = [name for name in (a, b) if name not in nodes]
            if missing:
                raise ValueError(f"{line!r} names {missing}, expected a node above it.")
            edges.append(
                {
                    "start": _port(nodes[a], side_a, shift_a),
                    "end": _port(nodes[b], side_b, shift_b),
                    "route": route,
                    "label": label,
                }
            )
        else:
            raise ValueError(f"{line!r} is neither a node nor an edge.")
    return nodes, edges


def _node(kind, x, y, rest):
    if kind in ("box", "diamond"):
        width, height, rest = rest.split(maxsplit=2)
    text = rest.replace(" / ", "\n")
    if kind == "text":
        # Room for the words, as far as letters tell: arrows end beside them.
        words = [re.sub(r"\\hat|[$\\^_{} ]", "", line) for line in text.splitlines()]
        width, height = 0.4 + 0.22 * max(map(len, words)), 0.6 * len(words)
    elif kind in ("sum", "dot"):
        width = height = 0.6 if kind == "sum" else 0.0
    size = {"width": float(width), "height": float(height)}
    return {"kind": kind, "x": x, "y": y, "text": text} | size


def _port(node, side, shift):
    across, up = _SIDES[side]
    along = float(shift or 0)
    return (
        node["x"] + across * node["width"] / 2 + (along if up else 0),
        node["y"] + up * node["height"] / 2 + (along if across else 0),
    )


def draw(description):
    """Draw a description.

    Parameters
    ----------
    description : str
        Lines as the module describes them.

    Returns
    -------
    matplotlib Figure
        In the colours of the style in use.
    """
    from matplotlib.figure import Figure

    nodes, edges = parse(description)
    left, right = (
        [node["x"] + sign * node["width"] / 2 for node in nodes.values()] for sign in (-1, 1)
    )
    low, high = (
        [node["y"] + sign * node["height"] / 2 for node in nodes.values()] for sign in (-1, 1)
    )
    limits = min(left) - 0.3, max(right) + 0.3, min(low) - 0.3, max(high) + 0.3
    figure = Figure(figsize=(_UNIT * (limits[1] - limits[0]), _UNIT * (limits[3] - limits[2])))
    ax = figure.add_axes((0, 0, 1, 1))
    ax.set(xlim=limits[:2], ylim=limits[2:])
    ax.set_axis_off()
    for node in nodes.values():
        _draw_node(ax, node)
    for edge in edges:
        _draw_edge(ax, edge)
    return figure


def _draw_node(ax, node):
    from matplotlib import patches, rcParams

    x, y, width, height = (node[key] for key in ("x", "y", "width", "height"))
    line = {"facecolor": "none", "edgecolor": rcParams["text.color"], "linewidth": 1.1}
    if node["kind"] == "box":
        corner = (x - width / 2, y - height / 2)
        ax.add_patch(patches.Rectangle(corner, width, height, **line))
    elif node["kind"] == "diamond":
        ends = [(x - width / 2, y), (x, y + height / 2), (x + width / 2, y), (x, y - height / 2)]
        ax.add_patch(patches.Polygon(ends, closed=True, **line))
    elif node["kind"] == "sum":
        ax.add_patch(patches.Circle((x, y), width / 2, **line))
    elif node["kind"] == "dot":
        ax.add_patch(patches.Circle((x, y), 0.08, **line | {"facecolor": line["edgecolor"]}))
    text = "$+$" if node["kind"] == "sum" else node["text"]
    is_fraction = "frac" in text
    ax.text(x, y, text, ha="center", va="center", fontsize=15 if is_fraction else 9.5)


def _draw_edge(ax, edge):
    from matplotlib import rcParams

    (x0, y0), (x1, y1) = edge["start"], edge["end"]
    corner = {"-|>": [(x1, y0)], "|->": [(x0, y1)]}.get(edge["route"], [])
    points = [(x0, y0), *corner, (x1, y1)]
    xs, ys = zip(*points, strict=True)
    color = rcParams["text.color"]
    ax.plot(xs, ys, color=color, linewidth=1.1, solid_capstyle="butt")
    if edge["route"] != "--":
        head = {"arrowstyle": "-|>", "color": color, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", points[-1], points[-2], arrowprops=head)
    (xa, ya), (xb, yb) = points[:2]
    if ya == yb:
        below = edge["label"].startswith("_")
        place = {"y": ya - 0.12, "va": "top"} if below else {"y": ya + 0.12, "va": "bottom"}
        ax.text((xa + xb) / 2, s=edge["label"].lstrip("_"), ha="center", fontsize=9, **place)
    else:
        ax.text(xa + 0.15, (ya + yb) / 2, edge["label"], ha="left", va="center", fontsize=9)
