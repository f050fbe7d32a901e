"""The simulated rig as a machine: every physical parameter seen in its output."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.signal import find_peaks, welch

from skarxlag.bearings import (
    SKF_6205,
    BearingGeometry,
    contact_speed,
    defect_frequencies,
)
from skarxlag.datasets.rig import Rig, defect_emission
from skarxlag.datasets.simulated import simulate_rig
from skarxlag.datasets.strikes import impact_velocity, simulate_strikes, transit_time
from skarxlag.datasets.transmission import (
    TransmissionPath,
    TransmissionPaths,
    impulse_response,
)

SAMPLING_RATE = 250e3
LEVELS = ("impact_level", "friction_level", "rubbing_level", "noise_level")
SILENT = dict.fromkeys(LEVELS, 0.0) | {"torque_leak": ()}
# One well damped mode at every place, so that a strike is a single short pulse.
PULSE = TransmissionPath((20e3,), (0.5,), (1.0,), gain=1.0, delay=0.0)
PULSES = TransmissionPaths(outer=PULSE, inner=PULSE, ball=PULSE)


def record(condition="OR", *, rpm=500, crack_mm=3, n_samples=120_000, **parameters):
    """Emission and torque of one recording in which only what is asked for makes a sound."""
    data = simulate_rig(
        rpm=rpm,
        crack_mm=crack_mm,
        conditions=condition,
        n_samples=n_samples,
        rig=Rig(**(SILENT | parameters)),
    ).data
    return data[:, 0].ravel(), data[:, 1].ravel()


def strike_instants(emission, height=0.05):
    return find_peaks(emission, height=height * emission.max(), distance=100)[0]


def centroid(emission):
    frequencies, power = welch(emission, fs=SAMPLING_RATE, nperseg=2048)
    return np.sum(frequencies * power) / np.sum(power)


@pytest.mark.parametrize("rpm", [300, 500])
@pytest.mark.parametrize(
    ("condition", "location"), [("OR", "outer"), ("IR", "inner"), ("Ball", "ball")]
)
def test_strikes_come_at_the_defect_frequency(condition, location, rpm):
    # A wide load zone, so that no strike is missed.
    emission, _ = record(
        condition,
        rpm=rpm,
        n_samples=600_000,
        paths=PULSES,
        impact_level=1.0,
        entry_ratio=0.0,
        load_distribution=10.0,
    )
    expected = 2.4 * defect_frequencies(SKF_6205, rpm)[location]
    assert abs(len(strike_instants(emission)) - expected) < 1 + 4 * 0.01 * np.sqrt(
        expected
    )


def test_bearing_sets_the_strike_rate():
    bearing = BearingGeometry(n_elements=13, element_diameter=9.0, pitch_diameter=46.0)
    emission, _ = record(
        bearing=bearing,
        paths=PULSES,
        impact_level=1.0,
        entry_ratio=0.0,
        n_samples=600_000,
    )
    # By hand: 13 / 2 * 500 / 60 * (1 - 9 / 46) Hz over 2.4 s.
    assert len(strike_instants(emission)) == pytest.approx(104.6, abs=1.5)


@pytest.mark.parametrize("slip", [0.0, 0.02])
def test_slip_spreads_the_intervals(slip):
    emission, _ = record(
        paths=PULSES, impact_level=1.0, entry_ratio=0.0, n_samples=1_200_000, slip=slip
    )
    intervals = np.diff(strike_instants(emission))
    assert intervals.std() / intervals.mean() == pytest.approx(slip, rel=0.15, abs=1e-4)


def test_load_distribution_sets_how_many_strikes_of_the_inner_ring_are_heard():
    counts = []
    for load_distribution in (0.25, 10.0):
        emission, _ = record(
            "IR",
            paths=PULSES,
            impact_level=1.0,
            entry_ratio=0.0,
            n_samples=1_200_000,
            load_distribution=load_distribution,
        )
        counts.append(len(strike_instants(emission, height=0.001)))
    # cos(psi) > 1 - 2 * 0.25 holds over a third of the turn.
    assert counts[0] / counts[1] == pytest.approx(1 / 3, abs=0.03)


@pytest.mark.parametrize("location", ["outer", "inner", "ball"])
def test_strikes_are_responses_set_off_at_entry_and_impact(location):
    rig = Rig(**(SILENT | {"slip": 0.02, "impact_level": 2.0}))
    rpm, crack_mm, n_samples = 500.0, 6.0, 12_000
    path = getattr(rig.paths, location)
    response = impulse_response(path, SAMPLING_RATE)
    peak = 2.0 * path.gain * impact_velocity(SKF_6205, rpm, crack_mm)
    for seed in range(20):
        emission = defect_emission(
            rig,
            rpm,
            location,
            crack_mm,
            n_samples,
            lambda _, seed=seed: np.random.default_rng(seed),
        )
        rng = np.random.default_rng(seed)
        times, load = simulate_strikes(
            rig, rpm, location, n_samples / SAMPLING_RATE, 0.2, rng
        )
        expected = np.zeros(n_samples)
        for time, force in zip(times, load, strict=True):
            transit = transit_time(SKF_6205, rpm, crack_mm)
            for instant, strength in ((time, 0.3), (time + transit, 1.0)):
                first = int(np.floor(instant * SAMPLING_RATE))
                taps = np.arange(len(response)) + first
                heard = (taps >= 0) & (taps < n_samples)
                expected[taps[heard]] += strength * force * peak * response[heard]
        np.testing.assert_allclose(emission, expected, atol=1e-6 * peak)


@pytest.mark.parametrize(("rpm", "crack_mm"), [(300, 3), (500, 3), (500, 6)])
def test_impact_level_is_the_peak_for_a_unit_impact_velocity(rpm, crack_mm):
    emission, _ = record(rpm=rpm, crack_mm=crack_mm, impact_level=0.7, entry_ratio=0.0)
    expected = 0.7 * impact_velocity(SKF_6205, rpm, crack_mm)
    assert np.abs(emission).max() == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("crack_mm", [3, 6])
def test_a_wider_crack_puts_more_time_between_entry_and_impact(crack_mm):
    emission, _ = record(
        paths=PULSES, crack_mm=crack_mm, impact_level=1.0, entry_ratio=0.5
    )
    instants = strike_instants(emission)
    heights = emission[instants]
    entries = np.flatnonzero(heights < 0.75 * heights.max())
    entries = entries[entries + 1 < len(instants)]
    assert len(entries) > 10
    gaps = instants[entries + 1] - instants[entries]
    transit = transit_time(SKF_6205, 500, crack_mm) * SAMPLING_RATE
    assert np.abs(gaps - transit).max() <= 1
    np.testing.assert_allclose(heights[entries] / heights[entries + 1], 0.5, rtol=1e-3)


def test_paths_set_gain_and_delay():
    near = record(paths=PULSES, impact_level=1.0)[0]
    far = replace(PULSE, gain=0.25, delay=40e-6)
    distant = record(paths=replace(PULSES, outer=far), impact_level=1.0)[0]
    np.testing.assert_allclose(distant[10:], 0.25 * near[:-10], atol=1e-12)
    other = record(paths=replace(PULSES, inner=far, ball=far), impact_level=1.0)[0]
    np.testing.assert_array_equal(other, near)


@pytest.mark.parametrize("source", ["impact_level", "rubbing_level"])
@pytest.mark.parametrize(
    ("condition", "location"), [("OR", "outer"), ("IR", "inner"), ("Ball", "ball")]
)
def test_spectrum_peaks_at_the_modes_of_the_place(source, condition, location):
    emission, _ = record(condition, n_samples=600_000, **{source: 1.0})
    frequencies, power = welch(emission, fs=SAMPLING_RATE, nperseg=1024)
    path = getattr(TransmissionPaths(), location)
    prominent = frequencies[find_peaks(np.log(power), prominence=0.3)[0]]
    for mode, damping in zip(path.frequencies, path.damping, strict=True):
        if damping < 0.05:
            assert np.abs(prominent / mode - 1).min() < 0.04


@pytest.mark.parametrize("rpm", [300, 500])
def test_friction_grows_with_the_speed(rpm):
    emission, _ = record("Normal", rpm=rpm, friction_level=0.02, n_samples=600_000)
    gains = np.array([1.0, 0.4, 0.6])
    expected = 0.02 * contact_speed(SKF_6205, rpm) * np.sqrt(np.sum(gains**2))
    assert emission.std() == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("condition", "gain"), [("OR", 1.0), ("IR", 0.4), ("Ball", 0.6)]
)
@pytest.mark.parametrize("crack_mm", [3, 6])
def test_rubbing_grows_with_the_crack(condition, gain, crack_mm):
    emission, _ = record(
        condition, crack_mm=crack_mm, rubbing_level=0.01, n_samples=600_000
    )
    expected = 0.01 * crack_mm * contact_speed(SKF_6205, 500) * gain
    assert emission.std() == pytest.approx(expected, rel=0.03)


def test_shorter_asperities_and_faster_contacts_emit_higher_frequencies():
    rough, fine = (
        record("Normal", friction_level=0.02, asperity_um=length)[0]
        for length in (20.0, 1.0)
    )
    assert centroid(fine) > 1.3 * centroid(rough)
    slow = record("Normal", friction_level=0.02, rpm=300)[0]
    fast = record("Normal", friction_level=0.02, rpm=500)[0]
    assert centroid(fast) > 1.02 * centroid(slow)


def test_noise_level_is_the_rms_of_white_noise():
    emission, _ = record("Normal", noise_level=2e-3)
    assert emission.std() == pytest.approx(2e-3, rel=0.02)
    assert abs(np.corrcoef(emission[1:], emission[:-1])[0, 1]) < 0.02


def test_torque_leak_is_recovered_by_least_squares_from_input_to_output():
    leak = np.array([0.10, 0.05, -0.05, -0.10])
    emission, torque = record("Normal", torque_leak=leak)
    lags = np.column_stack([np.roll(torque, lag) for lag in range(8)])[8:]
    coefficients = np.linalg.lstsq(lags, emission[8:], rcond=None)[0]
    # Strictly causal: nothing at lag 0, the leak at lags 1 to 4, nothing after.
    np.testing.assert_allclose(coefficients, [0, *leak, 0, 0, 0], atol=1e-10)


def test_torque_leak_is_recovered_under_friction_and_noise():
    leak = np.array([0.10, 0.05, -0.05, -0.10])
    emission, torque = record(
        "Normal",
        torque_leak=leak,
        friction_level=0.02,
        noise_level=5e-4,
        n_samples=600_000,
    )
    lags = np.column_stack([np.roll(torque, lag) for lag in range(1, 5)])[5:]
    coefficients = np.linalg.lstsq(lags - lags.mean(axis=0), emission[5:], rcond=None)[
        0
    ]
    # Standard error: RMS of the rest over RMS of the fluctuation and the root of the
    # length.
    tolerance = 5 * emission.std() / 0.02 / np.sqrt(600_000)
    np.testing.assert_allclose(coefficients, leak, atol=tolerance)
    assert tolerance < 0.01


def test_torque_is_measured_in_the_second_channel():
    # At 500 rpm a turn is 30,000 samples, so every order of the shaft is a line of its
    # own.
    torque = record("Normal", n_samples=600_000)[1]
    lines = np.fft.rfft(torque) / len(torque)
    ripples = {0: 2.0, 20: 0.02, 240: 0.01, 500: 0.01}
    for line, amplitude in ripples.items():
        assert abs(lines[line]) == pytest.approx(amplitude, abs=1e-4)
    lines[list(ripples)] = 0
    rest = np.fft.irfft(lines * len(torque))
    assert rest.std() == pytest.approx(0.02, rel=0.02)
    assert abs(np.corrcoef(rest[1:], rest[:-1])[0, 1]) < 0.02


def test_sampling_rate_is_the_density_of_the_samples():
    shared = {"paths": PULSES, "impact_level": 1.0, "entry_ratio": 0.0, "slip": 0.0}
    coarse, fine = (
        np.diff(strike_instants(record(**shared, sampling_rate=rate)[0])).mean()
        for rate in (125e3, 250e3)
    )
    assert fine / coarse == pytest.approx(2.0, rel=1e-3)


@pytest.mark.parametrize("name", LEVELS)
def test_sources_do_not_disturb_one_another(name):
    others = {"impact_level": 0.5, "friction_level": 0.02, "rubbing_level": 0.01}
    sources = others | {"noise_level": 5e-4, "torque_leak": (0.1, -0.1)}
    together, _ = record(**sources)
    without, _ = record(**(sources | {name: 0.0}))
    alone, _ = record(**{name: sources[name]})
    assert np.abs(alone).max() > 1e-3
    np.testing.assert_allclose(together - without, alone, atol=1e-12)


def test_sources_are_independent_of_one_another():
    short = {"paths": PULSES, "n_samples": 24_000}
    signals = [record(**short, **{name: 1.0})[0] for name in LEVELS]
    signals.append(record(**short)[1])
    spectra = [np.fft.rfft(np.diff(signal)) for signal in signals]
    for first, second in combinations(spectra, 2):
        correlation = np.fft.irfft(first * second.conj())
        scale = np.sqrt(np.mean(np.abs(first) ** 2) * np.mean(np.abs(second) ** 2))
        assert np.abs(correlation).max() < 0.1 * scale
