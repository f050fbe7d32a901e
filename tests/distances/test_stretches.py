import copy

import numpy as np
import pytest
import sklearn
from numpy.testing import assert_allclose, assert_array_equal
from scipy.signal import lfilter
from sklearn.base import clone

from skarxlag import (
    OrderResidual,
    StretchResidual,
    make_diagnoser,
)
from skarxlag.core.capabilities import capabilities
from skarxlag.core.state import check_model_state
from skarxlag.decisions.comb_limits import OF_NOISE
from skarxlag.decisions.comb_probabilities import comb_evidence
from skarxlag.decisions.order_comparison import order_comparison
from skarxlag.distances.stretches import window_comparison

from ..impacts import ORDERS, RATE, stretches


@pytest.fixture(scope="module")
def data():
    return stretches(900)


@pytest.fixture(scope="module")
def diagnoser(data):
    return make_diagnoser(sampling_rate=RATE).fit(*data, rpm=900)


@pytest.mark.parametrize("enabled", [False, True])
def test_diagnoser_at_another_speed(diagnoser, enabled):
    X, y = stretches(600, seed=1)
    with sklearn.config_context(enable_metadata_routing=enabled):
        assert_array_equal(diagnoser.predict(X, rpm=np.full(8, 600)), y)
        assert_array_equal(diagnoser.predict(1e3 * X + 5, rpm=600), y)
        assert diagnoser.score(X, y, rpm=600) == 1
        found = diagnoser.diagnose(X, rpm=600)
    assert_array_equal(found.verdict, y)
    assert_array_equal(found.probability, diagnoser.predict_proba(X, rpm=600))
    assert found.probability.max(axis=1).min() > 0.5


@pytest.mark.slow
def test_residual_is_the_product_of_its_parts(data):
    X, y = data
    X = X[:, np.newaxis]
    residual = StretchResidual(
        order_residual=OrderResidual(sampling_rate=RATE),
        window_length=3000,
        order_weight=0.7,
    ).fit(X, y, rpm=900)
    unknown = clone(residual).set_params(order_residual=None).fit(X, y)
    windows = X[..., :6000].reshape(-1, 1, 3000)
    for fitted, rpm, at in ((residual, 900, 1000), (unknown, None, None)):
        comparison = window_comparison().fit(windows, np.repeat(y, 2), rpm=rpm)
        by_hand = comparison.transform(windows, rpm=at)
        orders = OrderResidual(sampling_rate=RATE).fit(X, y, rpm=rpm)
        expected = np.sqrt(by_hand[::2] * by_hand[1::2])
        expected *= orders.transform(X, rpm=at) ** 0.7
        assert_allclose(fitted.transform(X, rpm=at), expected)
    fresh = clone(residual)
    assert_array_equal(fresh.fit_transform(X, y, rpm=900), residual.transform(X, 900))
    whole = (
        clone(residual)
        .set_params(window_length=10**6, order_weight=0.0)
        .fit(X, y, rpm=900)
    )
    of_whole = window_comparison().fit(X, y, rpm=900).transform(X, rpm=900)
    assert_allclose(whole.transform(X, rpm=900), of_whole)
    # Stretches of another length, where there is an axis of models.
    assert residual.transform(X[..., :5000], rpm=900).shape == (8, 2)
    with pytest.raises(ValueError, match="window_length"):
        StretchResidual(window_length=0).fit(X, y)
    with pytest.raises(ValueError, match="order_weight"):
        StretchResidual(order_weight=-1.0).fit(X, y)


def test_rows_of_less_than_three_turns_are_compared_by_their_windows_alone(data):
    X, y = data[0][:, np.newaxis, :7000], data[1]
    residual = StretchResidual(order_residual=OrderResidual(sampling_rate=RATE))
    fitted = clone(residual).fit(X, y, rpm=800)
    windows = fitted.window_residual_
    slow = 2.8 * 60 * RATE / X.shape[-1]
    alone, mixed = (
        fitted.transform(X, rpm=slow),
        fitted.transform(X, rpm=[slow] * 4 + [800.0] * 4),
    )
    first = X[..., : fitted.window_length]
    assert_allclose(alone, windows.transform(first, rpm=slow))
    assert_allclose(mixed[:4], alone[:4])
    assert_allclose(mixed[4:], fitted.transform(X[4:], rpm=800))
    # Fitted on such rows, also where their speed is not known.
    assert clone(residual).fit(X, y, rpm=slow).order_residual_ is None
    short = X[..., : int(0.28 * RATE)]
    without = clone(residual).fit(short, y)
    assert without.order_residual_ is None
    assert without.transform(short).shape == (8, 2)


