"""Several sensors on one machine: compared with one model for each sensor, fitted by hand."""

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import log_softmax, softmax
from sklearn.base import clone

from skarxlag import (
    SensorFusion,
    load_diagnoser,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_known_conditions,
    recording_verdicts,
    save_diagnoser,
    window_verdicts,
)
from skarxlag.core.capabilities import capabilities
from skarxlag.verdicts.judge import Judge

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
Y = np.repeat(["good", "worn"], 30)
RPM = np.tile([900.0, 1200.0], 30)


def rows(n_channels, seed=0):
    """Two conditions with different spectra; each sensor has its own resonance and noise."""
    X = np.random.default_rng(seed).normal(size=(60, n_channels, 1200))
    for s in range(n_channels):
        X[:30, s] = lfilter([1], [1, -0.3 - 0.1 * s], X[:30, s])
        X[30:, s] = lfilter([1], [1, -0.4 - 0.1 * s], X[30:, s])
    return X


@pytest.fixture(scope="module")
def fused():
    X = rows(2)
    return X, SensorFusion(estimator=make_diagnoser(healthy="good")).fit(X, Y, rpm=RPM)


def of_each_sensor(make, X, y, **params):
    return [make().fit(X[:, s], y, **params) for s in range(X.shape[1])]


def test_probabilities_are_geometric_means_of_those_of_each_sensor(fused):
    X, fusion = fused
    new = rows(2, seed=1)
    alone = of_each_sensor(lambda: make_diagnoser(healthy="good"), X, Y, rpm=RPM)
    found_alone = [model.diagnose(new[:, s], rpm=1000) for s, model in enumerate(alone)]
    logs = [np.clip(np.exp(found.log_probability), 1e-6, 1) for found in found_alone]
    product = np.sqrt(np.prod(logs, axis=0))
    product /= product.sum(axis=1, keepdims=True)
    found = fusion.diagnose(new, rpm=1000)
    np.testing.assert_allclose(np.exp(found.log_probability), product)
    np.testing.assert_allclose(found.probability, product[:, :2] + product[:, 2:] / 2)
    recorded = np.mean([alone.recorded for alone in found_alone], axis=0)
    np.testing.assert_allclose(found.recorded, recorded)
    verdicts = np.transpose([found.verdict for found in found_alone])
    np.testing.assert_array_equal(found.verdict_of_outputs, verdicts)
    assert (verdicts[:, 0] != verdicts[:, 1]).any()
    hits = fusion.predict(new, rpm=1000) == Y
    assert fusion.score(new, Y, rpm=1000) == hits.mean() < 1


def test_probabilities_of_classifiers_that_state_no_unknown_condition():
    X = rows(2)
    fusion = SensorFusion(estimator=make_alpio()).fit(X, Y)
    alone = of_each_sensor(make_alpio, X, Y)
    logs = [model.predict_log_proba(X[:, s]) for s, model in enumerate(alone)]
    expected = softmax(np.mean(logs, axis=0), axis=1)
    found = fusion.diagnose(X)
    np.testing.assert_allclose(found.probability, expected)
    verdicts = fusion.classes_[expected.argmax(axis=1)]
    np.testing.assert_array_equal(found.verdict, verdicts)


def test_rows_of_several_sensors_are_joined_sensor_by_sensor(fused):
    X, fusion = fused
    found = fusion.diagnose(X[:4], rpm=1000)
    one = fusion.join(found.row_evidence[:1])
    np.testing.assert_allclose(one.log_probability[0], found.log_probability[0])
    joined = fusion.join(found.row_evidence.mean(axis=0, keepdims=True), 4)
    logs = []
    for s, model in enumerate(fusion.estimators_):
        evidence = model.diagnose(X[:4, s], rpm=1000).row_evidence.mean(axis=0)
        logs.append(model["decide"].join(evidence[np.newaxis], 4).log_probability[0])
    mean = np.maximum(logs, np.log(1e-6)).mean(axis=0)
    np.testing.assert_allclose(joined.log_probability[0], log_softmax(mean))


def test_no_sensor_can_exclude_a_condition_alone(fused):
    X, fusion = fused
    X = X.copy()
    X[:, 1] = lfilter([1], [1, 0.9], X[:, 1])
    probability = fusion.predict_proba(X, rpm=1000)
    assert probability.min() >= 1e-3 / (1 + 1e-3) * (1 - 1e-9)


def test_an_alarm_of_one_sensor_is_an_alarm_and_the_rate_is_divided(fused):
    X, fusion = fused
    rates = [model["decide"].false_alarm_rate for model in fusion.estimators_]
    assert rates == [0.005, 0.005]
    described = capabilities(fusion)
    assert (described.stated_rate, described.n_outputs) == (0.01, 2)
    X = X[:1].copy()
    assert not fusion.diagnose(X, rpm=900).alarm[0]
    X[:, 1] = X[:, 1].cumsum(axis=1)
    assert fusion.diagnose(X, rpm=900).alarm[0]


