import numpy as np
import pytest
from sklearn.base import clone
from sklearn.utils import Bunch

from skarxlag import (
    ARXLaguerre,
    BearingGeometry,
    DiagnosisPipeline,
    FaultOrderClassifier,
    bearing_orders,
    load_diagnoser,
    make_diagnoser,
    save_diagnoser,
)
from skarxlag.core.capabilities import capabilities
from skarxlag.core.fault_locations import NOT_IDENTIFIABLE
from skarxlag.decisions.comb_probabilities import limit_elsewhere
from skarxlag.measures.envelope_spectra import best_combs

RATE = 10_000.0
ORDERS = bearing_orders("6205")


def row(place, rpm=900, amplitude=10.0, seed=0, ratio=1.0):
    """One second of noise, with impacts at the order of a place that scatter by 1 %."""
    rng = np.random.default_rng(seed)
    signal = rng.normal(size=int(RATE))
    if place != "healthy":
        interval = 60 * RATE / (rpm * ORDERS[place] * ratio)
        places = np.cumsum(
            interval * rng.normal(1, 0.01, size=int(1.2 * RATE / interval))
        )
        signal[places[places < RATE].astype(int)] += amplitude
    return signal


def found(scores, rpm=900.0):
    """What `match` returns, of given scores."""
    shape = np.shape(scores)
    return Bunch(
        scores=np.asarray(scores),
        factors=np.ones(shape),
        bearings=np.zeros(shape, dtype=int),
        rpm=np.full(len(scores), rpm),
    )


def classifier(**options):
    return FaultOrderClassifier(
        **({"bearing": "6205", "sampling_rate": RATE} | options)
    )


@pytest.fixture(scope="module")
def rows():
    return np.stack([row("healthy"), row("outer"), row("inner", seed=1)])


@pytest.fixture(scope="module")
def healthy():
    return np.stack([row("healthy", seed=seed) for seed in range(40)])


NAMES = ["healthy", "outer", "inner"]


def test_places_without_any_recording_of_a_fault(rows):
    fitted = classifier().fit(rows[:1])
    assert fitted.classes_.tolist() == ["ball", "healthy", "inner", "outer"]
    assert fitted.predict(rows, rpm=900).tolist() == NAMES
    assert fitted.diagnose(rows, rpm=900).named.tolist() == NAMES
    assert fitted.diagnose(rows, rpm=900).alarm.tolist() == [False, True, True]
    probability = fitted.predict_proba(rows, rpm=900)
    np.testing.assert_allclose(probability.sum(axis=1), 1)
    assert fitted.classes_[probability.argmax(axis=1)].tolist() == NAMES
    # Of three equally likely places, each shows no comb with the probability .4.
    assert (
        0.4 < probability[0, 1] <= 1 / (1 + 3 * 0.4)
        and probability[1:].max(axis=1).min() > 0.9
    )
    p_values = fitted.p_values(rows, rpm=900)
    assert p_values[0] > 0.02 > p_values[1:].max()


def test_the_limit_is_the_score_with_the_stated_p_value(rows, healthy):
    for fitted in (
        classifier(false_alarm_rate=0.01).fit(rows),
        classifier(false_alarm_rate=0.01).fit(healthy, ["healthy"] * 40, rpm=900),
    ):
        for rpm in (900.0, 1200.0):
            limit = fitted.limit_
            if rpm != 900.0 or fitted.healthy_speeds_.size == 0:
                limit = limit_elsewhere(limit, 0.01)
            scores = np.array([[limit, -9, -9]]) + fitted.reference_
            assert fitted._judge(found(scores, rpm)).p_value[0] == pytest.approx(
                0.01, rel=1e-6
            )
            assert fitted._judge(found(scores + 0.1, rpm)).p_value[0] < 0.01
    # Healthy rows say less of another speed.
    assert limit > fitted.limit_


