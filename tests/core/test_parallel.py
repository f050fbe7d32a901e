import threading
import time
from warnings import catch_warnings

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.signal import lfilter
from sklearn import config_context, get_config
from sklearn.base import clone
from threadpoolctl import threadpool_info, threadpool_limits

from skarxlag import KnownConditions, SpectralDistance, make_alpio
from skarxlag.core.parallel import map_batches, one_thread


@pytest.mark.parametrize("n_jobs", [None, 1, 2, 3, -1])
def test_batches_come_in_order_and_do_not_depend_on_the_threads(n_jobs):
    found = map_batches(lambda batch: (batch.start, batch.stop), 25, n_jobs, 10)
    assert found == [(0, 10), (10, 20), (20, 25)]


def test_batches_run_beside_each_other_and_batches_inside_do_not():
    meeting = threading.Barrier(2, timeout=20)

    def outer(batch):
        meeting.wait()
        return {
            threading.get_ident(),
            *map_batches(lambda _: threading.get_ident(), 9, 2, 3),
        }

    inside = map_batches(outer, 2, 2, 1)
    assert all(len(threads) == 1 for threads in inside)
    assert inside[0] != inside[1]


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_settings_of_scikit_learn_hold_in_every_thread(n_jobs):
    with config_context(transform_output="pandas"):
        found = map_batches(lambda _: get_config()["transform_output"], 20, n_jobs, 5)
    assert found == ["pandas"] * 4


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_linear_algebra_runs_on_one_thread(n_jobs):
    def threads(_):
        return {i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas"}

    assert all(found <= {1} for found in map_batches(threads, 20, n_jobs, 5))


@pytest.mark.parametrize(("n_jobs", "error"), [("two", TypeError), (0, ValueError)])
def test_n_jobs_is_checked_for_one_batch_as_well(n_jobs, error):
    with pytest.raises(error, match="n_jobs"):
        map_batches(lambda batch: batch.stop, 1, n_jobs)
    diagnoser = make_alpio().fit(
        np.random.default_rng(0).normal(size=(8, 200)), list("ab" * 4)
    )
    with pytest.raises(error, match="n_jobs"):
        diagnoser.set_params(n_jobs=n_jobs).predict(np.ones((2, 200)))


def test_an_error_in_a_batch_reaches_the_caller():
    with pytest.raises(ZeroDivisionError):
        map_batches(lambda batch: 1 / (batch.start - 10), 20, 2, 5)


def blas_threads():
    return [i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas"]


def test_overlapping_callers_leave_the_threads_of_linear_algebra_as_they_were():
    entered, left, done = threading.Event(), threading.Event(), threading.Event()

    def first(_):
        entered.set()
        assert left.wait(20)

    def live_on():
        map_batches(first, 1, 1, 1)
        # The thread that has set the number is alive when another one restores it.
        assert done.wait(20)

    def second(_):
        left.set()
        while one_thread._n_inside > 1:
            time.sleep(0.001)
        return blas_threads()

    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        caller = threading.Thread(target=live_on)
        caller.start()
        assert entered.wait(20)
        assert set(map_batches(second, 1, 1, 1)[0]) == {1}
        assert blas_threads() == before
        done.set()
        caller.join()


def test_threads_are_left_as_they_were_after_an_error():
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        with pytest.raises(ZeroDivisionError):
            map_batches(lambda _: 1 / 0, 3, 1, 1)
        assert blas_threads() == before


@pytest.mark.parametrize("step", [SpectralDistance(), KnownConditions()], ids=repr)
def test_fits_do_not_depend_on_the_threads_of_linear_algebra(step):
    X = np.random.default_rng(0).normal(size=(360, 4800))
    y = np.repeat(["a", "b", "c"], 120)
    X[y == "b"] = lfilter([1], [1, -0.8], X[y == "b"])
    params = {"rpm": np.tile([600.0, 900.0], 180)}
    if isinstance(step, SpectralDistance):
        params = {}
        X = X[:, :1200].reshape(360, 4, 300)  # any numbers may be log spectra
    found = []
    for n_threads in (1, 2):
        with (
            threadpool_limits(n_threads, user_api="blas"),
            catch_warnings(action="ignore"),
        ):
            fitted = clone(step).fit(X, y, **params)
            values = getattr(fitted, "transform", getattr(fitted, "p_values", None))
            found.append(values(X, **params))
    assert_array_equal(found[0], found[1])
