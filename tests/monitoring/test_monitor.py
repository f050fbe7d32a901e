import json
import pickle

import numpy as np
import pytest
from scipy.special import softmax
from sklearn.calibration import CalibratedClassifierCV

from skarxlag import (
    ConditionMonitor,
    load_monitor_state,
    make_diagnoser,
    make_windows,
    save_monitor_state,
)

from .conftest import RATE, WINDOW, sound


@pytest.fixture
def make(diagnoser, detector):
    def made(**settings):
        settings = {"detector": detector, "window_length": WINDOW} | settings
        return ConditionMonitor(diagnoser, RATE, **settings)

    return made


def random_blocks(signal, seed, longest=700):
    rng = np.random.default_rng(seed)
    cuts = np.cumsum(rng.integers(0, longest, signal.shape[-1]))
    return np.split(signal, cuts[cuts < signal.shape[-1]], axis=-1)


def fed(monitor, blocks):
    return [verdict for block in blocks for verdict in monitor.update(block)]


def troubled():
    """Good, then worn, with missing samples, a dead stretch and an overflow in between."""
    signal = np.concatenate([sound("good", 4000, 3), sound("worn", 4000, 4)])
    signal[900:905] = np.nan
    signal[2000:2700] = 0.25
    signal[5000] = np.inf
    return signal


@pytest.mark.parametrize("hop", [None, 60, 333])
def test_blocks_of_any_lengths_give_the_same_verdicts_to_the_last_bit(make, hop):
    signal = troubled()
    whole = make(hop=hop)
    expected = whole.update(signal)
    assert {v.quality for v in expected} >= {"good", "not finite", "constant"}
    for seed in range(3):
        monitor = make(hop=hop)
        # A text tells NaN from NaN and every bit of a float.
        assert repr(fed(monitor, random_blocks(signal, seed))) == repr(expected)
        assert monitor.counts == whole.counts
    one_by_one = make(hop=hop)
    few = signal[:700]
    assert repr(fed(one_by_one, few.reshape(-1, 1))) == repr(make(hop=hop).update(few))


def test_verdicts_on_windows_are_those_of_the_diagnoser_and_the_detector(make, diagnoser, detector):
    signal = np.concatenate([sound("good", 2000, 3), sound("worn", 2000, 4)])
    verdicts = make(hop=150).update(signal)
    windows = make_windows(signal, WINDOW, hop=150)
    assert [v.start for v in verdicts] == list(range(0, 150 * len(windows), 150))
    assert [v.window_verdict for v in verdicts] == diagnoser.predict(windows).tolist()
    assert [v.exceeds for v in verdicts] == (detector.predict(windows) < 0).tolist()
    np.testing.assert_allclose(
        [v.time for v in verdicts], [(v.start + WINDOW) / RATE for v in verdicts]
    )


def test_evidence_fades_with_the_stated_half_life(make, diagnoser):
    signal = np.concatenate([sound("good", 2000, 3), sound("worn", 2000, 4)])
    log_p = np.log(np.maximum(diagnoser.predict_proba(make_windows(signal, WINDOW)), 1e-6))
    half_life = 0.7
    verdicts = make(half_life=half_life).update(signal)
    for k, verdict in enumerate(verdicts):
        age = (k - np.arange(k + 1)) * WINDOW / RATE
        weights = 0.5 ** (age / half_life)
        expected = softmax(weights @ log_p[: k + 1] / weights.sum())
        assert verdict.confidence == pytest.approx(expected.max(), rel=1e-9)
        assert verdict.verdict == diagnoser.classes_[expected.argmax()]
    never = make(half_life=np.inf).update(signal)
    expected = softmax(log_p.mean(axis=0))
    assert never[-1].confidence == pytest.approx(expected.max(), rel=1e-9)


def test_a_short_half_life_follows_a_change_sooner(make):
    signal = np.concatenate([sound("good", 6000, 3), sound("worn", 6000, 4)])
    changed = {}
    for half_life in (0.2, 2.0):
        verdicts = make(half_life=half_life).update(signal)
        assert verdicts[0].verdict == "good" and verdicts[-1].verdict == "worn"
        changed[half_life] = next(v.start for v in verdicts if v.verdict == "worn")
    assert 6000 <= changed[0.2] < changed[2.0]