def test_p_values_are_twice_the_smaller_one_by_bonferroni():
    X, new = rows(2)[:30], rows(2, seed=1)
    plain = make_detector(fixed_gain=True)
    alone = of_each_sensor(lambda: clone(plain), X, None, rpm=RPM[:30])
    detector = SensorFusion(estimator=plain).fit(X, rpm=RPM[:30])
    new *= np.linspace(1, 30, 60)[:, np.newaxis, np.newaxis]
    each = [model.p_values(new[:, s], rpm=1000) for s, model in enumerate(alone)]
    expected = np.minimum(1, 2 * np.minimum(*each))
    np.testing.assert_allclose(detector.p_values(new, rpm=1000), expected)
    scores = detector.decision_function(new, rpm=1000)
    np.testing.assert_allclose(np.exp(scores), expected / 0.01)
    is_outlier = expected < 0.01
    assert 0 < is_outlier.sum() < 60
    np.testing.assert_array_equal(detector.predict(new, rpm=1000) == -1, is_outlier)


def test_a_condition_is_known_if_both_sensors_resemble_it():
    X, new = rows(2), rows(2, seed=1)
    known = SensorFusion(estimator=make_known_conditions()).fit(X, Y, rpm=RPM)
    nearest = known.p_values(new, rpm=900).max(axis=1)
    scores = known.decision_function(new, rpm=900)
    np.testing.assert_allclose(np.exp(scores), nearest / 0.01)
    assert capabilities(known).none_of_these and capabilities(known).stated_rate == 0.01


def test_inputs_belong_to_every_output():
    X = rows(3)
    fusion = SensorFusion(estimator=make_diagnoser(), n_outputs=2).fit(X, Y)
    each = []
    for s in (0, 1):
        own = X[:, [s, 2]]
        each.append(make_diagnoser().fit(own, Y).predict_log_proba(own))
    np.testing.assert_array_equal(
        fusion.predict(X), fusion.classes_[np.mean(each, 0).argmax(1)]
    )
    assert len(SensorFusion(estimator=make_diagnoser()).fit(X, Y).estimators_) == 3


@pytest.mark.parametrize(
    ("n_outputs", "message"),
    [(3, "n_outputs == 3, expected at most 2"), (0, "n_outputs == 0, must be >= 1")],
)
def test_numbers_of_outputs_that_cannot_be(n_outputs, message):
    with pytest.raises(ValueError, match=message):
        SensorFusion(estimator=make_diagnoser(), n_outputs=n_outputs).fit(rows(2), Y)


def test_a_dead_sensor_is_no_signal_and_a_constant_input_is_one():
    X = rows(3)
    X[:, 2] = 7.0
    fusion = SensorFusion(estimator=make_diagnoser(healthy="good"), n_outputs=2)
    fusion.fit(X, Y, rpm=RPM)
    X[5, 1] = 0.25
    table = window_verdicts(fusion, X, rpm=RPM)
    assert table["quality"][5] == "constant in output 2"
    assert (table["quality"].drop(5) == "good").all()
    assert table["quality share"].tolist() == [0.0] * 5 + [1.0] + [0.0] * 54
    assert table["verdict"][5] == "no signal" and table["verdict of output 2"].isna()[5]


def test_a_recording_has_the_verdict_of_each_output(fused):
    X, fusion = fused
    X = X.copy()
    X[:30, 1] = X[30:, 1]
    limits = SensorFusion(estimator=make_detector()).fit(X[:30], rpm=RPM[:30])
    found = recording_verdicts(
        fusion, X, np.repeat(["a", "b"], 30), rpm=RPM, detector=limits
    )
    assert found["verdict of output 1"].tolist() == ["good", "worn"]
    assert found["verdict of output 2"].tolist() == ["worn", "worn"]
    assert found["p-value"].notna().all()
    # A detector of one output, of which the second channel is an input.
    plain = make_detector().fit(X[:30], rpm=RPM[:30])
    assert Judge(fusion, detector=plain).outputs == ["output 1", "output 2"]


def test_saved_and_loaded(fused, tmp_path):
    X, fusion = fused
    detector = SensorFusion(estimator=make_detector()).fit(X[:30], rpm=RPM[:30])
    save_diagnoser(fusion, tmp_path / "two.skops", detector=detector, n_channels=2)
    loaded, facts = load_diagnoser(tmp_path / "two.skops")
    expected = fusion.predict_proba(X, rpm=RPM)
    np.testing.assert_array_equal(loaded.predict_proba(X, rpm=RPM), expected)
    found = facts["detector"].p_values(X, rpm=RPM)
    np.testing.assert_array_equal(found, detector.p_values(X, rpm=RPM))


FITTED = "expected a fitted estimator for each output"


def of_other_conditions():
    return make_diagnoser().fit(rows(2)[:, 0], np.repeat(["a", "b"], 30))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda models: models[:0], FITTED),
        (lambda models: models + models, FITTED),
        (lambda models: [models[0], make_diagnoser()], FITTED),
        (lambda models: [models[0], of_other_conditions()], "by window_shape_"),
    ],
)
def test_a_state_that_fit_cannot_have_set_is_refused(fused, tmp_path, change, message):
    X, _ = fused
    fusion = SensorFusion(estimator=make_diagnoser()).fit(X, Y)
    fusion.estimators_ = change(fusion.estimators_)
    with pytest.raises(ValueError, match=message):
        save_diagnoser(fusion, tmp_path / "wrong.skops")
