"""Block diagrams and the page of figures."""

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from benchmarks.figures import paper_figures
from benchmarks.figures.diagrams import DIAGRAMS, TEXT, Diagram, draw
from benchmarks.figures.paper_figures import RESIDUAL_FIGURES
from benchmarks.paper.printed_tables import load_tables
from skarxlag.datasets.simulated import CONDITIONS

FOLDER = Path(__file__).parents[2] / "docs" / "paper"
PAGE = (FOLDER / "figures.md").read_text("utf-8")


@pytest.mark.parametrize("diagram", DIAGRAMS.values(), ids=DIAGRAMS)
def test_blocks_lie_apart_and_within_a_picture_that_fits_a_telephone(diagram):
    figure = draw(diagram)
    figure.canvas.draw()
    (ax,) = figure.axes
    margin = 0.4 * TEXT * figure.dpi / 72
    framed = [text for text in ax.texts if text.get_bbox_patch()]
    frames = [text.get_window_extent().padded(margin) for text in framed]
    assert len(frames) == len(diagram.blocks)
    for i, one in enumerate(frames):
        assert ax.bbox.x0 <= one.x0 and one.x1 <= ax.bbox.x1
        for other in frames[i + 1 :]:
            assert not one.overlaps(other)
    # On a screen of 390 px, of which the page leaves 358 for a picture, letters have 8
    # pt and more.
    assert TEXT * min(1, 358 / 96 / figure.get_figwidth()) >= 8


def test_an_arrow_between_unknown_blocks_is_named():
    with pytest.raises(KeyError, match="b"):
        draw(Diagram({"a": (0, 0, "one")}, [("a", "b", "")]))


def test_every_figure_of_the_paper_has_a_row():
    rows = re.findall(r"^\| ([\d-]+) \| .+ \| .+ \|$", PAGE, flags=re.M)
    assert rows == [*map(str, range(1, 12)), "12-19"]


def test_every_image_is_shown_and_small():
    shown = re.findall(r"!\[[^\]]{20,}\]\(images/([^)]+)\)", PAGE)
    stored = {path.name: path.stat().st_size for path in (FOLDER / "images").iterdir()}
    expected = [f"figure_{n:02}" for n in (*range(4, 13), *range(13, 20))] + [
        "ladder",
        "bank",
    ]
    assert sorted(Path(name).stem for name in shown) == sorted(expected)
    assert set(shown) <= set(stored)
    assert max(stored[name] for name in shown) < 150_000


def test_conditions_have_the_figures_that_the_paper_gives_them():
    assert set(RESIDUAL_FIGURES) == set(CONDITIONS)
    assert list(RESIDUAL_FIGURES.values()) == list(range(12, 20))
    assert list(RESIDUAL_FIGURES) == load_tables().tables[6].frame.index.tolist()


@pytest.mark.slow
def test_command_writes_the_images_of_the_page(tmp_path, monkeypatch):
    small = paper_figures.simulate_rig
    monkeypatch.setattr(
        paper_figures, "simulate_rig", lambda **kw: small(n_samples=12_000, **kw)
    )
    # What figures look like is tested elsewhere; rendering all of them takes long.
    monkeypatch.setattr(Figure, "savefig", lambda self, path, **kw: path.touch())
    paper_figures.main([str(tmp_path)])
    written = {path.name for path in tmp_path.iterdir()}
    assert written == set(re.findall(r"\(images/([^)]+)\)", PAGE))
