import copy

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.special import log_softmax
from scipy.stats import gumbel_r
from sklearn.base import clone

from skarxlag import (
    ARXLaguerre,
    BearingGeometry,
    ConditionClassifier,
    DiagnosisPipeline,
    bearing_orders,
    load_diagnoser,
    make_diagnoser,
    save_diagnoser,
)
from skarxlag.core.capabilities import capabilities
from skarxlag.core.fault_locations import NO_FINDING, NOT_IDENTIFIABLE
from skarxlag.decisions.comb_limits import (
    compare_combs,
    limit_elsewhere,
    p_values_of_healthy,
    without_healthy,
)
from skarxlag.decisions.comb_sentences import comb_sentences
from skarxlag.kernels.evidence import effective_number

from ..bearing_rows import ORDERS, RATE, classifier, row

NAMES = ["healthy", "outer", "inner"]
GEOMETRY = BearingGeometry(9, 7.94, 39.04)


@pytest.fixture(scope="module")
def rows():
    return np.stack([row("healthy"), row("outer"), row("inner", seed=1)])


@pytest.fixture(scope="module")
def healthy():
    return np.stack([row("healthy", seed=seed) for seed in range(40)])


@pytest.fixture(scope="module")
def fitted(rows):
    return classifier().fit(rows[:1])


def test_locations_without_any_recording_of_a_fault(fitted, rows):
    assert fitted.classes_.tolist() == ["ball", "healthy", "inner", "outer"]
    found = fitted.diagnose(rows, rpm=900)
    assert found.verdict.tolist() == NAMES
    assert found.named.tolist() == [NO_FINDING, "outer", "inner"]
    assert found.alarm.tolist() == found.has_comb.tolist() == [False, True, True]
    np.testing.assert_allclose(found.probability.sum(axis=1), 1)
    assert fitted.classes_[found.probability.argmax(axis=1)].tolist() == NAMES
    # Each of three equally likely faults shows no comb with the probability .4.
    assert 0.4 < found.probability[0, 1] <= 1 / (1 + 3 * 0.4)
    assert found.probability[1:].max(axis=1).min() > 0.9
    assert found.p_value[0] > 0.02 > found.p_value[1:].max()


@pytest.mark.parametrize("has_healthy_rows", [False, True])
@pytest.mark.parametrize("rpm", [900.0, 1200.0])
def test_the_limit_is_the_score_with_the_stated_p_value(healthy, has_healthy_rows, rpm):
    y = ["healthy"] * 40 if has_healthy_rows else None
    fitted = classifier(false_alarm_rate=0.01).fit(healthy, y, rpm=900)
    limit = fitted.limit_
    if rpm != 900.0 or not has_healthy_rows:
        # Healthy rows state less about another speed.
        limit = limit_elsewhere(limit, 0.01)
        assert limit > fitted.limit_ or not has_healthy_rows
    score = limit + fitted.reference_[2]
    if not has_healthy_rows:
        # A second has fewer than 100 revolutions.
        score += 0.5 * np.log(rpm / 60 / 100)
    near = [[0.0, 0.0, score + step, 0.0, rpm, rpm / 60] for step in (-1e-9, 1e-9)]
    assert fitted.join(np.array(near)).alarm.tolist() == [False, True]
    best, is_far = np.array([limit, limit + 0.1]), np.full(2, rpm != 900.0)
    at_limit, above = p_values_of_healthy(best, fitted.healthy_scores_, is_far)
    assert at_limit == pytest.approx(0.01, rel=1e-6) and above < 0.01


def test_without_healthy_rows_the_limit_is_that_of_other_machines(rows):
    limit = classifier(false_alarm_rate=0.05).fit(rows).limit_
    assert limit == pytest.approx(gumbel_r.isf(0.05, 1.65, 0.28))
    assert limit_elsewhere(0.0, 0.05) == pytest.approx(gumbel_r.isf(0.05, 0.06, 0.28))


# Of 40 healthy rows, 1 or 2 are the largest share of 41 below the rate.
@pytest.mark.parametrize(("rate", "n_above"), [(1 / 41, 1), (0.03, 1), (0.06, 2)])
def test_the_limit_is_a_conformal_quantile_of_healthy_rows(healthy, rate, n_above):
    fitted = classifier(false_alarm_rate=rate)
    fitted.fit(healthy, ["healthy"] * 40, rpm=900)
    assert fitted.limit_ == fitted.healthy_scores_[-n_above]


