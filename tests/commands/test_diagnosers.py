import threading

import numpy as np
from sklearn.pipeline import make_pipeline

from skarxlag import (
    ARXLaguerre,
    PIObserver,
    ThresholdLadder,
    make_alpio,
    make_diagnoser,
    window_verdicts,
)
from skarxlag.commands.models import set_threads


def test_threads_are_set_in_the_pipeline_and_in_its_steps():
    diagnoser = make_alpio(n_jobs=3)
    set_threads(diagnoser, 2)
    assert diagnoser.n_jobs == diagnoser["identify"].n_jobs == diagnoser["observe"].n_jobs == 2
    plain = make_pipeline(ARXLaguerre(), PIObserver(), ThresholdLadder())
    set_threads(plain, 2)
    assert plain[0].n_jobs == plain[1].n_jobs == 2


def test_threads_are_set_in_what_a_step_has_fitted():
    X = np.random.default_rng(0).normal(size=(8, 2000))
    diagnoser = make_diagnoser(sampling_rate=1000, n_jobs=3).fit(X, np.repeat(["a", "b"], 4))
    compare = diagnoser["compare"]
    parts = [
        compare.order_residual_,
        compare.window_residual_,
        compare.window_residual_["measure"],
        compare.order_residual,
    ]
    assert [part.n_jobs for part in parts] == [3, 3, 3, 3]
    for n_jobs in (2, None):
        set_threads(diagnoser, n_jobs)
        assert [part.n_jobs for part in parts] == [n_jobs] * 4


def test_threads_do_the_work_of_verdicts(monkeypatch):
    X = np.random.default_rng(0).normal(size=(2400, 300))
    diagnoser = make_diagnoser().fit(X[:20], np.repeat(["a", "b"], 10))
    original, seen, meeting = ARXLaguerre.transform, [], threading.Barrier(2)

    def transform(self, X):
        seen.append(threading.current_thread())
        if n_jobs == 2 and len(seen) <= 2:
            # Nobody gets on before two threads are here.
            meeting.wait(20)
        return original(self, X)

    monkeypatch.setattr(ARXLaguerre, "transform", transform)
    for n_jobs in (1, 2):
        seen.clear()
        set_threads(diagnoser, n_jobs)
        window_verdicts(diagnoser, X)
        assert len(seen) > 2
        assert len(set(seen)) == n_jobs
