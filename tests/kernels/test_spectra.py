import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import signal
from scipy.signal import lfilter

from skarxlag.kernels import spectra
from skarxlag.kernels.linear_prediction import predictors


def spectral_shape(signals, order, n_frequencies):
    return spectra.autoregressive_log_spectrum(
        spectra.unit_peak(signals), order, n_frequencies
    )


def band_steadiness(signals, segment, hop):
    return spectra.steadiness(spectra.unit_peak(signals), segment, hop)


def ar2(n_signals, n_samples, seed=0):
    noise = np.random.default_rng(seed).normal(size=(n_signals, n_samples + 500))
    return lfilter([1], [1, -1.2, 0.8], noise, axis=1)[:, 500:]


@pytest.mark.parametrize("scale", [1e-300, 1e-9, 1.0, 1e300])
def test_log_spectra_do_not_depend_on_the_unit(scale):
    signals = ar2(3, 600)
    for log_spectrum in (
        lambda s: spectral_shape(s, 16, 32),
        lambda s: band_steadiness(s, 64, 8),
    ):
        assert_allclose(
            log_spectrum(scale * signals), log_spectrum(signals), rtol=1e-6, atol=1e-9
        )


def test_signals_of_zeros_have_flat_log_spectra():
    zeros = np.zeros((2, 100))
    assert np.all(spectral_shape(zeros, 16, 32) == 0)
    assert_allclose(band_steadiness(zeros, 64, 8), 0, atol=1e-12)


@pytest.mark.parametrize("n_samples", [1, 2, 3, 4, 7])
def test_short_signals(n_samples):
    signals = np.random.default_rng(0).normal(size=(2, n_samples))
    assert np.isfinite(spectral_shape(signals, 64, 32)).all()
    steadiness = band_steadiness(signals, n_samples, 1)
    assert steadiness.shape == (2, max(n_samples // 2 - 1, 1))
    assert np.isfinite(steadiness).all()


def test_each_signal_is_worked_on_by_itself():
    signals = ar2(9, 500)
    for log_spectrum in (
        lambda s: spectra.cepstrum(spectral_shape(s, 32, 64)),
        lambda s: spectra.cepstrum(band_steadiness(s, 64, 8)),
    ):
        alone = np.concatenate([log_spectrum(s[np.newaxis]) for s in signals])
        assert_array_equal(log_spectrum(signals), alone)


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s.astype(np.float32).astype(np.float64)[:, ::-1],
        lambda s: np.asfortranarray(s),
        lambda s: np.repeat(s, 2, axis=1)[:, ::2],
        lambda s: s.astype(np.float32),
    ],
)
def test_signals_of_any_layout_and_type(change):
    changed = change(ar2(3, 400))
    changed.flags.writeable = False
    plain = np.array(changed, dtype=np.float64, order="C")
    for log_spectrum in (
        lambda s: spectral_shape(s, 16, 32),
        lambda s: band_steadiness(s, 64, 8),
    ):
        assert_array_equal(log_spectrum(changed), log_spectrum(plain))


@pytest.mark.parametrize(
    ("n_samples", "order", "n_coefficients", "n_frequencies"),
    # A short signal gets a model of fewer coefficients. A model may have more of them
    # than there are frequencies.
    [(80, 64, 10, 32), (1200, 1, 1, 32), (1200, 33, 33, 32), (1200, 150, 150, 7)],
)
def test_spectrum_is_that_of_the_coefficients(
    n_samples, order, n_coefficients, n_frequencies
):
    samples = ar2(1, n_samples)
    coef = predictors(spectra.unit_peak(samples), n_coefficients, 1e-9)[0]
    grid = spectra.frequency_grid(n_frequencies)
    _, response = signal.freqz([1], np.r_[1, -coef], worN=grid)
    found = spectral_shape(samples, order, n_frequencies)[0]
    assert_allclose(found, np.log(np.abs(response) ** 2), rtol=1e-9, atol=1e-10)


def test_floor_of_the_power_is_1e_12_of_the_power_of_the_signal():
    # More than half of the segments hold noise that is about as weak as the floor.
    weak = 1e-6 * np.random.default_rng(8).normal(size=(1, 3200))
    weak[0, 1920:] *= 6e5
    unit = weak[0] / np.abs(weak).max()
    window = np.sin(np.pi * np.arange(1, 33) / 33) ** 2
    power = np.abs(np.fft.fft(unit.reshape(100, 32) * window)[:, 1:16]) ** 2
    quiet = np.arange(100) < 60
    floor = 1e-12 * 32 * np.mean(unit**2)
    assert 0.1 < power[quiet].mean() / floor < 10
    literal = np.sort(power + floor, axis=0)
    expected = np.log(literal[49:51].mean(axis=0) / literal.mean(axis=0))
    assert_allclose(band_steadiness(weak, 32, 32)[0], expected, atol=1e-5)


def test_segments_of_four_samples_by_hand():
    signal_ = np.random.default_rng(6).normal(size=(1, 12))
    w = np.sin(np.arange(1, 5) * np.pi / 5) ** 2
    x = signal_[0].reshape(3, 4) * w
    # The one band of four samples between 0 and the Nyquist frequency is that of a
    # quarter.
    power = (x[:, 0] - x[:, 2]) ** 2 + (x[:, 1] - x[:, 3]) ** 2
    expected = np.log(np.median(power) / power.mean())
    assert_allclose(band_steadiness(signal_, 4, 4), [[expected]], rtol=1e-6)


@pytest.mark.parametrize("n_samples", [3, 40, 128, 600])
def test_shape_and_steadiness_have_the_same_bands(n_samples):
    signals = ar2(3, n_samples)
    shape, of_bands = spectra.own_spectra(signals, 20).swapaxes(0, 1)
    segment = min(n_samples, 128)
    expected = band_steadiness(signals, segment, max(segment // 8, 1))
    assert_array_equal(of_bands, np.repeat(expected, 2, axis=1))
    n_bands = of_bands.shape[1]
    fine = spectral_shape(signals, 20, -(-252 // n_bands) * n_bands)
    assert_allclose(shape, fine.reshape(3, n_bands, -1).mean(axis=2), rtol=1e-12)