def test_the_true_speed_is_found_within_the_tolerance(fitted, rows):
    turn = 60 * RATE / 960
    signal = row("inner", rpm=960)
    signal[np.arange(0, RATE, turn).astype(int)] += 30
    found = fitted.match([signal], rpm=900)
    assert found.rpm[0] == pytest.approx(960, rel=0.006)
    assert found.speed_errors[0] == pytest.approx(960 / 900, rel=0.006)
    assert found.factors[0, 1] == pytest.approx(1, abs=0.01)
    diagnosed = fitted.diagnose([signal], rpm=900)
    assert diagnosed.verdict[0] == "inner"
    assert "the lines of the shaft show 9" in diagnosed.evidence[0]
    strict = classifier(speed_tolerance=0.03).fit(rows)
    assert strict.match([signal], rpm=900).rpm[0] < 900 * 1.031


def test_slip_limits_the_factor(rows):
    signal = [row("inner", rpm=913)]
    found = classifier(speed_tolerance=0).fit(rows).match(signal, rpm=900)
    assert found.factors[0, 1] == pytest.approx(913 / 900, abs=0.005)
    strict = classifier(speed_tolerance=0, slip=0.005).fit(rows)
    assert strict.match(signal, rpm=900).scores[0, 1] < found.scores[0, 1]


@pytest.mark.parametrize("ratio", [0.01, 2.0, 20.0])
def test_gear_ratio_multiplies_the_speed(fitted, rows, ratio):
    geared = classifier(gear_ratio=ratio).fit(rows)
    found = geared.match(rows, rpm=900 / ratio)
    expected = fitted.match(rows, rpm=900).contrasts
    np.testing.assert_allclose(found.contrasts, expected, atol=1e-9)
    np.testing.assert_allclose(found.rpm, 900 / ratio, rtol=0.02)
    assert geared.predict(rows, rpm=900 / ratio).tolist() == NAMES
    # One revolution and a half of the bearing's shaft is too short.
    assert np.isnan(geared.match(rows, rpm=90 / ratio).rpm).all()


def test_speed_is_searched_in_the_stated_range():
    signal = row("outer", rpm=948, amplitude=15, seconds=3)
    turns = 15.8 * np.arange(len(signal)) / RATE
    for harmonic in (1, 2, 3, 4):
        signal += np.sin(2 * np.pi * harmonic * turns)
    fitted = classifier(speed_range=(850.0, 1050.0)).fit(signal[np.newaxis])
    assert fitted.match([signal]).rpm[0] == pytest.approx(948, rel=0.01)
    assert fitted.predict([signal])[0] == "outer"
    message = "rpm is missing, expected the speed of each row, or a speed_range"
    with pytest.raises(ValueError, match=message):
        classifier().fit([signal]).predict([signal])


@pytest.mark.parametrize(
    ("labels", "stated", "locations"),
    [
        (["N", "OR7", "fault at the inner race"], None, [3, 2, 1]),
        ([0, 7, 3], {7: "outer", 0: "healthy", 3: "inner"}, [3, 2, 1]),
        # Names that state no location get the one that their rows show.
        ([5, 4, 9], {5: "healthy"}, [3, 2, 1]),
    ],
)
def test_labels_stand_for_fault_locations(rows, labels, stated, locations):
    X = np.concatenate([rows, rows])
    fitted = classifier(locations=stated).fit(X, labels * 2, rpm=900)
    assert fitted.predict(rows, rpm=900).tolist() == labels
    by_label = dict(zip(labels, locations, strict=True))
    expected = [by_label[label] for label in fitted.classes_.tolist()]
    assert fitted.class_locations_.tolist() == expected


def test_a_name_without_a_location_is_not_healthy(rows):
    X = np.concatenate([rows, rows])
    labels = ["KA15", "outer", "inner"] * 2
    learned = ConditionClassifier()
    with pytest.warns(UserWarning) as caught:
        classifier(conditions=learned).fit(X, labels, rpm=900)
    assert len(caught) == 1 and "['KA15'] state no fault" in str(caught[0].message)
    fitted = classifier(locations={"KA15": None}).fit(X, labels, rpm=900)
    assert fitted.class_locations_.tolist() == [4, 1, 2]
    assert fitted.healthy_scores_.size == 0
    assert fitted.diagnose(rows, rpm=900).named.tolist() == ["KA15", "outer", "inner"]