def test_adapt_moves_the_residual_of_windows_only(diagnoser):
    adapted, other = copy.deepcopy(diagnoser), diagnoser["decide"].residual_
    X, y = stretches(600, seed=1)
    healthy = y == "inner"
    adapted.adapt(0.3 * X[healthy] ** 3, y[healthy])
    moved = adapted["decide"].residual_
    before, after = (
        each.window_residual_["compare"].references_ for each in (other, moved)
    )
    assert not np.allclose(np.concatenate(before), np.concatenate(after))
    orders = moved.order_residual_.references_
    assert_array_equal(orders, other.order_residual_.references_)
    with pytest.raises(ValueError, match="expected conditions of fit"):
        adapted.adapt(X, np.full(8, "ball"))


def test_state_of_the_parts_is_checked(diagnoser):
    broken = copy.deepcopy(diagnoser)
    broken["decide"].residual_.order_residual_.classes_ = np.array(["a", "b"])
    with pytest.raises(ValueError, match=r"order_residual_ == .*expected a fitted est"):
        check_model_state(broken)
    check_model_state(diagnoser)


@pytest.mark.parametrize("rpm", [0.0, -600.0, np.nan, 10.0, 1e9])
@pytest.mark.parametrize("length", [200, 4000])
def test_rows_at_an_implausible_speed_name_no_condition(rpm, length):
    noise = np.random.default_rng(0).normal(size=(24, length))
    noise[12:] = noise[12:].cumsum(axis=1)
    y = np.repeat(["good", "worn"], 12)
    diagnoser = make_diagnoser(sampling_rate=10_000).fit(
        noise, y, rpm=np.tile([600.0, 900.0], 12)
    )
    assert capabilities(diagnoser).speeds == pytest.approx((600.0, 900.0))
    with pytest.warns(
        UserWarning, match="1 of 3 rows are treated as rows without a"
    ) as caught:
        found = diagnoser.predict_proba(noise[:3], rpm=[600.0, rpm, 900.0])
    assert len(caught) == 1
    assert_allclose(found[1], [0.5, 0.5])
    expected = diagnoser.predict_proba(noise[[0, 2]], rpm=[600.0, 900.0])
    assert_array_equal(found[[0, 2]], expected)


BEARING = {"outer": ORDERS["outer"], "inner": ORDERS["inner"]}


def remounted(X):
    """Rows of another mounting: other resonances, and more noise."""
    noise = np.random.default_rng(8).normal(size=X.shape)
    return lfilter([1], [1, -0.9], X) + 8 * noise


@pytest.fixture(scope="module")
def with_bearing(data):
    return make_diagnoser(sampling_rate=RATE, bearing=BEARING).fit(*data, rpm=900)


def test_combs_name_the_place_after_another_mounting(diagnoser, with_bearing):
    X, y = stretches(1100, seed=3)
    moved = remounted(X)
    found = {
        model: model.predict_proba(moved, rpm=1100)
        for model in (diagnoser, with_bearing)
    }
    right = {
        model: np.mean(model.classes_[p.argmax(axis=1)] == y)
        for model, p in found.items()
    }
    assert right[with_bearing] == 1 > right[diagnoser]
    assert with_bearing.score(X, y, rpm=1100) == 1


def test_combs_join_the_spectra(diagnoser, with_bearing, data):
    X = np.concatenate([data[0], remounted(data[0])])
    spectra = diagnoser.diagnose(X, rpm=900)
    by_spectra, nearest = np.exp(spectra.log_probability), spectra.levels.min(axis=1)
    assert nearest[:8].max() < 1 < nearest[8:].min()
    scores = with_bearing["decide"].match(diagnoser[0].transform(X), rpm=900).scores
    # An unknown condition counts as one without a comb.
    by_place = np.exp(comb_evidence(scores - OF_NOISE, np.array([1, 2, 3])))
    assert by_place[np.arange(4), 0].min() > 0.9 and by_place[4:8, 1].min() > 0.9
    joint = by_place * by_spectra
    joint /= joint.sum(axis=1, keepdims=True)
    found = with_bearing.diagnose(X, rpm=900)
    assert_allclose(np.exp(found.log_probability), joint, rtol=1e-6)
    assert_allclose(found.probability, joint[:, :2] + joint[:, 2:] / 2, rtol=1e-6)
    assert_array_equal(found.recorded, spectra.recorded)
    assert_allclose(found.comb, by_place[:, :2].max(axis=1))


def test_orders_are_compared_beside_a_bearing(with_bearing):
    learned = with_bearing["decide"].conditions_
    assert order_comparison(with_bearing)[1] is learned.residual_.order_residual_