@pytest.mark.parametrize("classes", [None, ["healthy", "outer", "outer"]])
def test_diagnose_is_what_the_methods_return(rows, classes):
    fitted = classifier().fit(rows, classes, rpm=900)
    found = fitted.diagnose(rows, rpm=900)
    methods = ("decision_function", "predict_proba", "predict", "p_values")
    for name, method in zip(
        ("score", "probability", "verdict", "p_value"), methods, strict=True
    ):
        np.testing.assert_array_equal(
            found[name], getattr(fitted, method)(rows, rpm=900)
        )
    pipeline = DiagnosisPipeline([("decide", fitted)])
    np.testing.assert_array_equal(pipeline.diagnose(rows, rpm=900).score, found.score)


def test_speed_slip_and_gear_ratio(rows):
    fitted = classifier().fit(rows)
    assert fitted.predict([row("inner", rpm=930)], rpm=900)[0] == "inner"
    assert fitted.match([row("inner", rpm=930)], rpm=900).factors[
        0, 1
    ] == pytest.approx(930 / 900, abs=0.01)
    exact = classifier(speed_tolerance=0.0).fit(rows)
    assert exact.predict([row("inner", rpm=960)], rpm=900)[0] == "healthy"
    strict = classifier(slip=0.005).fit(rows)
    assert (
        strict.match([row("inner", rpm=930)], rpm=900).scores[0, 1]
        < fitted.match([row("inner", rpm=930)], rpm=900).scores[0, 1]
    )
    geared = classifier(gear_ratio=2.0).fit(rows)
    assert geared.predict(rows, rpm=450).tolist() == NAMES
    # The bearing turns with 900 rpm, so that its contrasts are the same.
    for ratio in (0.01, 20.0):
        geared = classifier(gear_ratio=ratio).fit(rows)
        found = geared.match(rows, rpm=900 / ratio)
        expected = fitted.match(rows, rpm=900).contrasts
        np.testing.assert_allclose(found.contrasts, expected, atol=1e-9)
        np.testing.assert_allclose(found.rpm, 900 / ratio)
        # One turn and a half of the bearing's shaft is too short.
        assert np.isnan(geared.match(rows, rpm=90 / ratio).rpm).all()


def test_speed_is_searched_in_the_stated_range():
    rng = np.random.default_rng(5)
    time = np.arange(int(3 * RATE)) / RATE
    angle = 15.8 * time  # 948 rpm
    signal = rng.normal(size=len(time)) + sum(
        np.sin(2 * np.pi * h * angle) for h in (1, 2, 3, 4)
    )
    strikes = np.cumsum(
        rng.normal(RATE / (15.8 * ORDERS["outer"]), 1.0, size=160)
    ).astype(int)
    signal[strikes[strikes < len(time)]] += 15
    fitted = classifier(speed_range=(850.0, 1050.0)).fit(signal[np.newaxis])
    assert fitted.match([signal]).rpm[0] == pytest.approx(948, rel=0.01)
    assert fitted.predict([signal])[0] == "outer"
    with pytest.raises(
        ValueError, match="rpm == None, expected the speed of each row, or a speed_r"
    ):
        classifier().fit([signal]).predict([signal])


def test_labels_stand_for_places(rows):
    X = np.concatenate([rows, rows])
    fitted = classifier().fit(X, ["N", "OR7", "fault at the inner race"] * 2, rpm=900)
    assert fitted.predict(rows, rpm=900).tolist() == [
        "N",
        "OR7",
        "fault at the inner race",
    ]
    by_7 = classifier(places={7: "outer", 0: "healthy", 3: "inner"}).fit(
        X, [0, 7, 3] * 2, rpm=900
    )
    assert by_7.predict(rows, rpm=900).tolist() == [0, 7, 3]
    shown = classifier().fit(X, [5, 4, 9] * 2, rpm=900)
    assert shown.class_places_.tolist() == [2, 3, 1]
    assert shown.predict(rows, rpm=900).tolist() == [5, 4, 9]


def test_healthy_rows_are_the_reference(rows, healthy):
    with_comb = np.stack([row("outer", amplitude=6, seed=seed) for seed in range(40)])
    plain = classifier().fit(healthy)
    assert plain.predict(with_comb, rpm=900).tolist().count("outer") > 30
    fitted = classifier().fit(with_comb[:20], ["good"] * 20, rpm=900)
    assert fitted.classes_.tolist() == ["ball", "good", "inner", "outer"]
    assert fitted.predict(with_comb[20:], rpm=900).tolist().count("good") >= 18
    assert fitted.predict(rows[2:], rpm=900)[0] == "inner"


