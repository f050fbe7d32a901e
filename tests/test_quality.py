import numpy as np
import pytest

from skarxlag import (
    make_alpio,
    make_diagnoser,
    make_stretch_diagnoser,
    signal_quality,
    window_verdicts,
)

rng = np.random.default_rng(0)
NOISE = rng.normal(size=(6, 1200))


def one(window, **arguments):
    return signal_quality(np.asarray(window)[np.newaxis], **arguments)[0]


@pytest.mark.parametrize("factor", [1.0, -3.0, 1e300, 1e-300])
@pytest.mark.parametrize("offset", [0.0, 100.0])
def test_every_kind_in_any_unit(factor, offset):
    windows = np.concatenate([NOISE, NOISE[:1]])
    windows[1] = 0.3
    windows[2, 500:] = windows[2, 500]
    windows[3] = np.round(windows[3] / 2)
    windows[4] = windows[4].clip(-1.5, 1.5)
    windows[5, 7] = np.nan
    found = signal_quality(factor * (windows + offset))
    assert found.tolist() == ["good", "constant", "held", "coarse", "clipped", "not finite", "good"]


@pytest.mark.parametrize("value", [0.0, 5.0, -1e308, 0.1])
def test_dead_sensor(value):
    assert one(np.full(300, value)) == "constant"
    # What is left when a mean is taken off is rounding.
    assert one(np.full(300, value) * (1 + 2e-16 * rng.integers(0, 2, size=300))) == "constant"


def test_range_of_the_largest_numbers():
    assert one(1.7e308 * np.sign(NOISE[0]) * rng.uniform(0.5, 1, size=1200)) == "good"


def test_dropouts_are_tolerated_up_to_the_stated_share():
    window = NOISE[0].copy()
    window[100:500] = 0.0
    assert one(window) == "good"
    assert one(window, held_share=0.3) == "held"


def test_clipping_is_tolerated_up_to_the_stated_share():
    window = NOISE[0].clip(-2.6, 2.6)
    assert one(window) == "good"
    assert one(window, clipped_share=0.001) == "clipped"
    assert one(NOISE[0].clip(-9, 1)) == "clipped"


def test_one_step_of_a_16_bit_converter_is_no_fault_of_a_signal():
    assert one(np.round(NOISE[0] * 30).astype(np.int16)) == "good"
    assert one(np.round(NOISE[0] * 0.4).astype(np.int16)) == "held"
    assert one(np.round(NOISE[0] * 0.8).astype(np.int16)) == "coarse"


def test_inputs_may_be_constant_but_not_nan():
    windows = np.stack([NOISE, np.full_like(NOISE, 40.0)], axis=1)
    windows[2, 1, 3] = np.inf
    windows[3, 0] = 1.0
    found = signal_quality(windows)
    assert found.tolist() == ["good", "good", "not finite", "constant", "good", "good"]


@pytest.mark.parametrize("n_samples", [2, 3, 5, 63])
def test_short_windows_are_good(n_samples):
    assert set(signal_quality(rng.normal(size=(200, n_samples)))) == {"good"}


def test_type_and_layout_do_not_matter():
    windows = np.concatenate([NOISE, NOISE.clip(-1, 1)])
    expected = signal_quality(windows)
    for other in (
        windows.astype(">f4"),
        windows.astype(np.float32),
        np.asfortranarray(windows),
        windows.tolist(),
    ):
        assert signal_quality(other).tolist() == expected.tolist()
    windows.flags.writeable = False
    assert signal_quality(windows).tolist() == expected.tolist()


def test_windows_are_judged_one_by_one():
    windows = np.tile(NOISE, (30, 1))
    windows[::7] = 0
    assert signal_quality(windows).tolist() == [one(w) for w in windows]


def test_good_windows_are_what_a_diagnoser_can_be_asked_about():
    windows = NOISE.copy()
    windows[1, 5] = np.nan
    diagnoser = make_alpio().fit(NOISE, list("aaabbb"))
    with pytest.raises(ValueError, match="NaN"):
        diagnoser.predict(windows)
    assert len(diagnoser.predict(windows[signal_quality(windows) == "good"])) == 5


@pytest.mark.parametrize(
    ("X", "arguments", "message"),
    [
        (NOISE, {"clipped_share": 0.0}, "clipped_share == 0"),
        (NOISE, {"held_share": 1.5}, r"held_share == 1\.5"),
        (NOISE[0], {}, "Expected 2D array"),
        (NOISE[np.newaxis, np.newaxis], {}, r"X has shape \(1, 1, 6, 1200\)"),
    ],
)
def test_errors_name_what_is_wrong(X, arguments, message):
    with pytest.raises(ValueError, match=message):
        signal_quality(X, **arguments)


def silent_windows():
    """One window each: dead, stuck at a value, of dropouts, of few levels, saturated."""
    window = np.random.default_rng(5).normal(size=1200)
    silent = np.tile(window, (5, 1))
    silent[0], silent[1], silent[2, 300:], silent[3] = 0, 3.3, 0, np.round(window / 2)
    silent[4] = window.clip(-0.5, 0.5)
    assert "good" not in signal_quality(silent)
    return silent


@pytest.mark.parametrize("make", [make_alpio, make_diagnoser, make_stretch_diagnoser])
def test_window_without_a_signal_gets_no_verdict(make):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(12, 1200))
    X[6:] = X[6:].cumsum(axis=1)
    diagnoser = make().fit(X, np.repeat(["good", "worn"], 6))
    found = window_verdicts(diagnoser, np.concatenate([X[:1], silent_windows(), X[-1:]]))
    assert found["verdict"].tolist() == ["good", *["no signal"] * 5, "worn"]
    assert found.loc[1:5, ["probability of good", "probability of worn"]].isna().all(axis=None)


def test_channels_after_the_first_may_be_constant():
    rng = np.random.default_rng(0)
    X = np.stack([rng.normal(size=(12, 400)), np.full((12, 400), 7.0)], axis=1)
    X[6:, 0] = X[6:, 0].cumsum(axis=1)
    diagnoser = make_diagnoser().fit(X, np.repeat(["good", "worn"], 6))
    X[0, 0], X[0, 1] = 1.0, rng.normal(size=400)
    found = window_verdicts(diagnoser, X)
    assert found["verdict"].tolist() == ["no signal", *["good"] * 5, *["worn"] * 6]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_one_huge_sample_hides_the_others(dtype):
    noise = np.random.default_rng(0).normal(size=(2, 400)).astype(dtype)
    noise[1, 17] = np.finfo(dtype).max / 2
    assert signal_quality(noise).tolist() == ["good", "held"]
