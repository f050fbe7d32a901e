import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import signal
from scipy.signal import lfilter

from skarxlag.kernels import spectra
from skarxlag.kernels.arx_laguerre import accumulate_sums, sums_of_products
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


def ar2_log_spectrum(frequency):
    z = np.exp(-1j * frequency)
    return -np.log(np.abs(1 - 1.2 * z + 0.8 * z**2) ** 2)


def test_autoregressive_log_spectrum_is_that_of_the_process():
    estimated = spectral_shape(ar2(1, 200_000), 2, 64)[0]
    assert_allclose(estimated, ar2_log_spectrum(spectra.frequency_grid(64)), atol=0.05)


def test_model_is_that_of_a_network_with_its_pole_at_0():
    signals = ar2(1, 300)
    network = np.array([6]), np.zeros(1)
    parts = accumulate_sums(signals[:, np.newaxis], np.ones(1), *network, 6)
    sums = sums_of_products(*parts, *network)
    coef = np.linalg.solve(sums[:-1, :-1], sums[-1, :-1])
    assert_allclose(predictors(signals, 6, 1e-15)[0], coef, rtol=1e-9)


def test_autoregressive_log_spectrum_agrees_with_freqz_of_plain_least_squares():
    samples = ar2(1, 400)[0]
    lagged = np.stack([samples[10 - j : 400 - j] for j in range(1, 11)], axis=1)
    coef = np.linalg.lstsq(lagged, samples[10:], rcond=None)[0]
    _, response = signal.freqz([1], np.r_[1, -coef], worN=spectra.frequency_grid(32))
    estimated = spectral_shape(samples[np.newaxis], 10, 32)[0]
    assert_allclose(estimated, np.log(np.abs(response) ** 2), atol=1e-5)


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


def test_steadiness_of_noise_is_that_of_an_exponential_variable():
    # Power of a band of noise is exponential: its median is ln 2 of its mean.
    noise = np.random.default_rng(3).normal(size=(1, 400_000))
    steadiness = band_steadiness(noise, 64, 64)
    assert_allclose(steadiness, np.log(np.log(2)), atol=0.06)


def test_steadiness_of_a_steady_tone_is_0_and_of_strikes_far_below():
    k = np.arange(20_000)
    tone = np.cos(2 * np.pi * 10 / 64 * k)[np.newaxis]
    assert abs(band_steadiness(tone, 64, 16)[0, 9]) < 1e-3
    strikes = np.where(k % 1000 == 0, 1.0, 1e-3)[np.newaxis] * np.random.default_rng(
        0
    ).normal(size=(1, 20_000))
    assert np.all(band_steadiness(strikes, 64, 16) < -3)


@pytest.mark.parametrize("n_samples", [1, 2, 3, 4, 7])
def test_short_signals(n_samples):
    signals = np.random.default_rng(0).normal(size=(2, n_samples))
    assert np.isfinite(spectral_shape(signals, 64, 32)).all()
    steadiness = band_steadiness(signals, n_samples, 1)
    assert steadiness.shape == (2, max(n_samples // 2 - 1, 1))
    assert np.isfinite(steadiness).all()


def test_cepstrum_against_the_literal_cosine_sum():
    log_spectra = np.random.default_rng(4).normal(size=(3, 2, 20))
    frequency = spectra.frequency_grid(20)
    n = np.arange(1, 20)
    literal = 2 / 20 * log_spectra @ np.cos(np.outer(frequency, n))
    assert_allclose(spectra.cepstrum(log_spectra), literal, atol=1e-12)


def test_cepstrum_of_a_first_order_model_is_its_closed_form():
    # log 1/|1 - a z|^2 = sum_n (2 a^n / n) cos n w.
    frequency = spectra.frequency_grid(256)
    log_spectrum = -np.log(np.abs(1 - 0.6 * np.exp(-1j * frequency)) ** 2)
    n = np.arange(1, 20)
    assert_allclose(
        spectra.cepstrum(log_spectrum[np.newaxis])[0, :19], 2 * 0.6**n / n, atol=1e-10
    )


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


def test_transforms_of_log_spectra_have_a_power_of_two_of_cells():
    assert np.log2(spectra.LOG_SPECTRUM_CELLS) % 1 == 0


def test_bands_that_hold_nothing_but_rounding_are_steady():
    # A tone at the middle of a cell, of which the Hann window leaves rounding in other
    # cells.
    tone = np.sin(2 * np.pi * 8 / 64 * np.arange(6400))[np.newaxis]
    assert_allclose(band_steadiness(tone, 64, 32), 0, atol=0.05)


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


def test_ridge_parameter_is_1e_9():
    signals = ar2(1, 200)
    ours = -spectra.predictors(spectra.unit_peak(signals), 8, 1e-9)
    response = np.exp(-1j * np.outer(np.arange(9), spectra.frequency_grid(32)))
    expected = -np.log(
        np.abs(np.column_stack([np.ones(len(ours)), ours]) @ response) ** 2
    )
    found = spectral_shape(signals, 8, 32)
    assert_allclose(found, expected, rtol=1e-11)


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