def test_alarm_goes_on_with_the_fault_and_off_after_it(make):
    signal = np.concatenate(
        [sound("good", 8000, 3), sound("good", 8000, 4, gain=9.0), sound("good", 24_000, 5)]
    )
    monitor = make(false_alarm_interval=0.5)
    verdicts = monitor.update(signal)
    alarms = np.array([v.alarm for v in verdicts])
    on, off = np.flatnonzero(np.diff(alarms.astype(int)))[:2] + 1
    assert 8000 <= verdicts[on].start < 16_000 < verdicts[off].start
    assert not alarms[:on].any() and alarms[on:off].all() and not alarms[off:].any()
    # Hysteresis: the level falls all the way before the alarm goes off.
    assert verdicts[on].alarm_level == 1.0 and verdicts[off].alarm_level == 0.0
    assert monitor.counts["alarms"] == 1
    assert [v.exceeds for v in verdicts[: on + 1]].count(True) > 1


def test_alarm_settings_move_its_limit(make):
    def limit(**settings):
        return make(**settings)._memory.alarm.limit

    assert limit(false_alarm_interval=1.0) < limit(false_alarm_interval=1e4)
    assert limit(persistence=0.1) < limit(persistence=0.9)
    assert limit(window_false_alarm_rate=0.001) != limit(window_false_alarm_rate=0.05)
    assert make(faulty_rate=0.2)._memory.alarm.step > make(faulty_rate=0.9)._memory.alarm.step
    # Windows that share samples exceed together.
    assert make(hop=20)._healthy["persistence"] == 0.9


def test_calibration_measures_how_often_healthy_windows_exceed(make, detector):
    monitor = make()
    healthy = sound("good", 40_000, 7)
    monitor.update(healthy[:1234])
    assert monitor.calibrate(healthy[:20_000]).calibrate(healthy[20_000:]) is monitor
    exceeds = detector.predict(make_windows(healthy, WINDOW)) < 0
    assert monitor._healthy["rate"] == (exceeds.sum() + 1) / (len(exceeds) + 2)
    assert 0 < monitor._healthy["persistence"] < 1
    assert monitor.counts["samples"] == 0
    before = monitor.state()
    with pytest.raises(ValueError, match="healthy windows exceed the threshold at a rate of"):
        monitor.calibrate(20 * healthy)
    assert repr(monitor.state()) == repr(before)


def test_dead_missing_and_clipped_windows_are_counted_and_give_no_opinion(make):
    signal = troubled()
    signal[6000:6200] = np.clip(signal[6000:6200], -0.2, 0.2)
    monitor = make()
    verdicts = monitor.update(signal)
    assert monitor.counts["windows"] == {
        "good": 34, "not finite": 2, "constant": 3, "clipped": 1,
    }  # fmt: skip
    for verdict in verdicts:
        assert (verdict.window_verdict is None) == (verdict.quality != "good")
        assert (verdict.exceeds is None) == (verdict.quality != "good")
    dead = [v for v in verdicts if v.quality == "constant"]
    # The last verdict stands for a while, with the same confidence.
    assert {v.verdict for v in dead} == {"good"}
    assert len({v.confidence for v in dead}) == 1


def test_a_verdict_gets_stale_when_no_window_says_anything(make):
    monitor = make(half_life=1.0)
    monitor.update(sound("good", 1000, 3))
    silent = monitor.update(np.zeros(2000))
    assert [v.verdict for v in silent] == ["good"] * 5 + [None] * 5
    assert np.isnan(silent[-1].confidence)
    assert monitor.update(sound("worn", 1000, 3))[-1].verdict == "worn"


