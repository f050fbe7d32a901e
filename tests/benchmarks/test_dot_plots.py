"""Dot plots show the numbers of their tables."""

import pandas as pd
import pytest

from benchmarks.pages import dot_plots, dot_tables
from benchmarks.pages.modules import ROOT

pytest.importorskip("matplotlib")


def test_every_dot_plot_has_a_layout_and_is_shown_on_a_page():
    assert set(dot_plots.LAYOUTS) == set(dot_tables.TABLES)
    pages = [ROOT / "README.md", ROOT / "benchmarks" / "README.md"]
    pages += (ROOT / "docs").glob("*.md")
    text = "".join(page.read_text("utf-8") for page in pages)
    assert not [name for name in dot_tables.TABLES if f"dots_{name}.svg" not in text]


@pytest.mark.parametrize("name", dot_tables.TABLES)
def test_every_table_gives_dots(name):
    table = dot_tables.read_table(name)
    assert len(table) and table["value"].notna().all()
    assert (table["row"].str.len() > 0).all()
    assert not (table["low"] > table["value"]).any()
    assert not (table["high"] < table["value"]).any()


def test_means_and_rigs_of_a_table_of_methods():
    stored = pd.DataFrame(
        {
            "table": ["A"],
            "method": ["ours"],
            "mean of rigs": ["**0.75**"],
            "limits": ["0.6 to 0.9"],
            "UESTC": ["0.5"],
            "MFPT": ["1.0"],
        }
    )
    read = dot_tables.means_and_rigs(lambda row: row["table"], "method", "limits")
    values = [(series, value, low) for _, _, series, value, low, _ in read(stored)]
    assert values[-1] == (dot_tables.MEAN, 0.75, 0.6)
    assert [value for series, value, _ in values if series == dot_tables.RIG] == [
        0.5,
        1.0,
    ]


def test_a_share_of_a_count_is_in_percent():
    (ball,) = dot_tables.read_table("fault_orders_named").query("row == 'UESTC, ball'")[
        "value"
    ]
    assert ball == 100


def test_a_picture_names_every_row(tmp_path):
    dot_plots.draw("detection", tmp_path / "dots.svg")
    text = (tmp_path / "dots.svg").read_text("utf-8")
    rows = dot_tables.read_table("detection")["row"].unique()
    assert all(row in text for row in rows)
