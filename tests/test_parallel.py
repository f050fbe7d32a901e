import threading

import pytest
from sklearn import config_context, get_config
from threadpoolctl import threadpool_info

from skarxlag._parallel import map_batches


@pytest.mark.parametrize("n_jobs", [None, 1, 2, 3, -1])
def test_batches_come_in_order_and_do_not_depend_on_the_threads(n_jobs):
    found = map_batches(lambda batch: (batch.start, batch.stop), 25, n_jobs, 10)
    assert found == [(0, 10), (10, 20), (20, 25)]


def test_batches_run_beside_each_other_and_batches_inside_do_not():
    meeting = threading.Barrier(2, timeout=20)

    def outer(batch):
        meeting.wait()
        return {threading.get_ident(), *map_batches(lambda _: threading.get_ident(), 9, 2, 3)}

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


def test_an_error_in_a_batch_reaches_the_caller():
    with pytest.raises(ZeroDivisionError):
        map_batches(lambda batch: 1 / (batch.start - 10), 20, 2, 5)
