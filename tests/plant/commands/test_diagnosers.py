import threading

import numpy as np
from joblib import parallel_config

from skarxlag import ARXLaguerre, make_diagnoser, window_verdicts


def test_threads_do_the_work_of_verdicts(monkeypatch):
    X = np.random.default_rng(0).normal(size=(4000, 300))
    diagnoser = make_diagnoser().fit(X[:20], np.repeat(["good", "worn"], 10))
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
        with parallel_config("threading", n_jobs=n_jobs):
            window_verdicts(diagnoser, X)
        assert len(seen) > 2
        assert len(set(seen)) == n_jobs