def test_healthy_rows_are_the_reference(rows, healthy):
    with_comb = np.stack([row("outer", amplitude=10, seed=seed) for seed in range(40)])
    plain = classifier().fit(healthy)
    assert plain.predict(with_comb, rpm=900).tolist().count("outer") > 30
    fitted = classifier().fit(with_comb[:20], ["good"] * 20, rpm=900)
    assert fitted.classes_.tolist() == ["ball", "good", "inner", "outer"]
    assert fitted.predict(with_comb[20:], rpm=900).tolist().count("good") >= 18
    assert fitted.predict(rows[2:], rpm=900)[0] == "inner"


@pytest.mark.parametrize(
    ("inner", "outer", "named"),
    [
        # The odds of the second are one ninth at a lead of ln(9) / 8 = .275 nepers.
        (4.0, 3.74, NOT_IDENTIFIABLE),
        (4.0, 3.71, "inner"),
        (0.6, 0.59, NO_FINDING),
    ],
)
def test_a_location_is_named_if_no_other_is_close(fitted, inner, outer, named):
    found = fitted.join(np.array([[0.0, inner, outer, 0.0, 900.0, 15.0]]))
    assert found.named.tolist() == [named]
    assert found.verdict.tolist() == ["healthy" if named == NO_FINDING else "inner"]


@pytest.mark.parametrize(
    ("labels", "named"),
    [
        (["good", "outer", "inner"], "good"),
        # No healthy row is known, and no row of a fault without a comb.
        (["outer", "outer", "inner"], NO_FINDING),
    ],
)
def test_healthy_is_named_if_healthy_rows_are_known(rows, labels, named):
    fitted = classifier().fit(np.concatenate([rows, rows]), labels * 2, rpm=900)
    found = fitted.diagnose(np.concatenate([rows, [row("healthy", seed=9)]]), rpm=900)
    assert found.named.tolist()[1:] == ["outer", "inner", named]


def test_a_longer_recording_never_lowers_the_probability_of_a_right_name(fitted):
    signal = row("outer", amplitude=6.0, seconds=4)[np.newaxis, np.newaxis]
    lengths = (RATE * np.array([0.5, 1, 2, 4])).astype(int)
    proba = [fitted.predict_proba(signal[..., :n], rpm=900) for n in lengths]
    outer = np.concatenate(proba)[:, 3]
    assert (np.diff(outer) >= 0).all() and outer[0] < 0.7 and outer[-1] > 0.99


@pytest.mark.parametrize("with_healthy", [False, True])
def test_rows_of_a_recording_join_by_their_scores(rows, healthy, with_healthy):
    fitted = classifier().fit(rows)
    if with_healthy:
        fitted.fit(healthy, ["healthy"] * 40, rpm=900)
    found = fitted.diagnose(rows, rpm=900)
    alone = fitted.join(found.row_evidence)
    np.testing.assert_allclose(alone.probability, found.probability)
    assert alone.named.tolist() == found.named.tolist()
    # At the speed of healthy rows, a mean of more rows is surer.
    faint = np.array([[0.0, 0.0, fitted.limit_ - 0.05, 0.0, 900.0, 100.0]])
    few, many = (fitted.join(faint, n).probability[0, 3] for n in (1, 10))
    assert many > few if with_healthy else many == few


@pytest.mark.parametrize(("other", "named"), [(3.2, 1.0), (4.2, 0.73)])
def test_stronger_impacts_at_no_order_of_the_bearing_are_a_doubt(rows, other, named):
    fitted = classifier().fit(rows)
    joined = fitted.join(np.array([[0.0, 0.0, 3.5, other, 900.0, 15.0]]))
    assert joined.named.tolist() == ["outer"]
    assert joined.probability.max() == pytest.approx(named, abs=0.02)


def test_several_bearings(rows):
    fitted = classifier(bearing=["6203", GEOMETRY]).fit(rows)
    assert fitted.orders_.shape == (2, 4)
    assert fitted.match(rows, rpm=900).bearings[1:].max(axis=1).tolist() == [1, 1]
    assert "bearing 2" in fitted.diagnose(rows, rpm=900).evidence[1]


