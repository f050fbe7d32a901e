import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skarxlag import estimate_shaft_speed, rpm_from_tacho
from skarxlag.core.speeds import speed_errors

RATE = 10_000


def vibration(rpm, seed=0, seconds=2, n_harmonics=12, noise=1.0):
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * rpm / 60 * np.arange(seconds * RATE) / RATE
    phases = rng.uniform(0, 2 * np.pi, n_harmonics)
    tones = sum(0.3 * np.cos((h + 1) * turn + phase) for h, phase in enumerate(phases))
    return tones + noise * rng.normal(size=len(turn))


@pytest.mark.parametrize("factor", [0.91, 0.98, 1.0, 1.03, 1.09])
@pytest.mark.parametrize("rpm", [300, 1200])
def test_speed_is_found_near_a_wrong_nominal_value(rpm, factor):
    X = [vibration(rpm, seed) for seed in range(3)]
    found = estimate_shaft_speed(X, RATE, np.full(3, rpm / factor))
    # The cells of the spectrum are half a hertz wide; twelve harmonics divide them.
    assert_allclose(found, rpm, rtol=8e-3)


@pytest.mark.parametrize("factor", [1e-300, 1e300])
def test_scale_does_not_matter(factor):
    X = vibration(600)[np.newaxis]
    expected = estimate_shaft_speed(X, RATE, 590)
    assert_allclose(estimate_shaft_speed(factor * X, RATE, 590), expected)
    both = np.stack([X, np.zeros_like(X)], axis=1)
    assert_array_equal(estimate_shaft_speed(both, RATE, 590), expected)


def test_harmonics_above_half_the_sampling_rate_do_not_count():
    X = vibration(600, noise=8.0)[np.newaxis]
    assert abs(estimate_shaft_speed(X, RATE, 630)[0] - 600) < 2
    assert np.isfinite(estimate_shaft_speed(X, 100, 600)).all()


def test_constant_signals_give_some_speed_in_range():
    found = estimate_shaft_speed(np.full((1, 5000), 3.0), RATE, 600)
    assert 540 < found[0] < 665


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rpm": 0}, "rpm of row 0: 0"),
        ({"rpm": 50}, "Turns in 20000 samples at 50 rpm"),
        ({"rpm": np.full((1, 20_000), 600)}, "one speed for each stretch"),
        ({"sampling_rate": 0}, "sampling_rate"),
    ],
)
def test_bad_input(arguments, message):
    defaults = {"sampling_rate": RATE, "rpm": 600}
    with pytest.raises(ValueError, match=message):
        estimate_shaft_speed(vibration(600)[np.newaxis], **(defaults | arguments))


@pytest.mark.parametrize("rpm", [30 * RATE + 1, 1e12, 1e300])
def test_a_turn_takes_two_samples_at_least(rpm):
    with pytest.raises(
        ValueError, match=r"sampling_rate == 10000, expected at least .* Hz"
    ):
        estimate_shaft_speed(vibration(600)[np.newaxis], RATE, rpm)


def test_tacho_with_noise_offset_and_any_unit():
    rng = np.random.default_rng(0)
    time = np.arange(20_000) / 10_000
    pulses = (np.sin(2 * np.pi * 25 * time) > 0.8) + 0.05 * rng.normal(size=time.shape)
    found = rpm_from_tacho(pulses, 10_000)
    assert_allclose(found, 1500, rtol=0.02)
    for scale in (1e-300, 1e300):
        assert_allclose(rpm_from_tacho(scale * pulses, 10_000), found)
    read_only = np.repeat(pulses.astype(np.float32), 2)[::2]
    read_only.flags.writeable = False
    assert_allclose(rpm_from_tacho(read_only, 10_000), found, rtol=1e-4)


def test_tacho_by_hand():
    pulses = [0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1]
    # Pulses rise at 1.5, 5.5 and 11.5 samples: 4 and 6 samples a turn, at 3.5 and 8.5
    # samples.
    speeds = rpm_from_tacho(pulses, 2)
    assert_allclose(speeds[[0, 3, 6, 9, 13]], [30, 30, 25, 20, 20])


@pytest.mark.parametrize(
    ("tacho", "options", "message"),
    [
        (np.zeros(100), {}, "Number of pulses in 100 samples of tacho: 0"),
        ([0, 1, 1, 0], {}, "of tacho: 1, expected at least 2"),
        ([[0, 1], [1, 0]], {}, r"tacho.shape == \(2, 2\)"),
        ([0, np.nan, 1], {}, "tacho contains NaN"),
        ([0, 1], {"sampling_rate": 0}, "sampling_rate == 0"),
        ([0, 1], {"pulses_per_revolution": 0}, "pulses_per_revolution == 0"),
    ],
)
def test_tacho_that_states_no_speed(tacho, options, message):
    with pytest.raises(ValueError, match=message):
        rpm_from_tacho(tacho, **({"sampling_rate": 100} | options))


def test_plausible_speeds_are_within_a_factor_of_5():
    trained = [600.0, 1200.0]
    rpm = np.array([120.0, 119.9, 6000.0, 6000.1])
    errors = speed_errors(rpm, 4, trained)
    assert (errors == "").tolist() == [True, False, True, False]
    assert (speed_errors(rpm, 4) == "").all()
    # Every sample of a row must be plausible.
    rows = np.array([[600.0, 700.0], [600.0, 1.0], [np.nan, 600.0]])
    assert (speed_errors(rows, 3, trained) == "").tolist() == [True, False, False]
    with pytest.raises(ValueError, match=r"rpm.shape == \(4,\)"):
        speed_errors(rpm, 3, trained)
    with pytest.raises(ValueError, match="rpm must hold numbers, got 'fast'"):
        speed_errors("fast", 3)


def test_a_speed_that_varies_too_much_within_a_row():
    speeds = np.outer([1.0, 1.0], np.geomspace(300, 1500, 50))
    speeds[1, -1] = 1501
    assert speed_errors(speeds, 2).tolist() == [
        "",
        "speed varies from 300 to 1501 rpm within the row",
    ]
