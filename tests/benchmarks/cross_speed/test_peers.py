import numpy as np
import pytest
from scipy.signal import lfilter
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

from benchmarks.cross_speed.peers import (
    METHODS,
    PEERS,
    SmoothGains,
    ar_coefficients,
    band_energies,
    log_spectrum,
    smooth_gains,
    spectrum_percentiles,
    standardised,
    unit_rms,
)
from benchmarks.cross_speed.protocol import leave_one_speed_in
from tests.benchmarks.speed_rig import moving_rig

NEEDS_NO_EXTRA = list(PEERS)
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
    tones = np.array(
        [np.sin(2 * np.pi * 20 * time / 256), np.sin(2 * np.pi * 100 * time / 256)]
    )
    energies = band_energies(tones, n_bands=8)
    assert energies.shape == (2, 8)
    assert energies.argmax(axis=1).tolist() == [19 // 16, 99 // 16]
    # Parseval: a sine of unit amplitude has energy n / 2, half of it at the positive
    # frequency
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
    np.testing.assert_allclose(
        ar_coefficients(y, order=3), [coefficients] * 2, atol=0.02
    )


@pytest.mark.parametrize("name", NEEDS_NO_EXTRA)
def test_peer_distinguishes_two_resonances_at_another_speed(name, rig):
    for pair in leave_one_speed_in(METHODS[name], rig, LENGTH):
        assert pair["window"]["accuracy"] > 0.95
        assert pair["group"]["accuracy"] == 1.0
        decides = "SVM" in name or "augmented" in name
        assert pair["evidence"] == (
            "decision function" if decides else "log-probability"
        )


@pytest.mark.parametrize("name", NEEDS_NO_EXTRA)
def test_peer_ignores_the_gain_of_the_sensor(name, rig):
    classifier = METHODS[name]().fit(rig.data[::4], rig.target[::4])
    few = rig.data[1::16]
    np.testing.assert_array_equal(
        classifier.predict(few), classifier.predict(1000 * few + 3)
    )


def test_percentiles_of_the_spectrum_rise_where_a_tone_comes_and_goes():
    time = np.arange(960)
    noise = 0.01 * np.random.default_rng(0).standard_normal((1, 960))
    tone = np.sin(np.pi / 2 * time) * (time < 240)
    low, median, high, mean = np.split(spectrum_percentiles(noise + tone)[0], 4)
    assert low.shape == (32,)
    # The tone has half the Nyquist frequency, bin 16 of 32, and sounds a quarter of the
    # time.
    assert high.argmax() == mean.argmax() == 15
    assert low[15] - low[0] < 3 and median[15] - median[0] < 3 < high[15] - high[0]


def test_smooth_gains_vary_slowly_and_by_their_seed():
    gains = smooth_gains(2000, 32, random_state=0)
    n = np.arange(1, 25)
    frequency = (np.arange(32) + 0.5) / 32
    expected = 0.6**2 * (
        2 * np.cos(np.pi * np.outer(n, frequency)) ** 2 / n[:, None] ** 2
    ).sum(0)
    np.testing.assert_allclose(gains.var(axis=0), expected, rtol=0.15)
    neighbours = np.corrcoef(gains.T).diagonal(1)
    assert neighbours.min() > 0.8
    assert not np.allclose(gains, smooth_gains(2000, 32, random_state=1))


def test_augmentation_trains_on_six_copies_with_one_gain_for_all_statistics():
    class Copies(LinearDiscriminantAnalysis):
        def fit(self, X, y):
            self.X, self.y = X, y
            return super().fit(X, y)

    X = np.zeros((2, 8))
    fitted = (
        SmoothGains(Copies())
        .fit(np.repeat(X, 3, axis=0), [0, 0, 0, 1, 1, 1])
        .classifier_
    )
    assert fitted.X.shape == (36, 8) and fitted.y.sum() == 18
    statistics = fitted.X.reshape(36, 4, 2)
    np.testing.assert_array_equal(statistics, statistics[:, :1].repeat(4, axis=1))
    assert len(np.unique(statistics[:, 0], axis=0)) == 36


def test_a_batch_is_standardised_by_itself():
    X = np.array([[1.0, 5.0], [3.0, 5.0]])
    assert standardised(X).tolist() == [[-1.0, 0.0], [1.0, 0.0]]
