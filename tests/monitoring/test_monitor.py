import json
import pickle
import tracemalloc
import warnings

import numpy as np
import pytest
from scipy.stats import norm
from sklearn.calibration import CalibratedClassifierCV

from skarxlag import (
    ConditionMonitor,
    FaultOrderClassifier,
    bearing_orders,
    load_monitor_state,
    make_detector,
    make_diagnoser,
    make_windows,
    save_monitor_state,
    window_verdicts,
)
from skarxlag.kernels.evidence import P_VALUE_CORRELATION, effective_number
from skarxlag.monitoring.together import diagnose_together

from .conftest import RATE, WINDOW, sound


@pytest.fixture
def make(diagnoser, detector):
    def made(model=diagnoser, **settings):
        settings = {"detector": detector, "window_length": WINDOW} | settings
        return ConditionMonitor(model, RATE, **settings)

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
        # A text distinguishes NaN from NaN and every bit of a float.
        assert repr(fed(monitor, random_blocks(signal, seed))) == repr(expected)
        assert monitor.counts == whole.counts


def test_verdicts_on_windows_are_those_of_the_diagnoser_and_the_detector(
    make, diagnoser, detector
):
    signal = np.concatenate([sound("good", 2000, 3), sound("worn", 2000, 4)])
    verdicts = make(hop=150).update(signal)
    windows = make_windows(signal, WINDOW, hop=150)
    starts = [v.start for v in verdicts]
    assert starts == list(range(0, 150 * len(windows), 150))
    assert [v.window_verdict for v in verdicts] == diagnoser.predict(windows).tolist()
    assert [v.exceeds for v in verdicts] == (detector.predict(windows) < 0).tolist()
    ends = (np.array(starts) + WINDOW) / RATE
    np.testing.assert_allclose([v.time for v in verdicts], ends)


def test_evidence_fades_with_the_stated_half_life(make, diagnoser):
    signal = np.concatenate([sound("good", 2000, 3), sound("worn", 2000, 4)])
    logs = np.log(diagnoser.diagnose(make_windows(signal, WINDOW)).levels)

    def probabilities(weights):
        mean = np.average(logs[: len(weights)], axis=0, weights=weights)
        joined = diagnoser["decide"].join(mean[np.newaxis], weights.sum())
        return np.exp(joined.log_probability[0])

    for half_life in (0.7, np.inf):
        # At a speed without healthy limits, evidence alone decides.
        verdicts = make(detector=None, half_life=half_life).update(signal, rpm=9.0)
        for k, verdict in enumerate(verdicts):
            age = (k - np.arange(k + 1)) * WINDOW / RATE
            expected = probabilities(0.5 ** (age / half_life))
            best = [*diagnoser.classes_, "unknown condition"][expected.argmax()]
            assert verdict.verdict == best
            assert verdict.probability == pytest.approx(expected.max(), 1e-9)


def test_p_value_is_that_of_the_recent_windows(make, diagnoser, detector):
    signal = np.concatenate([sound("good", 2000, 3), sound("good", 2000, 4, gain=9.0)])
    table = window_verdicts(diagnoser, make_windows(signal, WINDOW), detector=detector)
    scores = norm.ppf(np.clip(table["p-value"], 1e-300, 0.999))
    verdicts = make(half_life=0.7).update(signal)
    for k, verdict in enumerate(verdicts):
        weights = 0.5 ** ((k - np.arange(k + 1)) * WINDOW / RATE / 0.7)
        n = effective_number(weights.sum(), P_VALUE_CORRELATION)
        mean = np.average(scores[: k + 1], weights=weights)
        assert verdict.p_value == pytest.approx(norm.cdf(np.sqrt(n) * mean), rel=1e-9)
    assert verdicts[9].p_value > 0.1 > verdicts[19].p_value


def test_alarm_settings_move_its_delay(make):
    def delay(**settings):
        return make(**settings).alarm_delay

    assert delay(false_alarm_interval=1.0) < delay(false_alarm_interval=1e4)
    assert delay(persistence=0.1) < delay(persistence=0.9)
    # Windows that share samples exceed together.
    assert delay(hop=20) == delay(hop=20, persistence=0.9)
    assert delay(hop=20) < delay(hop=20, persistence=0.95)