def test_evidence_names_order_location_size_and_error(fitted, rows):
    none, outer, inner = fitted.diagnose(rows, rpm=900).evidence
    assert none.startswith("no comb exceeds its limit; the strongest is that of")
    assert outer.startswith("impacts at 3.5") and "(BPFO), the outer race of 6" in outer
    assert inner.startswith("impacts at 5.4") and "(BPFI), the inner race of 6" in inner
    assert inner.endswith("% from the nominal order")
    matches = fitted.match(rows[1:2], rpm=900)
    matches.scores = np.array([[0.0, 4.0, 4.0]])
    compared = compare_combs(matches, without_healthy(0.02), 1, 0.02)
    (close,) = comb_sentences(matches, compared, ["6205"], fitted.orders_)
    assert close.startswith("impacts of 17 dB fit the outer race of 6205 and the inner")
    assert close.endswith(" race nearly as well")


def test_evidence_states_impacts_at_no_order_of_the_bearing(rows):
    fitted = classifier(speed_tolerance=0.0).fit(rows)
    (evidence,) = fitted.diagnose([row("inner", 350, 30)], rpm=900).evidence
    assert evidence.startswith("impacts of ")
    assert "at 2.1" in evidence
    assert evidence.endswith("orders, which is no order of this bearing")


@pytest.mark.parametrize("bearing", ["6205", "6203", {"outer": 3.0, "inner": 5.0}])
@pytest.mark.parametrize("step", [1.0, 0.5])
def test_multiples_of_the_shaft_are_no_fault_of_the_bearing(bearing, step):
    turns = 15 * np.arange(4 * RATE) / RATE
    signal = np.random.default_rng(3).normal(size=len(turns))
    for multiple in step * np.arange(1, 5):
        signal += 3 * np.sin(2 * np.pi * multiple * turns + multiple**2)
    found = classifier(bearing=bearing).fit([signal]).diagnose([signal], rpm=900)
    assert found.named.tolist() == [NO_FINDING]
    assert "dB at multiples of the shaft: imbalance, misal" in found.evidence[0]


def test_little_that_looks_like_impacts_is_not_named():
    rng = np.random.default_rng(4)
    blows = rng.normal(size=(20, int(RATE)))
    blows[:, ::2000] += 10  # five blows
    noise = np.fft.rfft(rng.normal(size=(20, int(RATE))))
    pink = np.fft.irfft(noise / np.sqrt(np.maximum(np.arange(noise.shape[1]), 1)))
    for rows in (blows, pink):
        found = classifier().fit(rows).diagnose(rows, rpm=900)
        is_sure = found.probability.max(axis=1) >= 0.9
        assert not (found.has_comb & is_sure).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bearing": None}, "bearing must be a name, .* got None"),
        ({"sampling_rate": None}, "sampling_rate is missing, expected the sampling r"),
        ({"bearing": "6205x"}, "bearing '6205x' is not known"),
        ({"bearing": []}, "bearing == .., expected at least one bearing"),
        ({"false_alarm_rate": 0}, "false_alarm_rate"),
        ({"gear_ratio": -1}, "gear_ratio"),
        ({"speed_range": (900, 600)}, "speed_range.0. == 900, must be < 600"),
        ({"speed_range": (900, np.inf)}, "speed_range.1. == inf, must be finite"),
        ({"locations": {"a": "cage"}}, "locations.'a'. == 'cage'"),
    ],
)
def test_bad_parameters_are_named(options, message, rows):
    with pytest.raises((TypeError, ValueError), match=message):
        classifier(**options).fit(rows, rpm=900)


@pytest.mark.filterwarnings("ignore:1 of 2 rows:UserWarning")
@pytest.mark.parametrize("rpm", [119.0, 0.0, -900.0, np.nan, np.inf, 1e9, 310_000.0])
def test_a_row_whose_combs_cannot_be_seen_names_no_location(fitted, rows, rpm):
    found = fitted.diagnose(rows[1:], rpm=np.array([900.0, rpm]))
    np.testing.assert_array_equal(found.probability[1], np.full(4, 0.25))
    assert found.probability[0].max() > 0.9 and not found.alarm[1]
    reason = "combs need a plausible speed, and two revolutions of the shaft in a row"
    assert found.refusal.tolist() == ["", reason]
    assert found.p_value[1] == pytest.approx(1)
    matches = fitted.match(rows[1:], rpm=np.array([900.0, rpm]))
    assert np.isnan(matches.rpm).tolist() == [False, True]
    assert matches.scores[1].tolist() == [0, 0, 0]