def test_gaps_and_clock_steps_are_counted_and_windows_start_afresh(make):
    monitor, signal = make(), sound("good", 1000, 3)
    verdicts = monitor.update(signal[:300], time=1000.0)
    assert [v.time for v in verdicts] == [1000.2]
    # Right on time but for jitter: the window goes on.
    verdicts = monitor.update(signal[300:500], time=1000.31)
    assert [v.start for v in verdicts] == [200]
    # 5 s are missing, and the 100 samples of the unfinished window are of no use.
    verdicts = monitor.update(signal[500:750], time=1005.51)
    assert [v.start for v in verdicts] == [500] and verdicts[0].time == pytest.approx(1005.71)
    assert monitor.counts["gaps"] == 1
    assert monitor.counts["missing_seconds"] == pytest.approx(5.0)
    monitor.update(signal[750:], time=3.0)
    assert monitor.counts["clock_steps_back"] == 1 and monitor.counts["gaps"] == 1
    assert make(gap_tolerance=10.0).counts["gaps"] == 0
    tolerant = make(gap_tolerance=10.0)
    tolerant.update(signal[:300], time=0.0)
    tolerant.update(signal[300:], time=9.0)
    assert tolerant.counts["gaps"] == 0


def test_evidence_grows_old_over_a_gap(make):
    good, worn = sound("good", 1000, 3), sound("worn", 200, 4)
    stayed, gone = make(half_life=1.0), make(half_life=1.0)
    stayed.update(good, time=0.0)
    gone.update(good, time=0.0)
    assert stayed.update(worn, time=1.0)[-1].verdict == "good"
    assert gone.update(worn, time=60.0)[-1].verdict == "worn"


def test_slow_drift_of_the_clock_is_no_gap(make):
    monitor = make()
    for k in range(200):
        monitor.update(np.zeros(100), time=k * 0.1 * 1.01)
    assert monitor.counts["gaps"] == 0


def test_state_goes_through_a_file_and_the_next_verdicts_are_the_same(make, tmp_path):
    signal = troubled()
    expected = make(hop=90).update(signal)
    first, second = make(hop=90), make(hop=90)
    before = first.update(signal[:3333])
    path = tmp_path / "monitor.npz"
    save_monitor_state(first, path, place=3333)
    state, facts = load_monitor_state(path)
    assert facts == {"place": 3333}
    assert second.restore(state) is second
    assert second.counts == first.counts
    assert repr(before + second.update(signal[3333:])) == repr(expected)
    assert path.stat().st_size < 20_000


@pytest.mark.parametrize(
    ("window_length", "detector_window_length"), [(120, WINDOW), (470, WINDOW)]
)
def test_a_detector_may_have_windows_of_its_own(
    diagnoser_of, detector, tmp_path, window_length, detector_window_length
):
    def made():
        return ConditionMonitor(
            diagnoser_of(window_length),
            RATE,
            detector=detector,
            window_length=window_length,
            detector_window_length=WINDOW,
            half_life=1.0,
            false_alarm_interval=0.01,
        )

    signal = np.concatenate([troubled(), sound("good", 8000, 4, gain=9.0)])
    whole = made()
    expected = whole.update(signal)
    alone = ConditionMonitor(
        None, RATE, detector=detector, window_length=WINDOW, false_alarm_interval=0.01
    )
    said = alone.update(signal)
    plain = ConditionMonitor(
        diagnoser_of(window_length), RATE, window_length=window_length, half_life=1.0
    ).update(signal)
    end = 0
    for verdict, without in zip(expected, plain, strict=True):
        assert repr(verdict[:6]) == repr(without[:6])
        start, end = end, verdict.start + window_length
        told = [s for s in said if start < s.start + WINDOW <= end]
        opinions = [s.exceeds for s in told if s.exceeds is not None]
        assert verdict.exceeds == (any(opinions) if opinions else None)
        earlier = [s for s in said if s.start + WINDOW <= end]
        assert verdict.alarm == (earlier[-1].alarm if earlier else False)
        assert verdict.alarm_level == (earlier[-1].alarm_level if earlier else 0.0)
    assert {v.alarm for v in expected} == {False, True}
    assert repr(fed(made(), random_blocks(signal, 1))) == repr(expected)
    first, path = made(), tmp_path / "monitor.npz"
    before = first.update(signal[:3333])
    save_monitor_state(first, path)
    again = made().restore(load_monitor_state(path)[0])
    assert repr(before + again.update(signal[3333:])) == repr(expected)
    assert again.counts == whole.counts and whole.counts["alarms"] == 1
    calibrated = made().calibrate(sound("good", 40_000, 7))
    assert calibrated._own.monitor._memory.alarm.limit != first._own.monitor._memory.alarm.limit
    with pytest.raises(ValueError, match="detector_window_length is 200, expected None"):
        ConditionMonitor(
            diagnoser_of(window_length),
            RATE,
            window_length=window_length,
            half_life=1.0,
            false_alarm_interval=0.01,
        ).restore(first.state())


