from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import TransferFunction
from scipy.signal import impulse as impulse_of

from skarxlag.datasets.transmission import (
    TransmissionPath,
    TransmissionPaths,
    friction_response,
    impulse_response,
)

SAMPLING_RATE = 250e3
ONE_MODE = TransmissionPath((10e3,), (0.02,), (1.0,), gain=0.5, delay=0.0)


def spectrum(response, n_bins=2**17):
    frequencies = np.fft.rfftfreq(n_bins, 1 / SAMPLING_RATE)
    return frequencies, np.abs(np.fft.rfft(response, n_bins))


def ring_frequencies(outer_radius, inner_radius, orders):
    n = np.asarray(orders)
    mean_radius = (outer_radius + inner_radius) / 2
    thickness = outer_radius - inner_radius
    bending = 5150.0 * thickness / (2 * np.pi * np.sqrt(12) * mean_radius**2)
    return bending * n * (n**2 - 1) / np.sqrt(n**2 + 1)


def test_ring_modes_follow_from_the_dimensions_of_the_bearing():
    # 6205: outside 52 mm, bore 25 mm; raceways 46.98 mm and 31.10 mm.
    outer = ring_frequencies(26.0e-3, 23.49e-3, [3, 4, 5, 6])
    inner = ring_frequencies(15.55e-3, 12.5e-3, [2, 3, 4, 5])
    paths = TransmissionPaths()
    np.testing.assert_allclose(paths.outer.frequencies[:4], outer, rtol=0.007)
    # The fourth is that of the sensor.
    ring = np.delete(paths.inner.frequencies, 3)
    np.testing.assert_allclose(ring, inner, rtol=0.007)


def test_contact_resonance_of_the_ball_follows_from_mass_and_stiffness():
    mass = 7800 * np.pi / 6 * 7.94e-3**3
    assert mass == pytest.approx(2.04e-3, rel=0.01)
    resonance = np.sqrt(2 * 3.6e7 / mass) / (2 * np.pi)
    assert TransmissionPaths().ball.frequencies[1] == pytest.approx(resonance, rel=0.01)


def test_modes_are_those_of_damped_oscillators():
    modes = [(9e3, 0.4, 1.0), (21e3, 0.1, 0.6)]
    path = TransmissionPath(*zip(*modes, strict=True), gain=1.0, delay=0.0)
    response = impulse_response(path, SAMPLING_RATE)
    expected = 0.0
    for frequency, ratio, amplitude in modes:
        omega = 2 * np.pi * frequency
        damped = omega * np.sqrt(1 - ratio**2)
        system = TransferFunction(
            [amplitude * damped], [1, 2 * ratio * omega, omega**2]
        )
        expected += impulse_of(system, T=np.arange(len(response)) / SAMPLING_RATE)[1]
    np.testing.assert_allclose(response, expected / np.abs(expected).max(), atol=1e-9)


def test_the_response_is_kept_until_120_db_down():
    response = impulse_response(ONE_MODE, SAMPLING_RATE)
    assert np.abs(response).max() == 1.0
    assert 1e-7 < np.abs(response[-30:]).max() < 2e-6


def test_delay_is_silence_ahead_of_the_response():
    delayed = impulse_response(replace(ONE_MODE, delay=20e-6), SAMPLING_RATE)
    assert np.all(delayed[:5] == 0)
    np.testing.assert_array_equal(
        delayed[5:], impulse_response(ONE_MODE, SAMPLING_RATE)
    )


def test_friction_is_the_path_behind_a_low_pass():
    contact_time = 20e-6
    response = friction_response(ONE_MODE, SAMPLING_RATE, contact_time)
    assert response @ response == pytest.approx(1.0)
    # Compared well inside the band, where neither sampling nor truncation matters.
    frequencies, magnitude = spectrum(response)
    _, path = spectrum(impulse_response(ONE_MODE, SAMPLING_RATE))
    band = (frequencies > 100) & (frequencies < 12e3)
    ratio = (magnitude / path)[band] / (magnitude / path)[band][0]
    lowpass = 1 / np.sqrt(1 + (2 * np.pi * frequencies[band] * contact_time) ** 2)
    np.testing.assert_allclose(ratio, lowpass / lowpass[0], rtol=0.03)


def test_modes_above_half_the_sampling_rate_are_refused():
    with pytest.raises(ValueError, match=r"frequencies == \(10000.0,\), .* 10000 Hz"):
        impulse_response(ONE_MODE, 20e3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frequencies": ()}, r"frequencies == \(\), .* 1 modes"),
        ({"damping": (0.1, 0.2)}, r"damping .* \(0.1, 0.2\)"),
        ({"damping": (1.0,)}, r"damping .* \(1.0,\)"),
        ({"amplitudes": (0.0,)}, "amplitudes .* zero"),
        ({"frequencies": (-5.0,)}, r"frequencies .* \(-5.0,\)"),
        ({"frequencies": (np.nan,)}, r"frequencies .* \(nan,\)"),
        ({"gain": -1.0}, "gain .* -1.0"),
        ({"delay": np.inf}, "delay .* inf"),
    ],
)
def test_impossible_paths_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        replace(ONE_MODE, **changes)
