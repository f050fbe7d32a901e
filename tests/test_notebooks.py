"""Callbacks of a fit, and links from a notebook to the documentation."""

from pathlib import Path

import numpy as np
import pytest
from sklearn.base import BaseEstimator
from sklearn.utils import estimator_html_repr

import skarxlag
from skarxlag import load_diagnoser, make_diagnoser, save_diagnoser

DOCS = Path(__file__).parents[1] / "docs"
X = np.random.default_rng(0).normal(size=(12, 300))
Y = np.repeat(["good", "worn"], 6)


class Noting:
    """A callback as scikit-learn describes it, which notes the tasks that begin."""

    def __init__(self, max_propagation_depth):
        self.max_propagation_depth = max_propagation_depth
        self.begun = []

    def setup(self, estimator, context):
        self.begun.append("setup")

    def teardown(self, estimator, context):
        self.begun.append("teardown")

    def on_fit_task_begin(self, estimator, context, **what):
        self.begun.append((type(estimator).__name__, context.task_name))

    def on_fit_task_end(self, estimator, context, **what):
        return False


def test_callbacks_follow_the_steps_and_stay_out_of_files(tmp_path):
    pytest.importorskip("sklearn.callback")
    callback = Noting(0)
    diagnoser = make_diagnoser().set_callbacks(callback)
    diagnoser.fit(X, Y, sample_weight=np.arange(12))
    names = [name for name, _ in diagnoser.steps]
    tasks = [
        "fit",
        *(f"fit-transform-{name}" for name in names[:-1]),
        "fit-final-estimator",
    ]
    expected = [("DiagnosisPipeline", task) for task in tasks]
    assert callback.begun == ["setup", *expected, "teardown"]
    save_diagnoser(diagnoser, tmp_path / "d.skops")
    loaded, _ = load_diagnoser(tmp_path / "d.skops")
    np.testing.assert_array_equal(loaded.predict_proba(X), diagnoser.predict_proba(X))


ESTIMATORS = [
    public
    for public in (getattr(skarxlag, name) for name in skarxlag.__all__)
    if isinstance(public, type) and issubclass(public, BaseEstimator)
]


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_html_links_to_the_page_of_the_estimator(estimator):
    assert "\nhtml_baseurl = SITE\n" in (DOCS / "conf.py").read_text("utf-8")
    # autosummary writes a page for each name into this folder; the build checks that it
    # did.
    page = f"api/generated/skarxlag.{estimator.__name__}.html"
    required = {
        "DiagnosisPipeline": {"steps": []},
        "SensorFusion": {"estimator": BaseEstimator()},
    }
    html = estimator_html_repr(estimator(**required.get(estimator.__name__, {})))
    assert f'href="https://skarxlag.github.io/skarxlag/{page}"' in html
