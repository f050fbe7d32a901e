"""Searches with speeds and weights, against loops written by hand, and ensembles."""

import numpy as np
import pytest
import sklearn
from sklearn.base import clone
from sklearn.ensemble import BaggingClassifier
from sklearn.exceptions import FitFailedWarning
from sklearn.experimental import enable_halving_search_cv  # noqa: F401
from sklearn.model_selection import (
    GridSearchCV,
    ParameterGrid,
    StratifiedKFold,
)

from skarxlag import (
    SensorFusion,
    make_alpio,
    make_diagnoser,
)
from skarxlag.core.capabilities import capabilities

RATE = 2_000
BEARING = {"outer": 3.6, "inner": 5.4}
CV = StratifiedKFold(2)
pytestmark = pytest.mark.filterwarnings(
    "ignore:.* rows of condition .* are too few:UserWarning",
    "ignore:.* healthy rows are too few:UserWarning",
    "ignore:All rows of condition .* have one speed:UserWarning",
)


@pytest.fixture
def routing():
    with sklearn.config_context(enable_metadata_routing=True):
        yield


@pytest.fixture(scope="module")
def rows():
    """Stretches of half a second at two speeds, in two conditions that overlap."""
    rng = np.random.default_rng(3)
    X = rng.normal(size=(24, 1000))
    rpm = np.tile([600.0, 900.0], 12)
    for row in range(12, 24):
        interval = 60 * RATE / (rpm[row] * BEARING["outer"])
        X[row, np.arange(0, 1000, interval).astype(int)] += rng.uniform(1, 5)
    weight = rng.integers(1, 4, size=24).astype(float)
    return X, np.repeat(["good", "outer"], 12), {"rpm": rpm, "sample_weight": weight}


MODELS = {
    "stretches": (
        make_diagnoser(sampling_rate=RATE),
        {"decide__residual__order_residual__n_jobs": [None, 2]},
    ),
    "bearing": (
        make_diagnoser(sampling_rate=RATE, bearing=BEARING),
        {"decide__bearing": [BEARING, "6205"]},
    ),
    "sensors": (
        SensorFusion(estimator=make_diagnoser()),
        {"estimator__decide__recorded_prior": [0.3, 0.7]},
    ),
}


def score_by_hand(model, X, y, metadata, train, test):
    """Fit on some rows and score on others, each with their metadata."""
    of_fit, of_score = (
        {name: values[rows] for name, values in metadata.items()}
        for rows in (train, test)
    )
    return model.fit(X[train], y[train], **of_fit).score(X[test], y[test], **of_score)


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_a_grid_search_is_a_loop_with_the_metadata_of_each_split(routing, rows, name):
    X, y, metadata = rows
    (model, grid), metadata = MODELS[name], dict(metadata)
    if name == "sensors":
        X = np.stack([X, X[::-1]], axis=1)
    search = GridSearchCV(clone(model), grid, cv=CV, error_score="raise").fit(
        X, y, **metadata
    )
    expected = [
        score_by_hand(clone(model).set_params(**candidate), X, y, metadata, *split)
        for split in CV.split(X, y)
        for candidate in ParameterGrid(grid)
    ]
    scores = [search.cv_results_[f"split{n}_test_score"] for n in range(2)]
    assert np.concatenate(scores).tolist() == expected
    best = clone(model).set_params(**search.best_params_).fit(X, y, **metadata)
    # A search of scikit-learn takes no metadata in predict, and its best estimator
    # does.
    found = search.best_estimator_.predict(X, rpm=metadata["rpm"])
    np.testing.assert_array_equal(found, best.predict(X, rpm=metadata["rpm"]))
    assert search.score(X, y, **metadata) == best.score(X, y, **metadata)
    assert capabilities(search).speeds == pytest.approx((600.0, 900.0))
    assert len(np.unique(expected)) > 1


@pytest.mark.slow
def test_a_candidate_with_unstable_gains_scores_as_failed_and_the_others_count(rows):
    X, y, _ = rows
    grid = {"observe__ki": [0.1, 3.0]}
    search = GridSearchCV(make_alpio(), grid, cv=CV, error_score=np.nan)
    with (
        pytest.warns(FitFailedWarning, match="2 fits failed out of a total of 4"),
        pytest.warns(UserWarning, match="test scores are non-finite"),
    ):
        search.fit(X, y)
    assert np.isnan(search.cv_results_["mean_test_score"]).tolist() == [False, True]
    assert search.best_params_ == {"observe__ki": 0.1}


def test_the_healthy_condition_of_an_ensemble_is_its_number(rows):
    X, y, _ = rows
    with pytest.raises(ValueError, match="number the sorted conditions: pass the num"):
        BaggingClassifier(make_diagnoser(healthy="good"), n_estimators=2).fit(X, y)
