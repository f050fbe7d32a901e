import numpy as np
import pytest

from benchmarks.paper.comparison import paper_improvements
from benchmarks.paper.printed_tables import load_tables

#: Typed from the paper: (table, condition, column): percent.
CELLS = {
    (2, "IR", ("proposed", 3)): 95,
    (2, "IR", ("ALPIO", 3)): 67,
    (2, "Ball", ("ALPIO", 6)): 74,
    (3, "IR-OR", ("proposed", 6)): 100,
    (3, "OR-Ball", ("ALPIO", 3)): 83,
    (4, "IR-OR-Ball", ("ALPIO", 3)): 79,
    (4, "OR", ("proposed", 6)): 98,
    (5, "Normal", ("ALPIO", 6)): 90,
    (5, "IR-OR-Ball", ("proposed", 3)): 97,
    (8, "IR-OR-Ball", ("proposed", 500)): 98,
    (8, "IR-OR", ("ALPIO", 450)): 72,
    (8, "OR-Ball", ("ALPIO", 300)): 79,
    (9, "OR", ("ALPIO", 400)): 76,
    (9, "Ball", ("proposed", 300)): 100,
}
CONDITIONS = ["Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]


@pytest.mark.parametrize(("cell", "percent"), CELLS.items())
def test_cells_of_the_paper(cell, percent):
    number, condition, column = cell
    assert load_tables().tables[number].frame.loc[condition, column] == percent


@pytest.mark.parametrize(
    ("number", "crack_mm", "rows", "right", "bottom", "accuracy"),
    [
        (
            6,
            3,
            {
                "Ball": [1, 97, 0, 0, 1, 1, 0, 0],
                "IR-OR-Ball": [0, 0, 0, 0, 0, 0, 3, 97],
            },
            [100, 97, 95, 96, 94, 97, 98, 97],
            [97.1, 97.9, 99, 93.2, 94, 97.9, 95.1, 100],
            95.07,
        ),
        (
            7,
            6,
            {"IR": [0, 0, 96, 3, 0, 0, 1, 0], "OR-Ball": [1, 2, 0, 0, 0, 97, 0, 0]},
            [100, 99, 96, 97, 98, 97, 100, 98],
            [99, 96.1, 97, 96, 99, 100, 98, 100],
            98.13,
        ),
    ],
)
def test_confusion_matrices_of_the_paper(
    number, crack_mm, rows, right, bottom, accuracy
):
    table = load_tables().tables[number]
    order = ["Normal", "Ball", "IR", "OR", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
    assert (table.rpm, table.crack_mm, table.accuracy) == (400, crack_mm, accuracy)
    assert table.frame.index.tolist() == table.frame.columns.tolist() == order
    for name, values in rows.items():
        assert table.frame.loc[name].tolist() == values
    assert (
        table.right_margin.loc[order].tolist() == right
        and table.right_label == "Precision"
    )
    assert (
        table.bottom_margin.loc[order].tolist() == bottom
        and table.bottom_label == "Recall"
    )
    # Why rows are the true conditions: 100 windows of each were tested.
    assert (table.frame.sum(axis=1) == 100).all() and (table.frame.sum() != 100).any()


def test_improvements_of_the_paper_recomputed():
    expected = {
        "claimed in the abstract": [17.82, 16.625],
        "claimed in section 5": [17.82, 16.625],
        "claimed in the conclusion": [17.62, 16.626],
        "printed averages of Tables 2-5": [18.35, 16.625],
        "rows of Tables 2-5": [17.3125, 16.375],
        "rows of Tables 2-4, the test sets": [18.125, 17.125],
        "rows of Tables 8 and 9": [17.46875, 16.75],
    }
    table = paper_improvements()
    assert table.index.tolist() == list(expected)
    np.testing.assert_allclose(table[["3 mm", "6 mm"]], list(expected.values()))
