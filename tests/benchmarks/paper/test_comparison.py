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
METHODS = ["Diagnoser", "ALPIO", "proposed"]


def make_verdicts(seed, speeds):
    rng = np.random.default_rng(seed)
    keys = pd.MultiIndex.from_product(
        [METHODS, (6.0, 3.0), speeds, CONDITIONS, range(5)],
        names=["diagnoser", "crack_mm", "test_rpm", "true", "start"],
    )
    verdicts = keys.to_frame(index=False).assign(train_rpm=500.0)
    guessed = rng.choice(CONDITIONS, len(verdicts))
    verdicts["predicted"] = np.where(
        rng.random(len(verdicts)) < 0.6, verdicts["true"], guessed
    )
    return verdicts


@pytest.fixture
def verdicts():
    return make_verdicts(0, (500.0, 300.0, 400.0, 450.0))


@pytest.fixture
def halves():
    return make_verdicts(1, (500.0,))


def chosen(verdicts, **values):
    for name, value in values.items():
        verdicts = verdicts[verdicts[name] == value]
    return verdicts["true"], verdicts["predicted"]


@pytest.mark.parametrize("number", [2, 3, 4, 5, 8, 9])
def test_accuracy_with_the_paper(verdicts, number):
    table = accuracy_with_paper(verdicts.sample(frac=1, random_state=0), number)
    printed = load_tables().tables[number]
    assert table.index.tolist() == [*CONDITIONS, "Average", "Average, as printed"]
    fixed = {"test_rpm": printed.rpm} if number < 6 else {"crack_mm": printed.crack_mm}
    inner = "crack_mm" if number < 6 else "test_rpm"
    values = [3, 6] if number < 6 else [300, 400, 450, 500]
    assert table.columns.names == ["source", "method", inner]
    own = [
        ("simulated rig", m, v)
        for m in ("proposed", "ALPIO", "Diagnoser")
        for v in values
    ]
    paper = [("paper", m, v) for m in ("proposed", "ALPIO") for v in values]
    assert table.columns.tolist() == own + paper
    for _, method, value in own:
        true, predicted = chosen(verdicts, diagnoser=method, **fixed, **{inner: value})
        counts = confusion_matrix(true, predicted, labels=CONDITIONS)
        recall = 100 * counts.diagonal() / counts.sum(axis=1)
        column = table["simulated rig", method, value]
        np.testing.assert_allclose(column[:9], [*recall, recall.mean()])
        assert np.isnan(column.iloc[9])
    reference = table["paper"].to_numpy()
    assert reference[:8].tolist() == printed.frame.to_numpy().tolist()
    np.testing.assert_allclose(reference[8], printed.frame.to_numpy().mean(axis=0))
    assert reference[9].tolist() == printed.average.tolist()


@pytest.mark.parametrize(
    ("number", "crack_mm", "overall"), [(6, 3, 96.75), (7, 6, 98.125)]
)
def test_confusion_with_the_paper(verdicts, number, crack_mm, overall):
    matrices = confusion_with_paper(verdicts, number)
    assert list(matrices) == [
        ("paper", "proposed"),
        ("simulated rig", "proposed"),
        ("simulated rig", "ALPIO"),
        ("simulated rig", "Diagnoser"),
    ]
    for (source, method), matrix in matrices.items():
        true, predicted = chosen(
            verdicts, diagnoser=method, crack_mm=crack_mm, test_rpm=400
        )
        printed = load_tables().tables[number]
        if source == "paper":
            # The windows that would give the paper's counts.
            counts = printed.frame.to_numpy(dtype=int)
            true = np.repeat(MATRIX, counts.sum(axis=1))
            predicted = np.concatenate([np.repeat(MATRIX, row) for row in counts])
        options = {"labels": MATRIX, "average": None}
        assert matrix.loc[MATRIX, MATRIX].to_numpy().tolist() == (
            confusion_matrix(true, predicted, labels=MATRIX).tolist()
        )
        np.testing.assert_allclose(
            matrix.loc[MATRIX, "recall %"],
            100 * recall_score(true, predicted, **options),
        )
        np.testing.assert_allclose(
            matrix.loc["precision %", MATRIX],
            100 * precision_score(true, predicted, **options),
        )
        accuracy = 100 * accuracy_score(true, predicted)
        assert matrix.loc["precision %", "recall %"] == pytest.approx(accuracy)
    paper = matrices["paper", "proposed"]
    assert paper.loc["precision %", "recall %"] == overall
    # What the paper calls precision is the recall, and the other way round.
    assert paper[MATRIX[0]].index[-1] == 'printed as "Recall"'
    np.testing.assert_allclose(
        paper.loc[MATRIX, "recall %"], paper.loc[MATRIX].iloc[:, -1]
    )
    np.testing.assert_allclose(
        paper.loc["precision %", MATRIX].astype(float),
        paper.loc['printed as "Recall"', MATRIX].astype(float),
        atol=0.1,
    )
    assert (
        paper.loc['printed as "Recall"', 'printed as "Precision"'] == printed.accuracy
    )


def test_averages_over_speeds_and_halves(verdicts, halves):
    table = averages(verdicts, halves)
    assert table.columns.tolist() == [
        (method, crack)
        for method in ("proposed", "ALPIO", "Diagnoser")
        for crack in ("3 mm", "6 mm", "both")
    ]
    tested = verdicts[verdicts["test_rpm"] != 500]
    sets = {
        "rows of Tables 2-5": verdicts,
        "rows of Tables 2-4, the test sets": tested,
        "rows of Tables 2-4, and of 5 by halves": pd.concat([tested, halves]),
    }
    assert table.index.tolist() == list(sets)
    for basis, own in sets.items():
        for method in METHODS:
            by_crack = [
                100 * accuracy_score(*chosen(own, diagnoser=method, crack_mm=crack))
                for crack in (3, 6)
            ]
            np.testing.assert_allclose(
                table.loc[basis, method], [*by_crack, np.mean(by_crack)]
            )
    assert table.iloc[0].to_list() != table.iloc[2].to_list()