@pytest.mark.parametrize(
    "settings",
    [{}, {"false_alarm_interval": 1.0}, {"alarm_delay": 3}, {"alarm_delay": 1}],
)
def test_the_delay_of_the_alarm_is_stated_or_chosen(make, settings):
    monitor = make(**settings)
    verdicts = monitor.update(sound("good", 40 * WINDOW, 4, gain=9.0))
    assert all(v.exceeds for v in verdicts)
    on = [v.alarm for v in verdicts].index(True)
    assert on + 1 == monitor.alarm_delay and verdicts[on].alarm_level == 1.0
    assert settings.get("alarm_delay", monitor.alarm_delay) == monitor.alarm_delay


def test_the_interval_between_false_alarms(make):
    # A delay of 1: each window that exceeds raises the alarm, one in 20.
    rare = make(alarm_delay=1, persistence=0.05).false_alarm_interval
    assert rare == pytest.approx(20 * WINDOW / RATE / 3600)
    # The smallest delay that the interval allows.
    by_interval = make(false_alarm_interval=1.0)
    assert by_interval.false_alarm_interval >= 1.0
    assert make(alarm_delay=by_interval.alarm_delay - 1).false_alarm_interval < 1.0


def test_a_latched_alarm_stays_on_until_it_is_acknowledged(make):
    calm = sound("good", 40 * WINDOW, 5)
    signal = np.concatenate([sound("good", 8 * WINDOW, 4, gain=9.0), calm])
    monitor, plain = make(alarm_delay=3, latch=True), make(alarm_delay=3)
    verdicts, others = monitor.update(signal), plain.update(signal)
    states = [v.alarm_state for v in verdicts]
    assert states[:4] == ["not yet an alarm", "not yet an alarm", "on", "on"]
    assert states[-1] == monitor.alarm_state == "latched" and monitor.latched
    assert others[-1].alarm_state == "off"
    assert not others[-1].alarm and not plain.latched
    assert verdicts[-1].alarm and verdicts[-1].alarm_level == 0.0
    # The verdict is that of recent windows.
    assert verdicts[-1].verdict == others[-1].verdict == "good"
    again = make(alarm_delay=3, latch=True).restore(monitor.state())
    assert again.latched and again.alarm_state == "latched"
    assert not make(alarm_delay=3).restore(monitor.state()).latched
    again.acknowledge()
    assert again.alarm_state == "off" and not again.update(calm)[-1].alarm
    # Acknowledged while it is on, the next alarm goes off by itself.
    assert again.update(signal[: 6 * WINDOW])[-1].alarm_state == "on"
    again.acknowledge()
    assert again.alarm_state == "on" and again.update(calm)[-1].alarm_state == "off"
    assert again.counts["alarms"] == 2


def test_no_verdict_is_healthy_while_windows_exceed_the_limits(make, diagnoser):
    signal = np.concatenate([sound("good", 4000, 3), sound("good", 4000, 4, gain=9.0)])
    for model, healthy in ((None, "healthy"), (diagnoser, "good")):
        verdicts = make(model, alarm_delay=5, half_life=0.5).update(signal)
        by_state = {"off": set(), "not yet an alarm": set(), "on": set()}
        for verdict in verdicts:
            by_state[verdict.alarm_state].add(verdict.verdict)
        assert healthy in by_state["off"]
        assert by_state["not yet an alarm"] == {"possibly changed"}
        assert by_state["on"] == {"changed"}
        doubtful = [v for v in verdicts if v.verdict == "possibly changed"]
        assert np.isnan([v.probability for v in doubtful]).all()


def test_a_p_value_below_the_rate_is_against_healthy_without_a_window_that_exceeds(
    make, detector
):
    """Each window alone is within the limits, and all of them together are not."""
    gains = np.linspace(1, 9, 60)
    windows = make_windows(sound("good", WINDOW, 8), WINDOW)
    tested = np.concatenate([gain * windows for gain in gains])
    p_values = detector.p_values(tested)
    gain = gains[np.flatnonzero(p_values > 0.05)[-1]]
    last = make().update(np.tile(gain * windows[0], 200))[-1]
    assert (last.exceeds, last.alarm_state) == (False, "off")
    assert last.p_value < 0.05 and last.verdict == "possibly changed"


