from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import TransferFunction, find_peaks
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


def ring_frequencies(mean_radius, thickness, orders, wave_speed=5150.0):
    n = np.asarray(orders)
    bending = wave_speed * thickness / (2 * np.pi * np.sqrt(12) * mean_radius**2)
    return bending * n * (n**2 - 1) / np.sqrt(n**2 + 1)


def test_ring_modes_follow_from_the_dimensions_of_the_bearing():
    # 6205: outside 52 mm, bore 25 mm; raceways 46.98 mm and 31.10 mm.
    outer = ring_frequencies(
        (26.0 + 23.49) / 2 * 1e-3, (26.0 - 23.49) * 1e-3, [3, 4, 5, 6]
    )
    inner = ring_frequencies(
        (15.55 + 12.5) / 2 * 1e-3, (15.55 - 12.5) * 1e-3, [2, 3, 4, 5]
    )
    paths = TransmissionPaths()
    np.testing.assert_allclose(paths.outer.frequencies[:4], outer, rtol=0.007)
    np.testing.assert_allclose(
        np.array(paths.inner.frequencies)[[0, 1, 2, 4]], inner, rtol=0.007
    )


def test_contact_resonance_of_the_ball_follows_from_mass_and_stiffness():
    mass = 7800 * np.pi / 6 * 7.94e-3**3
    assert mass == pytest.approx(2.04e-3, rel=0.01)
    resonance = np.sqrt(2 * 3.6e7 / mass) / (2 * np.pi)
    assert TransmissionPaths().ball.frequencies[1] == pytest.approx(resonance, rel=0.01)


def test_default_paths_lose_more_behind_every_contact():
    outer, ball, inner = (
        getattr(TransmissionPaths(), name) for name in ("outer", "ball", "inner")
    )
    assert outer.gain > ball.gain > inner.gain
    assert outer.delay < ball.delay < inner.delay
    assert outer.damping[0] < ball.damping[0] < inner.damping[0]


@pytest.mark.parametrize("place", ["outer", "inner", "ball"])
def test_the_spectrum_peaks_at_the_modes(place):
    path = getattr(TransmissionPaths(), place)
    frequencies, magnitude = spectrum(impulse_response(path, SAMPLING_RATE))
    peaks = frequencies[find_peaks(magnitude)[0]]
    for mode, damping in zip(path.frequencies, path.damping, strict=True):
        # The sensor is damped too well for a peak of its own beside its neighbours.
        if damping < 0.05:
            assert np.abs(peaks / mode - 1).min() < 0.03


def test_a_mode_decays_by_its_logarithmic_decrement():
    response = impulse_response(ONE_MODE, 10e6)
    peaks = response[find_peaks(response)[0]]
    decrement = 2 * np.pi * 0.02 / np.sqrt(1 - 0.02**2)
    np.testing.assert_allclose(np.log(peaks[:5] / peaks[1:6]), decrement, rtol=1e-3)


def test_modes_are_those_of_damped_oscillators():
    frequencies, damping, amplitudes = (9e3, 21e3), (0.4, 0.1), (1.0, 0.6)
    path = TransmissionPath(frequencies, damping, amplitudes, gain=1.0, delay=0.0)
    response = impulse_response(path, SAMPLING_RATE)
    expected = 0.0
    for frequency, ratio, amplitude in zip(
        frequencies, damping, amplitudes, strict=True
    ):
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


def test_amplitudes_share_the_response_among_the_modes():
    both = TransmissionPath((10e3, 40e3), (0.02, 0.02), (1.0, 0.5), gain=1.0, delay=0.0)
    high = impulse_response(replace(both, amplitudes=(0.0, 3.0)), SAMPLING_RATE)
    frequencies, magnitude = spectrum(high)
    assert frequencies[magnitude.argmax()] == pytest.approx(40e3, rel=0.01)
    frequencies, magnitude = spectrum(impulse_response(both, SAMPLING_RATE))
    assert frequencies[magnitude.argmax()] == pytest.approx(10e3, rel=0.01)


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
