import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import (
    accuracy_score,
    confusion_matrix,
    precision_score,
    recall_score,
)

from skarxlag.model_selection.accuracy_tables import (
    confusion_table,
    speed_accuracy,
    speed_summary,
)

CONDITIONS = ["normal", "ball", "inner"]


@pytest.fixture
def verdicts():
    rng = np.random.default_rng(0)
    n = 900
    return pd.DataFrame(
        {
            # Not in alphabetical order: columns stand in order of appearance.
            "diagnoser": np.repeat(["zeta", "alpha", "mu"], n // 3),
            "crack_mm": rng.choice([6.0, 3.0], n),
            "train_rpm": rng.choice([300.0, 500.0], n),
            "test_rpm": rng.choice([300.0, 400.0, 500.0], n),
            "true": rng.choice(CONDITIONS, n),
            "predicted": rng.choice(CONDITIONS, n),
        }
    )


def test_speed_accuracy_and_summary(verdicts):
    table = speed_accuracy(verdicts)
    assert table.index.tolist() == [300, 500] and table.columns.tolist() == [
        300,
        400,
        500,
    ]
    other, same = [], []
    for train in (300, 500):
        for test in (300, 400, 500):
            own = verdicts[
                (verdicts["train_rpm"] == train) & (verdicts["test_rpm"] == test)
            ]
            accuracy = 100 * accuracy_score(own["true"], own["predicted"])
            assert table.loc[train, test] == pytest.approx(accuracy)
            (same if train == test else other).append(accuracy)
    assert speed_summary(table) == pytest.approx(
        {
            "mean_other_speed": np.mean(other),
            "worst_pair": min(other),
            "mean_same_speed": np.mean(same),
        }
    )


def test_summary_of_one_speed_has_no_other():
    summary = speed_summary(pd.DataFrame([[90.0]], index=[300.0], columns=[300.0]))
    assert summary["mean_same_speed"] == 90 and np.isnan(summary["mean_other_speed"])


def test_confusion_table_has_recall_on_the_right_and_precision_below(verdicts):
    table = confusion_table(verdicts, CONDITIONS)
    true, predicted = verdicts["true"], verdicts["predicted"]
    counts = confusion_matrix(true, predicted, labels=CONDITIONS)
    assert table.loc[CONDITIONS, CONDITIONS].to_numpy().tolist() == counts.tolist()
    options = {"labels": CONDITIONS, "average": None}
    np.testing.assert_allclose(
        table["recall %"].iloc[:-1], 100 * recall_score(true, predicted, **options)
    )
    np.testing.assert_allclose(
        table.loc["precision %"].iloc[:-1],
        100 * precision_score(true, predicted, **options),
    )
    assert table.loc["precision %", "recall %"] == pytest.approx(
        100 * accuracy_score(true, predicted)
    )


def test_precision_of_a_condition_that_is_never_given_is_unknown():
    verdicts = pd.DataFrame(
        {"true": ["ball", "normal"], "predicted": ["normal", "normal"]}
    )
    table = confusion_table(verdicts, ["normal", "ball"])
    assert (
        np.isnan(table.loc["precision %", "ball"])
        and table.loc["ball", "recall %"] == 0
    )