def test_windows_of_the_detector_need_a_detector_and_a_diagnoser(diagnoser, detector):
    for one, other in ((diagnoser, None), (None, detector)):
        with pytest.raises(ValueError, match="detector_window_length=300, expected None"):
            ConditionMonitor(one, RATE, detector=other, detector_window_length=300)


def test_state_of_a_calibrated_monitor_keeps_the_calibration(make):
    calibrated = make().calibrate(sound("good", 40_000, 7))
    again = make().restore(calibrated.state())
    assert again._memory.alarm.limit == calibrated._memory.alarm.limit != make()._memory.alarm.limit


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s["settings"].update(hop=7), "hop is 7, expected 200"),
        (lambda s: s["settings"].update(conditions=["a"]), "conditions is"),
        (lambda s: s["memory"]["evidence"].update(sums=[1.0]), "finite sums for 2 conditions"),
        (
            lambda s: s["memory"]["evidence"].update(sums=[np.nan, 0.0]),
            "finite sums for 2 conditions",
        ),
        (lambda s: s["memory"]["alarm"].update(sum=10**6), "expected a sum from 0 to"),
        (lambda s: s["stream"].update(rest=np.zeros((1, 5))), "do not fit"),
        (lambda s: s["stream"].pop("next_start"), "next_start"),
        (lambda s: s["stream"].update(n_gaps="x"), "'x', expected an integer of at least 0"),
        (lambda s: s["stream"].update(rest=[1.0]), "damaged"),
        (lambda s: s["stream"].update(reference=[]), "damaged"),
        (lambda s: s["memory"]["evidence"].update(weight=np.inf), "finite sums"),
        (lambda s: s["healthy"].update(rate=None), "rate"),
        (lambda s: s["healthy"].update(persistence=-1.0), "persistence"),
        (lambda s: s.pop("healthy"), "healthy"),
        (lambda s: s["seen"].update(windows=-1), "-1, expected an integer"),
        (lambda s: s.update(n_channels=-1), "-1, expected an integer of at least 1"),
        (lambda s: s.update(n_channels=3), "1 channels wait, expected 3"),
        (lambda s: s.update(last_start=0.5), "0.5, expected an integer"),
        (lambda s: s.update(speeds=[[1]]), "damaged"),
        (lambda s: s.update(speeds=[[5, 100.0], [1, 90.0]]), "order of time"),
        (lambda s: s.update(speeds=[[5, -100.0]]), "rpm"),
        (lambda s: s.clear(), "state is a dict, expected what `state` gave"),
    ],
)
def test_a_state_that_does_not_fit_is_refused(make, change, message):
    monitor = make()
    monitor.update(sound("good", 750, 3))
    state = monitor.state()
    change(state)
    other = make()
    with pytest.raises(ValueError, match=message):
        other.restore(state)
    assert other.counts["samples"] == 0
    # What was refused has left nothing behind.
    assert other.state() == make().state()


@pytest.mark.parametrize("state", [None, [], "state", 5])
def test_what_is_no_state_is_refused(make, state):
    with pytest.raises(ValueError, match="expected what `state` gave"):
        make().restore(state)


def test_a_compressed_state_is_refused_before_it_is_unpacked(tmp_path):
    path = tmp_path / "monitor.npz"
    np.savez_compressed(path, state=np.array("x" * 10**6), rest=np.zeros(3))
    with pytest.raises(ValueError, match=r"monitor\.npz: no state of a monitor .it is compressed"):
        load_monitor_state(path)


