"""Output of a step that is computed batch by batch."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skarxlag import ARXLaguerre, SpectralDistance, make_diagnoser
from skarxlag.core import batches
from skarxlag.core.batches import RowsInBatches, batches_of, chosen_rows
from skarxlag.core.pipelines import DiagnosisPipeline
from skarxlag.measures.spectra import LogSpectra

X = np.random.default_rng(0).normal(size=(50, 100)).astype(np.float32)


@pytest.fixture(autouse=True)
def _small_batches(monkeypatch):
    monkeypatch.setattr(batches, "BATCH_BYTES", 8 * 100 * 20)


def test_rows_are_those_of_the_whole_transform_in_batches_of_the_larger_row():
    lengths = []

    def halved(rows):
        lengths.append(len(rows))
        return rows[:, ::2]

    rows = RowsInBatches(X, halved)
    assert (len(rows), rows.shape, rows.ndim, rows.dtype) == (50, (50, 50), 2, X.dtype)
    assert_array_equal(rows, X[:, ::2])
    assert max(lengths) == 20 and sum(lengths) == 51
    assert_array_equal(rows[[4, 1]], X[[4, 1], ::2])
    assert_array_equal(chosen_rows(rows, np.array([4, 1])), X[[4, 1], ::2])
    nested = RowsInBatches(rows, lambda part: part[:, :1])
    assert [batch.stop for batch in batches_of(nested)][:2] == [20, 40]
    assert np.asarray(nested, dtype=np.float64).dtype == np.float64


def test_a_row_larger_than_a_batch_is_a_batch():
    assert [*batches_of(np.broadcast_to(0.0, (2, 2**23)))] == [slice(0, 1), slice(1, 2)]


@pytest.mark.parametrize("weights", [None, np.arange(50) % 3])
def test_a_fit_in_batches_is_that_of_all_rows(weights):
    y = np.repeat(["a", "b"], 25)
    steps = [("measure", LogSpectra()), ("compare", SpectralDistance())]
    in_batches = DiagnosisPipeline(steps).fit(X, y, sample_weight=weights)["compare"]
    spectra = LogSpectra().fit_transform(X)
    at_once = SpectralDistance().fit(spectra, y, sample_weight=weights)
    for name, value in vars(at_once).items():
        assert_array_equal(getattr(in_batches, name), value)


def test_bad_conditions_are_refused_before_a_batch_is_computed():
    pipe = DiagnosisPipeline(
        [("i", ARXLaguerre(bank=False)), ("d", make_diagnoser()[1])]
    )
    with pytest.raises(ValueError, match="inconsistent numbers of samples"):
        pipe.fit(X, np.zeros(3, dtype=int))
    with pytest.raises(ValueError, match="Unknown label type"):
        pipe.fit(X, np.linspace(0, 1, 50))