def test_levels_are_those_of_the_output(make, of_two):
    signal = sound("good", 3 * WINDOW, 3) + 5.0
    windows = make_windows(signal, WINDOW)
    peaks = np.abs(windows - windows.mean(axis=1, keepdims=True)).max(axis=1)
    verdicts = make().update(signal)
    assert [v.rms for v in verdicts] == pytest.approx(windows.std(axis=1))
    assert [v.peak for v in verdicts] == pytest.approx(peaks)
    two = ConditionMonitor(of_two[0], RATE, window_length=WINDOW)
    first = two.update(np.stack([signal, 0 * signal]))
    assert [v.crest_factor for v in first] == pytest.approx(peaks / windows.std(axis=1))


def test_monitors_are_diagnosed_together_as_alone(make, detector):
    """Monitors of one model, of another one, with speeds and without, also of no window."""
    signals = [troubled()[k : k + 300 + 700 * k] for k in range(7)]
    speeds = [None, 900.0, None, 900.0, np.full(3100, 900.0), None, 900.0]

    def monitors():
        settings = [{}] * 5 + [{"half_life": 1.0}, {"model": None}]
        return [make(**each) for each in settings]

    together = monitors()
    cuts = [
        monitor.cut(signal, rpm=rpm)
        for monitor, signal, rpm in zip(together, signals, speeds, strict=True)
    ]
    alone = [
        monitor.update(signal, rpm=rpm)
        for monitor, signal, rpm in zip(monitors(), signals, speeds, strict=True)
    ]
    assert repr(diagnose_together(cuts)) == repr(alone)
    assert diagnose_together([make().cut([0.0] * 50)]) == [[]]


def test_dead_missing_and_clipped_windows_are_counted_and_give_no_opinion(make):
    signal = troubled()
    signal[6000:6200] = np.clip(signal[6000:6200], -0.2, 0.2)
    monitor = make()
    verdicts = monitor.update(signal)
    assert monitor.counts["windows"] == {
        "good": 33, "not finite": 2, "constant": 3, "clipped": 1, "stuck": 1,
    }  # fmt: skip
    for verdict in verdicts:
        assert (verdict.window_verdict is None) == (verdict.quality != "good")
        assert (verdict.exceeds is None) == (verdict.quality != "good")
        assert (verdict.quality_share > 0) == (verdict.quality != "good")
    dead = [v for v in verdicts if v.quality == "constant"]
    # The last verdict stands for a while, with less confidence.
    assert {v.verdict for v in dead} == {"good"}
    assert np.all(np.diff([v.probability for v in dead]) < 1e-9)


def test_a_verdict_gets_stale_when_no_window_says_anything(make):
    monitor = make(half_life=1.0)
    monitor.update(sound("good", 1000, 3))
    silent = monitor.update(np.zeros(2000))
    assert [v.verdict for v in silent] == ["good"] * 5 + [None] * 5
    assert np.isnan(silent[-1].probability)
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
    assert [v.start for v in verdicts] == [500]
    assert verdicts[0].time == pytest.approx(1005.71)
    assert monitor.counts["gaps"] == 1
    assert monitor.counts["missing_seconds"] == pytest.approx(5.0)
    monitor.update(signal[750:], time=3.0)
    assert monitor.counts["clock_steps_back"] == 1 and monitor.counts["gaps"] == 1


@pytest.mark.parametrize("pause", [0.05, 7.0])
def test_a_pause_before_a_restart_is_a_gap(make, pause):
    signal = sound("good", 1000, 3)
    monitor = make()
    before = monitor.update(signal[:500])
    again = make().restore(monitor.state(), pause=pause)
    after = again.update(signal[500:])
    is_gap = pause == 7.0
    assert again.counts["gaps"] == is_gap
    assert after[0].start == (500 if is_gap else 400)
    expected = before[-1].time + 0.2 + pause + (0.1 if is_gap else 0.0)
    assert after[0].time == pytest.approx(expected)
    with pytest.raises(ValueError, match="pause"):
        make().restore(monitor.state(), pause=-1.0)


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
    path = tmp_path / "monitor.json"
    save_monitor_state(first, path, place=3333)
    state, facts = load_monitor_state(path)
    assert facts == {"place": 3333}
    assert second.restore(state) is second
    assert second.counts == first.counts
    assert repr(before + second.update(signal[3333:])) == repr(expected)
    assert path.stat().st_size < 20_000


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s["settings"].update(hop=7), "hop == 7, expected 200"),
        (lambda s: s["evidence"].update(sums=[1.0]), "expected 2 finite sums"),
        (lambda s: s["evidence"].update(time=np.inf), "expected 2 finite sums"),
        (lambda s: s["alarm"].update(sum=10**6), "expected a sum from 0 to"),
        (lambda s: s["stream"].update(rest=[[0.0] * 5] * 2), "that fit each other"),
        (lambda s: s["stream"].pop("next_start"), "next_start"),
        (
            lambda s: s["stream"].update(n_gaps="x"),
            "'x', expected an integer of at least 0",
        ),
        (lambda s: s["stream"].update(reference=[]), "damaged"),
        (lambda s: s["stream"].update(missing_seconds=-1.0), "that fit each other"),
        (lambda s: s["p_values"].update(weight=-1.0), "expected 1 finite sums"),
        (lambda s: s["settings"].update(healthy="worn"), "expected 'good'"),
        (lambda s: s["stream"].update(rest=[[0.0] * 150] * 3), "that fit each other"),
        (lambda s: s["qualities"].update(good=-3), "-3, expected an integer"),
        (lambda s: s.update(rpm="fast"), "damaged: could not convert"),
        (lambda s: s.clear(), "another monitor, or damaged: 'settings'"),
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


