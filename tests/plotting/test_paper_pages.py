"""Block diagrams and the page of figures."""

import re
from pathlib import Path

import block_diagrams
import draw_figures
import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from skarxlag.commands.paper_figures import RESIDUAL_FIGURES
from skarxlag.datasets.simulated import CONDITIONS
from skarxlag.paper import load_tables
from skarxlag.plotting._style import ANY_PAGE, NEUTRAL

FOLDER = Path(__file__).parents[2] / "docs" / "paper"
PAGE = (FOLDER / "figures.md").read_text("utf-8")


def test_nodes_and_edges_of_a_description():
    nodes, edges = block_diagrams.parse(
        """
        box a 0 0 2 1 one / two
            / three
        sum s 3 -2
        a.e -|> s.n : $e$
        a.s@-0.5 -- a.s :
        """
    )
    assert nodes["a"] == {
        "kind": "box", "x": 0, "y": 0, "width": 2, "height": 1, "text": "one\ntwo\nthree"
    }  # fmt: skip
    assert edges[0] == {"start": (1, 0), "end": (3, -1.7), "route": "-|>", "label": "$e$"}
    assert edges[1]["start"] == (-0.5, -0.5) and edges[1]["end"] == (0, -0.5)


@pytest.mark.parametrize(
    ("line", "message"),
    [("bax a 0 0 1 1 text", "neither a node nor an edge"), ("a.e -> b.w :", r"\['a', 'b'\]")],
)
def test_mistakes_in_a_description_are_named(line, message):
    with pytest.raises(ValueError, match=message):
        block_diagrams.parse(line)


@pytest.mark.parametrize("number", block_diagrams.FIGURES)
def test_words_lie_within_their_blocks_and_blocks_apart(number):
    description = block_diagrams.FIGURES[number]
    nodes, edges = block_diagrams.parse(description)
    figure = block_diagrams.draw(description)
    figure.canvas.draw()
    (ax,) = figure.axes
    to_data = ax.transData.inverted()
    boxes = [node for node in nodes.values() if node["kind"] == "box"]
    for text in ax.texts:
        x, y = text.get_position()
        own = [box for box in boxes if (box["x"], box["y"]) == (x, y)]
        if own:
            extent = text.get_window_extent().transformed(to_data)
            assert extent.width < own[0]["width"] and extent.height < own[0]["height"], text
    for i, one in enumerate(boxes):
        for other in boxes[i + 1 :]:
            gap_x = abs(one["x"] - other["x"]) - (one["width"] + other["width"]) / 2
            gap_y = abs(one["y"] - other["y"]) - (one["height"] + other["height"]) / 2
            assert max(gap_x, gap_y) > 0.2
    for edge in edges:
        straight = edge["route"] in ("->", "--")
        assert straight == (0 in np.subtract(edge["start"], edge["end"]).round(9))


def test_diagrams_take_the_colours_of_the_style_in_use():
    with matplotlib.rc_context(ANY_PAGE):
        figure = block_diagrams.draw("dot a 0 0\ntext b 2 0 word\na.e -> b.w : label")
    (ax,) = figure.axes
    assert {text.get_color() for text in ax.texts} == {NEUTRAL}
    assert ax.lines[0].get_color() == NEUTRAL
    (dot,) = [patch for patch in ax.patches if isinstance(patch, Circle)]
    assert matplotlib.colors.to_hex(dot.get_facecolor()) == NEUTRAL
    assert figure.get_facecolor()[3] == 0


def test_every_figure_of_the_paper_has_a_row():
    rows = re.findall(r"^\| ([\d-]+) \| .+ \| .+ \|$", PAGE, flags=re.M)
    assert rows == [*map(str, range(1, 12)), "12-19"]


def test_every_image_is_shown_and_small():
    shown = re.findall(r"!\[[^\]]{20,}\]\(images/([^)]+)\)", PAGE)
    stored = {path.name: path.stat().st_size for path in (FOLDER / "images").iterdir()}
    expected = [f"figure_{n:02}" for n in (*range(4, 13), *range(13, 20))] + ["ladder", "bank"]
    assert sorted(Path(name).stem for name in shown) == sorted(expected)
    assert set(shown) <= set(stored)
    assert max(stored[name] for name in shown) < 150_000


def test_conditions_have_the_figures_that_the_paper_gives_them():
    assert set(RESIDUAL_FIGURES) == set(CONDITIONS)
    assert list(RESIDUAL_FIGURES.values()) == list(range(12, 20))
    assert list(RESIDUAL_FIGURES) == load_tables().tables[6].frame.index.tolist()


def test_command_writes_the_images_of_the_page(tmp_path, monkeypatch):
    small = draw_figures.simulate_rig
    monkeypatch.setattr(draw_figures, "simulate_rig", lambda **kw: small(n_samples=12_000, **kw))
    # What figures look like is tested elsewhere; rendering all of them takes long.
    monkeypatch.setattr(Figure, "savefig", lambda self, path, **kw: path.touch())
    draw_figures.main(tmp_path)
    written = {path.name for path in tmp_path.iterdir()}
    assert written == set(re.findall(r"\(images/([^)]+)\)", PAGE))
