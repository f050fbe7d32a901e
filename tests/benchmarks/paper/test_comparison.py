"""Tables of the paper beside those of the simulated rig."""

import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import (
    accuracy_score,
    confusion_matrix,
    precision_score,
    recall_score,
)

from benchmarks.paper.comparison import (
    accuracy_with_paper,
    averages,
    confusion_with_paper,
)
from benchmarks.paper.printed_tables import load_tables

CONDITIONS = ["Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
#: Rows and columns of Tables 6 and 7 stand in another order.
MATRIX = ["Normal", "Ball", "IR", "OR", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
METHODS = ["proposed", "ALPIO", "Diagnoser"]


def chosen(verdicts, **values):
    for name, value in values.items():
        verdicts = verdicts[verdicts[name] == value]
    return verdicts["true"], verdicts["predicted"]


@pytest.mark.parametrize("number", [2, 9])
def test_accuracy_is_the_recall_of_each_condition(verdicts, number):
    table = accuracy_with_paper(verdicts.sample(frac=1, random_state=0), number)
    printed = load_tables().tables[number]
    fixed = {"test_rpm": printed.rpm} if number < 6 else {"crack_mm": printed.crack_mm}
    inner = "crack_mm" if number < 6 else "test_rpm"
    values = [3, 6] if number < 6 else [300, 400, 450, 500]
    heads = [("simulated rig", m, v) for m in METHODS for v in values]
    heads += [("paper", m, v) for m in METHODS[:2] for v in values]
    assert table.columns.tolist() == heads
    assert table.index.tolist() == [*CONDITIONS, "Average", "Average, as printed"]
    for source, method, value in heads[: 3 * len(values)]:
        true, predicted = chosen(verdicts, diagnoser=method, **fixed, **{inner: value})
        recall = 100 * recall_score(true, predicted, labels=CONDITIONS, average=None)
        column = table[source, method, value]
        np.testing.assert_allclose(column, [*recall, recall.mean(), np.nan])
    expected = [printed.frame, [printed.frame.mean()], [printed.average]]
    np.testing.assert_allclose(table["paper"], np.concatenate(expected))


def test_confusion_with_the_paper(verdicts):
    matrices = confusion_with_paper(verdicts, 6)
    printed = load_tables().tables[6]
    simulated = [("simulated rig", method) for method in METHODS]
    assert list(matrices) == [("paper", "proposed"), *simulated]
    for (source, method), matrix in matrices.items():
        true, predicted = chosen(verdicts, diagnoser=method, crack_mm=3, test_rpm=400)
        if source == "paper":
            # The windows that would give the paper's counts.
            counts = printed.frame.to_numpy(dtype=int)
            true = np.repeat(MATRIX, counts.sum(axis=1))
            predicted = np.concatenate([np.repeat(MATRIX, row) for row in counts])
        options = {"labels": MATRIX, "average": None}
        counts = confusion_matrix(true, predicted, labels=MATRIX)
        recall = 100 * recall_score(true, predicted, **options)
        precision = 100 * precision_score(true, predicted, **options)
        accuracy = 100 * accuracy_score(true, predicted)
        np.testing.assert_array_equal(matrix.loc[MATRIX, MATRIX], counts)
        np.testing.assert_allclose(matrix.loc[MATRIX, "recall %"], recall)
        row = matrix.loc["precision %", [*MATRIX, "recall %"]].astype(float)
        np.testing.assert_allclose(row, [*precision, accuracy])
    paper = matrices["paper", "proposed"]
    # What the paper calls precision is the recall, and the other way round.
    assert paper.loc['printed as "Recall"', 'printed as "Precision"'] == 95.07
    recall = paper.loc[MATRIX, ["recall %", 'printed as "Precision"']]
    np.testing.assert_allclose(*recall.to_numpy().T)


def test_averages_over_speeds_and_halves(verdicts, halves):
    table = averages(verdicts, halves)
    tested = verdicts[verdicts["test_rpm"] != 500]
    sets = {
        "rows of Tables 2-5": verdicts,
        "rows of Tables 2-4, the test sets": tested,
        "rows of Tables 2-4, and of 5 by halves": pd.concat([tested, halves]),
    }
    assert table.index.tolist() == list(sets)
    for basis, rows in sets.items():
        for method in METHODS:
            by_crack = [
                100 * accuracy_score(*chosen(rows, diagnoser=method, crack_mm=crack))
                for crack in (3, 6)
            ]
            expected = dict(zip(("3 mm", "6 mm"), by_crack, strict=True))
            expected["both"] = np.mean(by_crack)
            assert table.loc[basis, method].to_dict() == pytest.approx(expected)