@pytest.mark.parametrize(
    "content",
    [
        b"[" * 10**6,  # RecursionError
        b"{",
        b"[]",
        b"\xff\xfe",
        pickle.dumps({}),
        b'{"format": "another", "facts": {}, "state": {}}',
        b'{"format": "skarxlag monitor 10", "facts": 3, "state": {}}',
        b'{"format": "skarxlag monitor 10", "facts": {}}',
    ],
    ids=range(8),
)
def test_files_that_hold_no_state_are_refused(content, tmp_path):
    path = tmp_path / "monitor.json"
    with pytest.raises(FileNotFoundError, match=r"monitor\.json: no such file"):
        load_monitor_state(path)
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"monitor\.json: no state of a monitor"):
        load_monitor_state(path)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "monitor.json"
    with path.open("wb") as file:
        file.truncate(2 * 10**8)
    with pytest.raises(
        ValueError, match=r"Number of bytes: .*, expected at most 104857600"
    ):
        load_monitor_state(path)


def test_memory_is_bounded_by_one_window(make):
    monitor = make()
    block = np.zeros(100 * WINDOW - 1)
    monitor.update(block)
    tracemalloc.start()
    for _ in range(3):
        monitor.update(block)
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # A view of the rest would keep the whole block.
    assert held < block.nbytes / 2


@pytest.mark.parametrize("dtype", [np.float32, np.int16, ">f8"])
def test_samples_of_any_real_type(make, dtype):
    signal = (1000 * sound("good", 1000, 3)).astype(dtype)
    expected = make().update(signal.astype(np.float64))
    assert repr(make().update(signal)) == repr(expected)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (["a"], "samples == '<U1 of shape"),
        (np.zeros(3, dtype=complex), "samples == 'complex128 of shape"),
        (np.zeros((1, 1, 3)), r"shape \(1, 1, 3\)"),
        (np.zeros((0, 3)), r"shape \(0, 3\)', expected 1 channels"),
        (np.zeros((2, 3)), r"shape \(2, 3\)', expected 1 channels as in fit"),
        (np.zeros((3, 1)), r"shape \(3, 1\)', expected 1 channels as in fit"),
    ],
)
def test_bad_samples_are_refused(make, samples, message):
    monitor = make()
    monitor.update([0.0])
    with pytest.raises(ValueError, match=message):
        monitor.update(samples)


@pytest.fixture(scope="module")
def of_two():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(40, 2, WINDOW))
    X[20:, 0] = X[20:, 0].cumsum(axis=1)
    return make_diagnoser(healthy="good").fit(X, np.repeat(["good", "worn"], 20)), X[:5]


def test_channels_of_the_model_are_expected(of_two):
    diagnoser, X = of_two
    signal = np.concatenate(list(X), axis=1)

    def monitor():
        return ConditionMonitor(diagnoser, RATE, window_length=WINDOW)

    found = fed(monitor(), [signal[:, :2], signal[:, 2:]])
    assert [v.window_verdict for v in found] == diagnoser.predict(X).tolist()
    with pytest.raises(ValueError, match="expected 2 channels as in fit"):
        monitor().update(signal[0])
    assert monitor().update([]) == []