def test_a_range_of_speeds_may_be_too_slow_for_the_rows(rows):
    fitted = classifier(speed_range=(100.0, 119.0)).fit(rows)
    np.testing.assert_array_equal(fitted.predict_proba(rows), np.full((3, 4), 0.25))


@pytest.mark.filterwarnings("ignore:1 of 2 rows:UserWarning")
@pytest.mark.parametrize("rpm", [0.0, np.nan, 1e9, 7000.0])
def test_combs_do_not_decide_at_a_speed_that_spectra_refuse(joint, rpm):
    rows = [row("outer", seed=seed) for seed in (8, 9)]
    probability = joint.predict_proba(rows, rpm=np.array([900.0, rpm]))
    assert probability[0, 1] > 0.9
    np.testing.assert_allclose(probability[1], 0.5)


@pytest.fixture(scope="module")
def joint(healthy):
    X = np.concatenate([healthy[:10], [row("outer", seed=seed) for seed in range(10)]])
    y = ["healthy"] * 10 + ["outer"] * 10
    return make_diagnoser(sampling_rate=RATE, bearing="6205").fit(X, y, rpm=900)


def test_probability_of_a_comb_beside_spectra(joint):
    rows = [row("healthy", seed=30), row("outer", seed=30)]
    without, with_comb = joint.diagnose(rows, rpm=900).comb
    assert without < 0.6 and with_comb > 0.9
    assert np.isnan(joint.diagnose(rows).comb).all()


def test_rows_join_by_spectra_and_combs(joint):
    decide = joint["decide"]
    found = joint.diagnose(
        [row("outer", seed=seed, amplitude=5) for seed in (2, 3)], rpm=900
    )
    one = decide.join(found.row_evidence[:1])
    np.testing.assert_allclose(one.log_probability[0], found.log_probability[0])
    mean = found.row_evidence.mean(axis=0)
    spectra = decide.conditions_.join(mean[np.newaxis, :2], 6).log_probability[0]
    expected = log_softmax(spectra + effective_number(6) * mean[2:])
    joined = decide.join(mean[np.newaxis], 6)
    np.testing.assert_allclose(joined.log_probability[0], expected)


def test_combs_of_noise_are_no_evidence_beside_spectra(joint, healthy):
    quiet = copy.deepcopy(joint)
    # As if the impacts of all healthy rows came at fractions of the orders.
    quiet["decide"].reference_ = np.zeros(3)
    assert quiet.diagnose(healthy[10:], rpm=900).comb.max() < 0.6


def test_adapt_moves_the_spectra_of_a_new_speed(joint, healthy):
    X = lfilter([1], [1, -0.5], healthy[10:20])
    moved = copy.deepcopy(joint).adapt(X, ["healthy"] * 10, rpm=1200)
    expected = copy.deepcopy(joint)
    innovations = expected["identify"].transform(X)
    expected["decide"].conditions_.adapt(innovations, ["healthy"] * 10, rpm=1200)
    probability = moved.predict_proba(X, rpm=1200)
    np.testing.assert_array_equal(probability, expected.predict_proba(X, rpm=1200))
    assert not np.allclose(probability, joint.predict_proba(X, rpm=1200))
    without = classifier().fit(healthy)
    assert not hasattr(without, "adapt")


def test_rows_of_fit_have_two_revolutions_and_one_model(rows):
    with pytest.raises(ValueError, match=r"Turns in .* at 100 rpm"):
        classifier().fit(rows, NAMES, rpm=100)
    with pytest.raises(ValueError, match="expected 1 model, as of ARXLaguerre"):
        classifier().fit(np.ones((2, 3, 100)))


@pytest.fixture(scope="module")
def pipeline(rows):
    steps = [("identify", ARXLaguerre(order=8, bank=False)), ("name", classifier())]
    return DiagnosisPipeline(steps).fit(rows)