def test_files_that_hold_no_state_are_refused(make, tmp_path):
    path = tmp_path / "monitor.npz"
    with pytest.raises(FileNotFoundError, match=r"monitor\.npz: no such file"):
        load_monitor_state(path)
    path.write_bytes(pickle.dumps({}))
    with pytest.raises(ValueError, match=r"monitor\.npz: no state of a monitor"):
        load_monitor_state(path)
    np.savez(path, state=np.array(json.dumps({"format": "another"})), rest=np.zeros(3))
    with pytest.raises(ValueError, match="no state of a monitor"):
        load_monitor_state(path)


def test_memory_is_bounded_by_one_window(make):
    monitor = make(hop=50)
    for _ in range(20):
        monitor.update(np.random.default_rng(0).normal(size=10_007))
        assert monitor.state()["stream"]["rest"].shape[1] < WINDOW
        assert monitor._stream._rest.base is None


@pytest.mark.parametrize("dtype", [np.float32, np.int16, ">f8"])
def test_samples_of_any_real_type(make, dtype):
    signal = (1000 * sound("good", 1000, 3)).astype(dtype)
    expected = make().update(signal.astype(np.float64))
    assert repr(make().update(signal)) == repr(expected)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (["a"], "samples of type <U1"),
        (np.zeros(3, dtype=complex), "samples of type complex128"),
        (np.zeros((1, 1, 3)), r"shape \(1, 1, 3\)"),
        (np.zeros((0, 3)), r"shape \(0, 3\), expected real numbers"),
        (np.zeros((2, 3)), "samples of 2 channels, expected 1"),
    ],
)
def test_bad_samples_are_refused(make, samples, message):
    monitor = make()
    monitor.update([0.0])
    with pytest.raises(ValueError, match=message):
        monitor.update(samples)


def test_no_samples_are_no_trouble(make):
    monitor = make()
    assert monitor.update([]) == [] and monitor.update(np.zeros(0)) == []
    assert monitor.counts["samples"] == 0 and monitor.counts["windows"] == {}


@pytest.mark.parametrize(
    "setting",
    [
        {"window_length": 0}, {"hop": 0}, {"half_life": 0.0}, {"half_life": np.nan},
        {"false_alarm_interval": 0.0}, {"persistence": 1.0}, {"persistence": 0.0},
        {"faulty_rate": 1.0}, {"gap_tolerance": -1.0}, {"window_false_alarm_rate": 0.0},
    ],
    ids=str,
)  # fmt: skip
def test_bad_settings_are_named(make, setting):
    with pytest.raises(ValueError, match=next(iter(setting))):
        make(**setting)


def test_sampling_rate_must_be_positive(diagnoser):
    with pytest.raises(ValueError, match="sampling_rate"):
        ConditionMonitor(diagnoser, 0.0)


def test_a_diagnoser_alone_and_a_detector_alone(diagnoser, detector):
    signal = sound("good", 1000, 3)
    alone = ConditionMonitor(diagnoser, RATE, window_length=WINDOW)
    last = alone.update(signal)[-1]
    assert last.verdict == "good" and last.alarm is False
    watching = ConditionMonitor(None, RATE, detector=detector, window_length=WINDOW)
    last = watching.update(signal)[-1]
    assert last.verdict is None and last.window_verdict is None and last.alarm is False
    assert watching.conditions == []
    with pytest.raises(ValueError, match="diagnoser and detector are None"):
        ConditionMonitor(None, RATE)
    with pytest.raises(ValueError, match="states no probabilities"):
        ConditionMonitor(detector, RATE)


def test_a_classifier_of_others_tells_conditions_and_raises_no_alarm():
    X = np.stack([make_windows(sound(c, 2000, 5), WINDOW) for c in ("good", "worn")]).reshape(
        -1, WINDOW
    )
    other = CalibratedClassifierCV(make_diagnoser(), cv=2).fit(X, np.repeat([3, 4], 10))
    monitor = ConditionMonitor(other, RATE, window_length=WINDOW)
    last = monitor.update(sound("worn", 1000, 6))[-1]
    assert last.verdict == 4 and type(last.verdict) is int
    assert last.alarm is None and np.isnan(last.alarm_level)
    with pytest.raises(ValueError, match="no detector"):
        monitor.calibrate(sound("good", 1000, 6))
