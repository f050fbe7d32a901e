"""The simulated rig as a machine: every physical parameter seen in its output."""

from functools import partial

import numpy as np
import pytest
from scipy.signal import welch

from skarxlag.bearings import SKF_6205, contact_speed
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
# One well damped mode at every location, so that a strike is a single short pulse.
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


def generator(seed, name):
    return np.random.default_rng(seed)


def centroid(emission):
    frequencies, power = welch(emission, fs=SAMPLING_RATE, nperseg=2048)
    return np.sum(frequencies * power) / np.sum(power)


@pytest.mark.parametrize("location", ["outer", "inner", "ball"])
@pytest.mark.parametrize(("sampling_rate", "entry_ratio"), [(250e3, 0.3), (200e3, 0.5)])
def test_strikes_are_responses_set_off_at_entry_and_impact(
    location, sampling_rate, entry_ratio
):
    facts = {"slip": 0.02, "impact_level": 2.0, "entry_ratio": entry_ratio}
    rig = Rig(**(SILENT | facts), sampling_rate=sampling_rate)
    rpm, crack_mm, n_samples = 500.0, 6.0, 12_000
    path = getattr(rig.paths, location)
    response = impulse_response(path, sampling_rate)
    transit = transit_time(SKF_6205, rpm, crack_mm)
    peak = 2.0 * path.gain * impact_velocity(SKF_6205, rpm, crack_mm)
    for seed in range(3):
        generators = partial(generator, seed)
        emission = defect_emission(rig, rpm, location, crack_mm, n_samples, generators)
        duration = n_samples / sampling_rate
        times, load = simulate_strikes(
            rig, rpm, location, duration, 0.2, generators("strikes")
        )
        expected = np.zeros(n_samples)
        for time, force in zip(times, load, strict=True):
            for instant, strength in ((time, entry_ratio), (time + transit, 1.0)):
                first = int(np.floor(instant * sampling_rate))
                taps = np.arange(len(response)) + first
                heard = (taps >= 0) & (taps < n_samples)
                expected[taps[heard]] += strength * force * peak * response[heard]
        np.testing.assert_allclose(emission, expected, atol=1e-6 * peak)


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


def test_torque_is_measured_in_the_second_channel():
    # At 500 rpm and 200 kHz a turn is 24,000 samples, so every order of the shaft is a
    # line of its own.
    torque = record("Normal", n_samples=480_000, sampling_rate=200e3)[1]
    lines = np.fft.rfft(torque) / len(torque)
    ripples = {0: 2.0, 20: 0.02, 240: 0.01, 500: 0.01}
    for line, amplitude in ripples.items():
        assert abs(lines[line]) == pytest.approx(amplitude, abs=1e-4)
    lines[list(ripples)] = 0
    rest = np.fft.irfft(lines * len(torque))
    assert rest.std() == pytest.approx(0.02, rel=0.02)
    assert abs(np.corrcoef(rest[1:], rest[:-1])[0, 1]) < 0.02


@pytest.mark.parametrize("name", LEVELS)
def test_sources_do_not_disturb_one_another(name):
    others = {"impact_level": 0.5, "friction_level": 0.02, "rubbing_level": 0.01}
    sources = others | {"noise_level": 5e-4, "torque_leak": (0.1, -0.1)}
    together, _ = record(**sources)
    without, _ = record(**(sources | {name: 0.0}))
    alone, _ = record(**{name: sources[name]})
    assert np.abs(alone).max() > 1e-3
    np.testing.assert_allclose(together - without, alone, atol=1e-12)
