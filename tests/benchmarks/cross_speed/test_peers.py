import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.cross_speed.peers import (
    METHODS,
    PEERS,
    LabelsOnly,
    ar_coefficients,
    band_energies,
    log_spectrum,
    unit_rms,
)
from benchmarks.cross_speed.protocol import leave_one_speed_in, log_evidence
from tests.benchmarks.speed_rig import moving_rig

NEEDS_NO_EXTRA = [name for name in PEERS if name.startswith(("band", "log", "AR"))]
LENGTH = 600


@pytest.fixture(scope="module")
def rig():
    return moving_rig(80, LENGTH, gain_of_fault=1.0, level=lambda speed: 1.0)


def test_unit_rms_removes_mean_and_gain_of_the_output_channel():
    y = np.array([[1.0, 3.0, 1.0, 3.0]])
    expected = [[-1.0, 1.0, -1.0, 1.0]]
    np.testing.assert_allclose(unit_rms(y), expected)
    np.testing.assert_allclose(unit_rms(100 * y + 7), expected)
    np.testing.assert_allclose(unit_rms(np.stack([y, 5 * y**2], axis=1)), expected)
    assert unit_rms(np.ones((1, 4))).tolist() == [[0.0] * 4]


def test_band_energies_of_a_sine_peak_in_its_band():
    time = np.arange(256)
    tones = np.array([np.sin(2 * np.pi * 20 * time / 256), np.sin(2 * np.pi * 100 * time / 256)])
    energies = band_energies(tones, n_bands=8)
    assert energies.shape == (2, 8)
    assert energies.argmax(axis=1).tolist() == [19 // 16, 99 // 16]
    # Parseval: a sine of unit amplitude has energy n / 2, half of it at the positive frequency
    np.testing.assert_allclose(np.exp(energies).sum(axis=1), 256 * 256 / 4)


def test_log_spectrum_of_white_noise_is_flat():
    noise = np.random.default_rng(0).standard_normal((1, 200_000))
    spectrum = log_spectrum(noise)
    assert spectrum.shape == (1, 128)
    np.testing.assert_allclose(np.exp(spectrum[0, :-1]), 2.0, rtol=0.25)


def test_ar_coefficients_recover_a_known_model():
    coefficients = [1.2, -0.8, 0.1]
    noise = np.random.default_rng(0).standard_normal((2, 100_000))
    y = lfilter([1.0], [1.0, *np.negative(coefficients)], noise)
    np.testing.assert_allclose(ar_coefficients(y, order=3), [coefficients] * 2, atol=0.02)


@pytest.mark.parametrize("name", NEEDS_NO_EXTRA)
def test_peer_distinguishes_two_resonances_at_another_speed(name, rig):
    for pair in leave_one_speed_in(METHODS[name], rig, LENGTH):
        assert pair["window"]["accuracy"] > 0.95
        assert pair["group"]["accuracy"] == 1.0
        assert pair["evidence"] == ("decision function" if "SVM" in name else "log-probability")


@pytest.mark.parametrize("name", NEEDS_NO_EXTRA)
def test_peer_ignores_the_gain_of_the_sensor(name, rig):
    classifier = METHODS[name]().fit(rig.data[::4], rig.target[::4])
    few = rig.data[1::16]
    np.testing.assert_array_equal(classifier.predict(few), classifier.predict(1000 * few + 3))


def test_labels_only_hides_probabilities(rig):
    X, y = rig.data[::4], rig.target[::4]
    plain = METHODS["AR(16) + LDA"]().fit(X, y)
    hidden = LabelsOnly(METHODS["AR(16) + LDA"]()).fit(X, y)
    np.testing.assert_array_equal(hidden.predict(X), plain.predict(X))
    assert log_evidence(hidden, X, hidden.predict(X))[1] == "vote"


def test_five_peers_need_no_extra():
    assert len(NEEDS_NO_EXTRA) == 5
