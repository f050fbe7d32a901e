import numpy as np
import pytest

from skarxlag.bearings import SKF_6205, BearingGeometry, defect_frequencies
from skarxlag.datasets.rig import Rig
from skarxlag.datasets.strikes import (
    impact_velocity,
    load_distribution_at,
    simulate_strikes,
    transit_time,
)

LOCATIONS = ("outer", "inner", "ball")


def strikes(location, seed=0, *, duration=100.0, before=0.0, **parameters):
    rng = np.random.default_rng(seed)
    return simulate_strikes(Rig(**parameters), 400.0, location, duration, before, rng)


@pytest.mark.parametrize("bearing", [SKF_6205, BearingGeometry(13, 9.0, 46.0)])
@pytest.mark.parametrize("location", LOCATIONS)
def test_mean_rate_is_the_defect_frequency(location, bearing):
    times, _ = strikes(location, slip=0.02, bearing=bearing)
    expected = 100.0 * defect_frequencies(bearing, 400.0)[location]
    assert abs(len(times) - expected) < 1 + 4 * 0.02 * np.sqrt(expected)


@pytest.mark.parametrize("slip", [0.0, 0.01, 0.02])
def test_slip_is_the_relative_deviation_of_an_interval(slip):
    times, _ = strikes("inner", slip=slip)
    intervals = np.diff(times) * defect_frequencies(SKF_6205, 400.0)["inner"]
    assert intervals.std() == pytest.approx(slip, rel=0.05, abs=1e-9)


def test_slip_accumulates_as_a_random_walk():
    rate = defect_frequencies(SKF_6205, 400.0)["outer"]
    runs = [strikes("outer", seed=seed, duration=5.0)[0] for seed in range(400)]
    for n_intervals in (9, 81):
        deviation = np.std([times[n_intervals] - times[0] for times in runs]) * rate
        assert deviation == pytest.approx(0.01 * np.sqrt(n_intervals), rel=0.15)


@pytest.mark.parametrize("location", LOCATIONS)
@pytest.mark.parametrize(("slip", "duration"), [(0.01, 3.0), (0.1, 60.0)])
def test_strikes_fill_the_time_span_to_both_ends(location, slip, duration):
    interval = 1 / defect_frequencies(SKF_6205, 400.0)[location]
    longest = (1 + 6 * slip) * interval
    for seed in range(10):
        times, load = strikes(
            location, seed=seed, duration=duration, before=2.0, slip=slip
        )
        assert -2.0 <= times[0] < -2.0 + longest
        assert duration - longest < times[-1] < duration
        assert 0 < np.diff(times).min() < np.diff(times).max() < longest
        assert load.shape == times.shape


def test_what_came_before_does_not_change_what_comes():
    times, load = strikes("inner")
    longer_times, longer_load = strikes("inner", before=1.0)
    np.testing.assert_array_equal(longer_times[longer_times >= 0], times)
    np.testing.assert_array_equal(longer_load[longer_times >= 0], load)


@pytest.mark.parametrize(
    ("degrees", "factor", "expected"),
    [
        (0, 0.5, 1.0),
        (60, 0.5, 0.5**1.5),
        (120, 0.5, 0.0),
        (90, 1.0, 0.5**1.5),
        (180, 2.0, 0.5**1.5),
        (60, 0.2, 0.0),
    ],
)
def test_load_distribution_by_hand(degrees, factor, expected):
    assert load_distribution_at(np.deg2rad(degrees), factor) == pytest.approx(
        expected, abs=1e-12
    )


def test_defect_of_the_outer_ring_stays_under_the_largest_load():
    _, load = strikes("outer")
    assert np.all(load == 1.0)


@pytest.mark.parametrize(
    ("location", "turns"), [("inner", 400 / 60), ("ball", 0.39828 * 400 / 60)]
)
def test_load_repeats_with_the_shaft_or_the_cage(location, turns):
    times, load = strikes(location)
    candidates = np.array([0.9, 1.0, 1.1]) * turns
    lines = np.abs(np.exp(-2j * np.pi * np.outer(candidates, times)) @ load) / len(load)
    # The half-wave's first harmonic: hand-computed mean of q(psi) cos(psi) at factor
    # 0.5.
    angle = np.linspace(-np.pi, np.pi, 20_001)[:-1]
    harmonic = np.mean(np.clip(np.cos(angle), 0, None) ** 1.5 * np.cos(angle))
    assert lines[1] == pytest.approx(harmonic, rel=0.03)
    assert lines[[0, 2]].max() < 0.1 * lines[1]


@pytest.mark.parametrize(("factor", "angle"), [(0.5, 180.0), (0.25, 120.0)])
def test_load_distribution_sets_the_share_of_loaded_strikes(factor, angle):
    _, load = strikes("inner", load_distribution=factor)
    assert np.mean(load > 0) == pytest.approx(angle / 360, abs=0.02)


def test_transit_time_inverts_the_published_formula_of_the_spall_size():
    shaft, pitch, ball = 300.0 / 60, 39.04, 7.94
    contact = np.pi * shaft * (pitch**2 - ball**2) / pitch
    assert contact * transit_time(SKF_6205, 300.0, 3.0) == pytest.approx(3.0)


def test_impact_velocity_grows_with_crack_and_speed():
    velocity = impact_velocity(SKF_6205, 250.0, 3.0)
    assert impact_velocity(SKF_6205, 250.0, 6.0) == pytest.approx(2 * velocity)
    assert impact_velocity(SKF_6205, 500.0, 3.0) == pytest.approx(2 * velocity)
    # A crack as wide as the ball is met at the full contact speed.
    full = impact_velocity(SKF_6205, 300.0, SKF_6205.element_diameter)
    assert full == pytest.approx(np.pi * 5 * 19.52e-3 * (1 - (7.94 / 39.04) ** 2))


@pytest.mark.parametrize("location", LOCATIONS)
@pytest.mark.parametrize("rpm", [300, 400, 450, 500])
def test_a_window_of_the_default_rig_is_shorter_than_the_interval_between_strikes(
    location, rpm
):
    interval = 1 / defect_frequencies(SKF_6205, rpm)[location]
    assert interval > 1200 / 250e3
    assert 22e-3 < interval < 56e-3
    # An impact belongs to the entry before it, not to the next one.
    assert (
        3e-3 < transit_time(SKF_6205, rpm, 3) < transit_time(SKF_6205, rpm, 6) < 10.3e-3
    )