@pytest.fixture(scope="module")
def with_speeds():
    """Detector that was fitted at two speeds."""
    healthy = make_windows(sound("good", 24_000, 2), WINDOW)
    with warnings.catch_warnings(action="ignore"):
        return make_detector().fit(healthy, rpm=np.repeat([800.0, 900.0], 60))


@pytest.mark.parametrize("rpm", [15.0, 1e9, 0.0, -900.0, np.nan, np.inf])
def test_implausible_speed_gets_no_verdict(rpm, make, diagnoser, with_speeds):
    signal = sound("good", 2000, 3)
    for model, watching in (
        (diagnoser, None),
        (diagnoser, with_speeds),
        (None, with_speeds),
    ):
        monitor = make(model, detector=watching, train_rpm=[850.0])
        good = monitor.update(signal[:1000], rpm=850.0)
        assert not any(str(v.verdict).startswith("no verdict") for v in good)
        refused = monitor.update(signal[1000:], rpm=rpm)
        assert {v.quality for v in refused} == {"no verdict"}
        for verdict in refused:
            assert verdict.verdict == verdict.window_verdict
            assert verdict.verdict.startswith(f"no verdict: speed {rpm:g} rpm is ")
            assert np.isnan(verdict.probability) and verdict.exceeds is None
            assert verdict.alarm_level == good[-1].alarm_level
        assert monitor.counts["windows"] == {"good": 5, "no verdict": 5}


def test_a_speed_for_each_sample(make):
    def update(rpm):
        return make(detector=None, train_rpm=[900.0]).update(signal, rpm=rpm)

    signal = sound("good", 2000, 3)
    rpm = np.linspace(850.0, 950.0, 2000)
    rpm[::7] = np.nan
    whole = update(rpm)
    middles = np.arange(100, 2000, 200)
    expected = [rpm[m] if np.isfinite(rpm[m]) else rpm[m - 1] for m in middles]
    assert [v.rpm for v in whole] == expected
    steps = np.repeat([900.0, np.nan, 910.0], [500, 300, 1200])
    assert [v.rpm for v in update(steps)] == [900.0] * 4 + [910.0] * 6
    unknown = np.r_[np.full(500, np.nan), np.full(1500, 900.0)]
    qualities = [v.quality for v in update(unknown)]
    assert qualities == ["no verdict"] * 2 + ["good"] * 8
    message = (
        r"rpm == \[900.0, 900.0, 900.0\], expected one number, or one for each of 2000"
    )
    with pytest.raises(ValueError, match=message):
        update([900.0] * 3)


def test_no_samples_are_no_trouble(make):
    monitor = make()
    assert monitor.update([]) == [] and monitor.update(np.zeros(0)) == []
    assert monitor.counts["samples"] == 0 and monitor.counts["windows"] == {}


@pytest.mark.parametrize(
    "setting",
    [
        {"window_length": 0}, {"hop": 0}, {"half_life": 0.0}, {"half_life": np.nan},
        {"false_alarm_interval": 0.0}, {"persistence": 1.0}, {"persistence": 0.0},
        {"alarm_delay": 0}, {"alarm_delay": 1001},
        {"alarm_delay": 2.5}, {"alarm_delay": True}, {"latch": "yes"},
    ],
    ids=str,
)  # fmt: skip
def test_bad_settings_are_named(make, setting):
    with pytest.raises((ValueError, TypeError), match=next(iter(setting))):
        make(**setting)


def test_sampling_rate_must_be_positive(diagnoser):
    with pytest.raises(ValueError, match="sampling_rate"):
        ConditionMonitor(diagnoser, 0.0)


def test_a_diagnoser_alone_and_a_detector_alone(make, detector):
    signal = sound("good", 1000, 3)
    last = make(detector=None).update(signal)[-1]
    assert last.window_verdict == "good" and last.alarm is False
    watching = make(None)
    last = watching.update(signal)[-1]
    assert (last.verdict, last.window_verdict) == ("healthy", None)
    assert last.alarm is False and watching.conditions == []


