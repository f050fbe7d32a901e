"""Clusters of Dask: the same scores and searches as in one process."""

import dask
import dask.array
import distributed
import numpy as np
import pytest
from joblib import parallel_config
from scipy.signal import lfilter
from sklearn.model_selection import GridSearchCV, cross_val_score

from skarxlag import make_alpio

WINDOW = 200


@pytest.fixture(scope="module")
def windows():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(24, WINDOW))
    X[12:] = lfilter([1.0], [1.0, -0.2], X[12:])
    return X, np.repeat(["good", "worn"], 12)


@pytest.fixture(scope="module")
def client():
    """A cluster within this process, whose tasks and results are pickled all the same."""
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        distributed.LocalCluster(processes=False, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_scikit_learn_scores_and_searches_on_a_cluster(client, windows):
    X, y = windows
    orders = {"identify__order": [1, 2, 4]}
    expected = cross_val_score(make_alpio(), X, y, cv=2)
    alone = GridSearchCV(make_alpio(), orders, cv=2).fit(X, y)
    assert len(set(alone.cv_results_["mean_test_score"])) > 1
    with parallel_config("dask"):
        scores = cross_val_score(make_alpio(), X, y, cv=2)
        search = GridSearchCV(make_alpio(), orders, cv=2).fit(X, y)
    np.testing.assert_array_equal(scores, expected)
    assert search.best_params_ == alone.best_params_
    np.testing.assert_array_equal(search.predict_proba(X), alone.predict_proba(X))


def test_a_dask_array_is_refused_with_a_recipe_that_works(windows):
    diagnoser = make_alpio().fit(*windows)
    X = windows[0]
    lazy = dask.array.from_array(X, chunks=(10, -1))
    with pytest.raises(TypeError, match=r"X.map_blocks\(diagnoser.predict, dtype="):
        diagnoser.predict(lazy)
    verdicts = lazy.map_blocks(
        diagnoser.predict, dtype=diagnoser.classes_.dtype, drop_axis=1
    )
    np.testing.assert_array_equal(
        verdicts.compute(scheduler="sync"), diagnoser.predict(X)
    )
