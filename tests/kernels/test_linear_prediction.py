import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import lfilter

from skarxlag.kernels import linear_prediction

from .literal import literal_predictor


def ar2(n_signals, n_samples, seed=0):
    noise = np.random.default_rng(seed).normal(size=(n_signals, n_samples + 500))
    return lfilter([1], [1, -1.2, 0.8], noise, axis=1)[:, 500:]


@pytest.mark.parametrize("order", [1, 2, 7, 15, 16, 64, 128])
@pytest.mark.parametrize("n_samples", [513, 1200, 1201, 1202, 1203])
def test_predictors_are_those_of_the_literal_normal_equations(order, n_samples):
    for samples in (
        ar2(1, n_samples)[0],
        np.random.default_rng(1).normal(size=n_samples),
    ):
        literal = literal_predictor(samples, order, 1e-9)
        predictors = linear_prediction.predictors(samples[np.newaxis], order, 1e-9)[0]
        assert_allclose(predictors, literal, rtol=0, atol=1e-12 * np.abs(literal).max())


@pytest.mark.parametrize("alpha", [1e-6, 0.1, 10.0])
def test_the_ridge_is_a_share_of_the_power(alpha):
    samples = ar2(1, 400)[0]
    for scale in (1e-3, 1e3):
        assert_allclose(
            linear_prediction.predictors(scale * samples[np.newaxis], 20, alpha)[0],
            literal_predictor(samples, 20, alpha),
            rtol=1e-9,
        )


def test_as_few_samples_as_there_can_be():
    samples = np.array([[1.0, 2.0, 4.0, 8.0]])
    assert_allclose(linear_prediction.predictors(samples, 1, 1e-12), [[2.0]])
    assert np.isfinite(linear_prediction.predictors(samples, 3, 1e-9)).all()


K = np.arange(1200.0)
DEGENERATE = {
    "constant": np.ones(1200),
    "spike": K == 600,
    "first sample": K == 0,
    "last sample": K == 1199,
    "constant and spike": 1 + 4.0 * (K == 600),
    "sine": np.sin(0.3 * K),
    "slow sine": np.sin(0.001 * K),
    "alternating": (-1) ** K,
    "sines": np.sin(np.outer(0.1 + 0.2 * np.arange(12), K)).sum(axis=0),
    "ramp": K / 1200,
    "parabola": (K / 600 - 1) ** 2,
    "square wave": np.sign(np.sin(0.1 * K)),
    "decay": np.exp(-0.2 * K),
    "growth": np.exp(0.2 * (K - 1199)),
    "zeros at the end": np.where(K < 300, np.sin(K**2), 0.0),
    "zeros in front": np.where(K < 900, 0.0, np.sin(K**2)),
    "oversampled": lfilter([1], np.poly([0.97] * 5), np.sin(K**2)) * 1e-6,
}


@pytest.mark.parametrize("name", DEGENERATE)
def test_predictors_of_singular_signals_predict_as_well_as_the_literal_ones(name):
    samples = DEGENERATE[name] / np.sqrt(np.mean(np.square(DEGENERATE[name])))
    predictor = linear_prediction.predictors(samples[np.newaxis], 128, 1e-9)[0]

    def loss(g):
        lagged = np.lib.stride_tricks.sliding_window_view(samples, 129)
        error = lagged[:, -1] - lagged[:, -2::-1] @ g
        # The ridge of the literal solution: a share of the mean of the 129 sums of
        # squares.
        return error @ error + 1e-9 * np.mean(np.sum(lagged**2, axis=0)) * g @ g

    assert np.isfinite(predictor).all()
    assert (
        loss(predictor)
        <= loss(literal_predictor(samples, 128, 1e-9)) * 1.001 + 1e-13 * 1200
    )


def test_a_signal_of_zeros_predicts_nothing_and_changes_no_other():
    signals = ar2(3, 300)
    with_zeros = np.insert(signals, 1, 0.0, axis=0)
    predictors = linear_prediction.predictors(with_zeros, 30, 1e-9)
    assert np.all(predictors[1] == 0)
    assert_array_equal(
        np.delete(predictors, 1, axis=0),
        linear_prediction.predictors(signals, 30, 1e-9),
    )
