"""Outputs of the examples on real recordings are kept, and shown on their pages."""

import pytest

from benchmarks.blocks import ROOT
from benchmarks.figures import gallery

NAMES = [example.stem for example in gallery.EXAMPLES]


def test_every_kept_output_has_its_example():
    assert {path.stem for path in gallery.KEPT.iterdir()} == set(NAMES)


@pytest.mark.parametrize("example", gallery.EXAMPLES, ids=NAMES)
def test_an_example_has_its_output_and_shows_it_as_its_thumbnail(example):
    path = f"images/gallery/{example.stem}.png"
    text = example.read_text("utf-8")
    assert f"# sphinx_gallery_thumbnail_path = '{path}'" in text
    assert (ROOT / "docs" / path).exists()
    assert (ROOT / "docs" / path).with_suffix(".txt").read_text("utf-8")


def test_running_an_example_writes_its_text_and_its_figure(tmp_path):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    example = tmp_path / "real_line.py"
    program = "from matplotlib import pyplot\nprint('a line')\npyplot.plot([1, 2])\n"
    example.write_text(program, "utf-8")
    gallery.run(example, tmp_path / "kept")
    assert (tmp_path / "kept" / "real_line.txt").read_text("utf-8") == "a line\n"
    example.write_text("print('no figure')", "utf-8")
    with pytest.raises(ValueError, match="draws 0 figures"):
        gallery.run(example, tmp_path / "kept")