@pytest.mark.slow
def test_stated_false_alarm_rate_holds_for_rows_like_the_reference():
    rng = np.random.default_rng(6)
    X = rng.normal(size=(300, 6000))
    fitted = classifier(false_alarm_rate=0.1).fit(X[:100], ["healthy"] * 100, rpm=900)
    alarms = fitted.diagnose(X[100:], rpm=900).alarm.mean()
    assert alarms < 0.1 + 3 * np.sqrt(0.09 / 100)
    assert alarms > 0.01


def test_two_places_that_are_too_close_are_not_named(rows):
    both = classifier().fit(rows)
    scores = np.array([[0.5, 4.0, 4.0 - 0.05], [0.5, 4.0, 3.0], [0.5, 1.0, 0.99]])
    assert both._judge(found(scores)).named.tolist() == [
        NOT_IDENTIFIABLE,
        "inner",
        "healthy",
    ]
    careful = classifier(wrong_name_rate=1e-5).fit(rows)
    assert careful._judge(found(scores[1:2])).named.tolist() == ["inner"]


def test_several_bearings(rows):
    fitted = classifier(bearing=["6206", BearingGeometry(9, 7.94, 39.04)]).fit(rows)
    assert fitted.orders_.shape == (2, 4)
    assert fitted.match(rows, rpm=900).bearings[1:].max(axis=1).tolist() == [1, 1]
    assert "bearing 2" in fitted.diagnose(rows, rpm=900).evidence[1]


def test_evidence_is_a_sentence(rows):
    said = classifier().fit(rows).diagnose(rows, rpm=900).evidence
    assert said[0].startswith("no comb exceeds its limit; the strongest is that of")
    assert said[2].startswith("impacts at 5.4")
    assert "the inner race of 6205" in said[2]
    assert said[2].endswith("% from the nominal order")
    # At 6 % from the nominal order, a parameter decides what slip and the speed
    # explain.
    for slip, doubt in ((0.03, True), (0.08, False)):
        fitted = classifier(slip=slip).fit(rows)
        (said,) = fitted.diagnose(
            [row("inner", rpm=954, amplitude=20)], rpm=900
        ).evidence
        assert said.startswith("impacts at 5.7")
        assert (
            said.endswith("more than slip explains: check the speed and the bearing")
            == doubt
        )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bearing": None}, "bearing must be a name, .* got None"),
        (
            {"sampling_rate": None},
            "sampling_rate == None, expected the sampling rate of the rows",
        ),
        ({"bearing": "6205x"}, "bearing '6205x' is not known"),
        ({"bearing": []}, "bearing == .., expected at least one bearing"),
        ({"false_alarm_rate": 0}, "false_alarm_rate"),
        ({"wrong_name_rate": 0.6}, "wrong_name_rate"),
        ({"gear_ratio": -1}, "gear_ratio"),
        ({"speed_range": (900, 600)}, "speed_range.0. == 900, must be < 600"),
        ({"speed_range": (-900, 600)}, "speed_range.0. == -900, must be > 0"),
        ({"speed_range": (900, np.inf)}, "speed_range.1. == inf, must be finite"),
        ({"places": {"a": "cage"}}, "places.'a'. == 'cage'"),
    ],
)
def test_bad_parameters_are_named(options, message, rows):
    with pytest.raises((TypeError, ValueError), match=message):
        classifier(**options).fit(rows, rpm=900)


@pytest.mark.filterwarnings("ignore:1 of 2 rows:UserWarning")
@pytest.mark.parametrize("rpm", [119.0, 0.0, -900.0, np.nan, np.inf, 1e9, 310_000.0])
def test_a_row_whose_combs_cannot_be_seen_names_no_place(rows, rpm):
    fitted, speeds = classifier().fit(rows), np.array([900.0, rpm])
    found = fitted.diagnose(rows[1:], rpm=speeds)
    np.testing.assert_array_equal(found.probability[1], np.full(4, 0.25))
    assert found.probability[0].max() > 0.9 and not found.alarm[1]
    assert found.refusal.tolist() == [
        "",
        "combs need a plausible speed, and two revolutions of the shaft in a row",
    ]
    assert np.isnan(found.rpm[1]) and found.p_value[1] == pytest.approx(1)
    searched = classifier(speed_range=(100.0, 119.0)).fit(rows).diagnose(rows)
    np.testing.assert_array_equal(searched.probability, np.full((3, 4), 0.25))