def test_a_classifier_of_others_names_conditions_and_raises_no_alarm(make):
    parts = [make_windows(sound(name, 2000, 5), WINDOW) for name in ("good", "worn")]
    other = CalibratedClassifierCV(make_diagnoser(), cv=2)
    monitor = make(
        other.fit(np.concatenate(parts), np.repeat([3, 4], 10)), detector=None
    )
    last = monitor.update(sound("worn", 1000, 6))[-1]
    assert last.verdict == 4 and type(last.verdict) is int
    assert (last.alarm, last.alarm_state) == (None, "none")
    assert np.isnan(last.alarm_level)
    assert monitor.alarm_delay is None and monitor.false_alarm_interval is None


def turning(n_rows, amplitude, seed, rpm=900.0):
    """Rows of three turns of a bearing 6205: noise, and impacts of the outer race."""
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n_rows, 2000))
    interval = 6e5 / (rpm * bearing_orders("6205")["outer"])
    for row in X:
        steps = np.append(rng.uniform(), rng.normal(1, 0.01, size=30))
        impacts = np.cumsum(interval * steps)
        row[impacts[impacts < 2000].astype(int)] += amplitude
    return X


@pytest.fixture(scope="module")
def by_orders():
    classifier = FaultOrderClassifier(bearing="6205", sampling_rate=10_000.0)
    return classifier.fit(turning(20, 0, 0), ["healthy"] * 20, rpm=900)


def test_faint_combs_are_joined_and_forgotten(by_orders):
    monitor = ConditionMonitor(by_orders, 1e4, window_length=2000, half_life=3.0)
    healthy, faint = turning(40, 0, 1), turning(40, 6.0, 2)
    before, during, after = (
        monitor.update(rows.ravel(), rpm=900) for rows in (healthy, faint, healthy)
    )
    assert {v.verdict for v in before} == {"healthy"}
    assert {v.verdict for v in during[20:]} == {"outer"}
    # One by one, few of the same windows are named.
    assert sum(v.window_verdict == "outer" for v in during[20:]) < 5
    # The mean scatters less than one window, and the name is surer.
    alone = by_orders.predict_proba(faint, rpm=900).max(axis=1)
    assert during[-1].probability > alone.mean()
    assert after[-1].verdict == "healthy"


@pytest.mark.filterwarnings("ignore:.* are too few:UserWarning")
@pytest.mark.filterwarnings(
    "ignore:All rows of condition .* have one speed:UserWarning"
)
def test_learned_spectra_and_combs_are_joined():
    X = np.concatenate([turning(10, 0, 0), turning(10, 20.0, 1)])
    model = make_diagnoser(bearing="6205", sampling_rate=1e4)
    model.fit(X, np.repeat(["healthy", "outer"], 10), rpm=900)
    monitor = ConditionMonitor(model, 1e4, window_length=2000, half_life=np.inf)
    rows = turning(5, 20.0, 2)
    last = monitor.update(rows.ravel(), rpm=900)[-1]
    evidence = model.diagnose(rows, rpm=900).row_evidence.mean(axis=0, keepdims=True)
    joined = model["decide"].join(evidence, 5)
    assert last.verdict == joined.verdict[0] == "outer"
    assert last.probability == pytest.approx(joined.probability.max())


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", ["by_orders", "make"])
def test_a_restart_after_each_block_changes_nothing(request, name, seed):
    """Blocks with a speed, with speeds of samples, with missing ones, with none, and with gaps."""
    model = request.getfixturevalue(name)

    def monitor():
        if name == "make":
            return model()
        return ConditionMonitor(model, 1e4, window_length=2000, hop=1500)

    rng = np.random.default_rng(seed)
    unbroken, restarted = monitor(), monitor()
    for one in (unbroken, restarted):
        one.update([], rpm=900.0)
    time = 0.0
    for block in random_blocks(turning(12, 6.0, seed).ravel(), seed, 4000):
        slope = np.linspace(0, rng.uniform(-90, 90), len(block))
        speeds = rng.uniform(850, 950) + slope
        missing = np.where(rng.random(len(block)) < 0.1, np.nan, speeds)
        rpm = [None, 900.0, speeds, missing][rng.integers(4)]
        stated = time if rng.random() < 0.8 else None
        time += len(block) / 1e4 + rng.choice([0.0, 5.0], p=[0.9, 0.1])
        verdicts = [
            one.update(block, rpm=rpm, time=stated) for one in (unbroken, restarted)
        ]
        assert repr(verdicts[0]) == repr(verdicts[1])
        state = json.loads(json.dumps(restarted.state()))
        restarted = monitor().restore(state)
        assert restarted.counts == unbroken.counts
