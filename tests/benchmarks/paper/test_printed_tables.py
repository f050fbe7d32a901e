import numpy as np
import pytest

from benchmarks.paper.comparison import paper_improvements
from benchmarks.paper.printed_tables import load_tables

#: Typed from the paper: (table, condition, column): percent.
CELLS = {
    (2, "IR", ("proposed", 3)): 95,
    (3, "IR-OR", ("proposed", 6)): 100,
    (4, "IR-OR-Ball", ("ALPIO", 3)): 79,
    (5, "Normal", ("ALPIO", 6)): 90,
    (8, "IR-OR-Ball", ("proposed", 500)): 98,
    (9, "Ball", ("proposed", 300)): 100,
}


@pytest.mark.parametrize(("cell", "percent"), CELLS.items())
def test_cells_of_the_paper(cell, percent):
    number, condition, column = cell
    assert load_tables().tables[number].frame.loc[condition, column] == percent


def test_confusion_matrix_of_the_paper():
    table = load_tables().tables[6]
    order = ["Normal", "Ball", "IR", "OR", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
    assert (table.rpm, table.crack_mm, table.accuracy) == (400, 3, 95.07)
    assert table.frame.index.tolist() == table.frame.columns.tolist() == order
    assert table.frame.loc["Ball"].tolist() == [1, 97, 0, 0, 1, 1, 0, 0]
    right, bottom = table.right_margin.loc[order], table.bottom_margin.loc[order]
    assert right.tolist() == [100, 97, 95, 96, 94, 97, 98, 97]
    assert bottom.tolist() == [97.1, 97.9, 99, 93.2, 94, 97.9, 95.1, 100]
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