@pytest.mark.filterwarnings("ignore:1 of 2 rows:UserWarning")
@pytest.mark.parametrize("rpm", [0.0, np.nan, 1e9, 7000.0])
def test_combs_do_not_decide_at_a_speed_that_spectra_refuse(healthy, rpm):
    X = np.concatenate([healthy[:10], [row("outer", seed=seed) for seed in range(10)]])
    joint = make_diagnoser(sampling_rate=RATE, bearing="6205")
    joint.fit(X, ["healthy"] * 10 + ["outer"] * 10, rpm=900)
    probability = joint.predict_proba(X[-2:], rpm=np.array([900.0, rpm]))
    assert probability[0, 1] > 0.9
    np.testing.assert_allclose(probability[1], 0.5)


def test_speeds_are_checked(rows):
    with pytest.raises(ValueError, match=r"Turns in .* at 100 rpm"):
        classifier().fit(rows, NAMES, rpm=100)
    with pytest.raises(ValueError, match="expected 1 model, as of ARXLaguerre"):
        classifier().fit(np.ones((2, 3, 100)))


def test_behind_a_model_saved_and_loaded(rows, tmp_path):
    steps = [("identify", ARXLaguerre(order=8, bank=False)), ("name", classifier())]
    pipeline = DiagnosisPipeline(steps).fit(rows)
    assert pipeline.predict(rows, rpm=900).tolist() == NAMES
    diagnosed = pipeline.diagnose(rows, rpm=[900] * 3)
    assert diagnosed.alarm.tolist() == [False, True, True]
    can = capabilities(pipeline)
    assert can.takes_rpm and can.needs_rpm and can.alarm
    assert can.healthy == "healthy" and can.conditions == (
        "ball",
        "healthy",
        "inner",
        "outer",
    )
    geometry = BearingGeometry(9, 7.94, 39.04)
    for bearing in (
        "6205",
        geometry,
        {"outer": 3.585, "inner": 5.415},
        ["6205", geometry],
    ):
        model = clone(pipeline).set_params(name__bearing=bearing).fit(rows)
        save_diagnoser(model, tmp_path / "model.skops")
        loaded, _ = load_diagnoser(tmp_path / "model.skops")
        np.testing.assert_array_equal(
            loaded.predict_proba(rows, rpm=900), model.predict_proba(rows, rpm=900)
        )


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("orders_", np.zeros((1, 4))),
        ("class_places_", np.array([0, 1, 2, 9])),
        ("healthy_scores_", np.array([2.0, 1.0])),
        ("reference_", np.zeros(2)),
    ],
)
def test_damaged_state_is_refused(name, value, rows):
    fitted = classifier().fit(rows)
    setattr(fitted, name, value)
    with pytest.raises(ValueError, match=name):
        fitted.predict(rows, rpm=900)


def test_the_cage_counts_in_rows_that_resolve_it(healthy):
    fitted = classifier().fit(healthy[:2])
    contrast = np.zeros(4001)
    contrast[[round(100 * k * ORDERS["cage"]) for k in (1, 2, 3, 4)]] = 2.0
    scores = [
        best_combs(contrast, n_turns / ORDERS["cage"], fitted.orders_, 0.0, 0.03)[
            "scores"
        ][0]
        for n_turns in (2.01, 1.99)
    ]
    assert scores[0] > 0.5 > scores[1] == 0


@pytest.mark.filterwarnings("ignore:1 of 2 rows are treated as rows without a signal")
def test_a_row_of_unknown_speed_has_no_contrast(rows):
    found = classifier().fit(rows).match(rows[:2], rpm=[1500.0, np.nan])
    assert found.contrasts[0].any() and not found.contrasts[1].any()
    assert found.scores[1].tolist() == [0, 0, 0] and found.factors[1].tolist() == [
        1,
        1,
        1,
    ]
    assert found.rpm[0] == 1500 and np.isnan(found.rpm[1])
