import numpy as np
import pandas as pd
import pytest
from sklearn.metrics import recall_score

from benchmarks.paper.comparison import condition_accuracy

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
            "true": rng.choice(CONDITIONS, n),
            "predicted": rng.choice(CONDITIONS, n),
        }
    )


@pytest.mark.parametrize("columns", [["diagnoser"], ["diagnoser", "crack_mm"]])
def test_condition_accuracy_is_recall(verdicts, columns):
    table = condition_accuracy(verdicts, CONDITIONS, columns)
    assert table.index.tolist() == [*CONDITIONS, "Average"]
    heads = [key if isinstance(key, tuple) else (key,) for key in table.columns]
    assert list(dict.fromkeys(head[0] for head in heads)) == ["zeta", "alpha", "mu"]
    assert len(heads) == len(set(heads)) == 3 * len(columns)
    for head, column in zip(heads, table.to_numpy().T, strict=True):
        own = verdicts
        for name, value in zip(columns, head, strict=True):
            own = own[own[name] == value]
        recall = 100 * recall_score(
            own["true"], own["predicted"], labels=CONDITIONS, average=None
        )
        np.testing.assert_allclose(column, [*recall, recall.mean()])