def test_behind_a_model(pipeline, rows):
    assert pipeline.predict(rows, rpm=900).tolist() == NAMES
    assert pipeline.diagnose(rows, rpm=[900] * 3).alarm.tolist() == [False, True, True]
    can = capabilities(pipeline)
    assert can.needs_rpm and can.alarm and can.healthy == "healthy"


def of_bearing(name, location, seed=0):
    """A second at 900 rpm with the impacts of another bearing than 6205."""
    return row(
        location, 900 * bearing_orders(name)[location] / ORDERS[location], seed=seed
    )


def test_bearing_of_another_machine(pipeline):
    X = np.stack([of_bearing("6203", "outer", seed) for seed in range(3)])
    assert "outer" not in pipeline.predict(X, rpm=900)
    for bearing in ("6203", bearing_orders("6203")):
        assert pipeline.predict(X, rpm=900, bearing=bearing).tolist() == ["outer"] * 3
    stated = {"rpm": [900] * 3, "bearing": "6203"}
    found = pipeline.diagnose(X, **stated)
    assert found.evidence[0].startswith("impacts at 3.0")
    assert "the outer race of 6203" in found.evidence[0]
    assert pipeline.score(X, ["outer"] * 3, **stated) == 1


def test_rows_of_another_machine_have_any_length(pipeline):
    X = np.concatenate([of_bearing("6203", "inner", seed) for seed in range(2)])
    for length in (15_000, 20_000):
        rows = X[np.newaxis, np.newaxis, :length].astype(np.float32)
        assert pipeline.predict(rows, rpm=900, bearing="6203") == ["inner"]
    with pytest.raises(ValueError, match="NaN"):
        pipeline.predict(np.full((1, 1, 20_000), np.nan), rpm=900)


def test_healthy_rows_of_one_machine_set_no_limit_of_another(healthy):
    fitted = classifier().fit(healthy[:10], ["good"] * 10, rpm=900)
    rows = [of_bearing("6203", "outer"), healthy[10]]
    found = fitted.diagnose(rows, rpm=900, bearing="6203")
    assert found.named.tolist() == ["outer", NO_FINDING]
    assert fitted.match(rows, 900, "6203").scores[0].argmax() == 2
    alone = classifier(bearing="6203").fit(rows).diagnose(rows, 900)
    assert found.p_value[1] == alone.p_value[1]


def test_combs_of_another_machine_decide_beside_spectra(joint):
    X = np.array([of_bearing("6203", "outer", 3)])
    assert joint.diagnose(X, rpm=900).comb < 0.6
    assert joint.diagnose(X, rpm=900, bearing="6203").comb > 0.9


def test_another_bearing_needs_fit_or_metadata(rows):
    fitted = classifier().fit(rows).set_params(bearing="6203")
    message = "parameters changed since fit: call fit, or pass bearing= to predict"
    with pytest.raises(ValueError, match=message):
        fitted.predict(rows, rpm=900)
    assert fitted.predict(rows, rpm=900, bearing="6205").tolist() == NAMES
    with pytest.raises(ValueError, match="bearing '6205x' is not known"):
        fitted.predict(rows, rpm=900, bearing="6205x")


@pytest.mark.parametrize(
    "bearing",
    ["6205", GEOMETRY, {"outer": 3.585, "inner": 5.415}, ["6205", GEOMETRY]],
    ids=["name", "dimensions", "orders", "several"],
)
def test_saved_and_loaded(pipeline, rows, tmp_path, bearing):
    model = clone(pipeline).set_params(name__bearing=bearing).fit(rows)
    save_diagnoser(model, tmp_path / "model.skops")
    loaded, _ = load_diagnoser(tmp_path / "model.skops")
    expected = model.predict_proba(rows, rpm=900)
    np.testing.assert_array_equal(loaded.predict_proba(rows, rpm=900), expected)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("orders_", np.zeros((1, 4))),
        ("healthy_scores_", np.array([2.0, 1.0])),
    ],
)
def test_damaged_state_is_refused(name, value, rows):
    damaged = classifier().fit(rows)
    setattr(damaged, name, value)
    with pytest.raises(ValueError, match=name):
        damaged.predict(rows, rpm=900)
