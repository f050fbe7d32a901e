import numpy as np
import pytest

from skarxlag.kernels.order_spectra import (
    at_orders,
    band_envelopes,
    distances,
    envelope_spectra,
    equal_angles,
    turns_of_frames,
)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def test_envelopes_are_whitened_short_time_power(rng):
    samples, frame, hop, n_bands = rng.normal(size=200).cumsum(), 16, 8, 3
    power = []
    for start in range(0, 200 - frame + 1, hop):
        k = np.arange(frame)
        windowed = (samples - samples.mean())[start : start + frame] * np.sin(
            np.pi * (k + 1) / (frame + 1)
        ) ** 2
        power.append(
            [abs(windowed @ np.exp(-2j * np.pi * f * k / frame)) ** 2 for f in range(1, 8)]
        )
    share = np.array(power) / np.mean(power, axis=0)
    expected = [share[:, :3].mean(1), share[:, 3:5].mean(1), share[:, 5:].mean(1)]
    np.testing.assert_allclose(band_envelopes(samples, frame, hop, n_bands), expected, rtol=1e-9)


@pytest.mark.parametrize("factor", [1e-300, 1e-3, 1e300])
def test_envelopes_do_not_depend_on_scale(rng, factor):
    samples = rng.normal(size=500)
    found = band_envelopes(factor * samples, 32, 16, 4)
    np.testing.assert_allclose(found, band_envelopes(samples, 32, 16, 4), rtol=1e-9)


@pytest.mark.parametrize("value", [0.0, 5.0])
def test_envelopes_of_a_constant_are_zero(value):
    np.testing.assert_array_equal(band_envelopes(np.full(100, value), 16, 8, 4), 0)


def test_a_pure_tone_leaves_no_noise_of_rounding_in_other_bands():
    tone = np.sin(2 * np.pi * 8 / 64 * np.arange(6400))
    # The Hann window of 64 samples hides most of a tone at the middle of a cell; what is left of
    # it must not be whitened to the size of a signal.
    assert band_envelopes(tone, 64, 32, 4)[3].max() < 1.5


def literal_power(envelope, n_segment, frequency):
    """Welch's method by an explicit Fourier sum at one frequency in cycles a value."""
    hop = int(np.ceil(n_segment / 4))
    k = np.arange(n_segment)
    hann = np.sin(np.pi * (k + 1) / (n_segment + 1)) ** 2
    powers = []
    for start in range(0, len(envelope) - n_segment + 1, hop):
        segment = envelope[start : start + n_segment]
        segment = (segment - segment.mean()) * hann
        powers.append(abs(segment @ np.exp(-2j * np.pi * frequency * k)) ** 2)
    return np.mean(powers)


@pytest.mark.parametrize("n_segment", [40, 97, 300])
def test_order_spectra_are_those_of_explicit_fourier_sums(rng, n_segment):
    envelopes = 1 + 0.3 * rng.normal(size=(2, 300)) + 0.5 * np.sin(0.7 * np.arange(300))
    turns_a_frame, orders, factors = 0.03, np.arange(1.0, 12.0, 0.37), np.array([0.9, 1.0, 1.1])
    log_power, step = envelope_spectra(envelopes, n_segment)
    spectra, inside = at_orders(log_power, step / turns_a_frame, orders, factors)
    assert inside.all()
    expected = np.log(
        [
            [
                [literal_power(e, n_segment, s * o * turns_a_frame) for o in orders]
                for e in envelopes
            ]
            for s in factors
        ]
    )
    expected -= np.median(expected, axis=-1, keepdims=True)
    # Between two cells of the zero-padded spectrum there is a straight line. Valleys, where few
    # segments cancel each other, are narrower than peaks.
    high = expected > -1
    assert high.mean() > 0.7
    assert np.abs(spectra - expected)[high].max() < 0.12
    assert np.median(np.abs(spectra - expected)) < 0.02


def test_orders_above_the_spectrum_are_outside(rng):
    log_power = rng.normal(size=(2, 11))
    spectra, inside = at_orders(log_power, 1.0, np.array([2.0, 5.0, 9.0]), np.array([1.0, 2.0]))
    np.testing.assert_array_equal(inside, [[True, True, True], [True, True, False]])
    np.testing.assert_array_equal(spectra[1, :, 2], 0)
    values = log_power[:, [4, 10]]
    np.testing.assert_allclose(spectra[1, :, :2], values - values.mean(axis=1, keepdims=True))
    _, none = at_orders(np.zeros((2, 1)), 1.0, np.array([1.0, 2.0]), np.ones(1))
    assert not none.any()


def test_distances_are_literal_sums(rng):
    spectra, references = rng.normal(size=(3, 2, 5)), rng.normal(size=(4, 2, 5))
    variances, inside = rng.uniform(1, 2, size=(2, 5)), np.ones((3, 5), dtype=bool)
    inside[1, 3:] = inside[2] = False
    spectra[1, :, 3:] = spectra[2] = 0
    found = distances(spectra, inside, references, variances)
    for c in range(4):
        squares = (spectra - references[c]) ** 2 / variances
        np.testing.assert_allclose(found[0, c], np.sqrt(squares[0].mean()))
        np.testing.assert_allclose(found[1, c], np.sqrt(squares[1, :, :3].mean()))
    np.testing.assert_array_equal(found[2], 1)


def test_order_tracking_gathers_what_a_run_up_smears():
    sampling_rate, n_samples, frame, hop, order = 2_000, 40_000, 16, 8, 5.0
    rpm = np.linspace(300, 900, n_samples)
    angle = np.cumsum(rpm) / (60 * sampling_rate)
    n_frames = (n_samples - frame) // hop + 1
    turns = turns_of_frames(60 * sampling_rate / rpm, n_frames, frame, hop)
    # Frame 10 is centred between samples 87 and 88.
    assert turns[10] == pytest.approx((angle[87] + angle[88]) / 2)
    envelope = np.cos(2 * np.pi * order * turns)[np.newaxis]
    tracked, step = equal_angles(envelope, turns)
    n_segment = round(10 / step)
    log_power, cells = envelope_spectra(tracked, n_segment)
    peak = log_power[0].argmax() * cells / step
    assert peak == pytest.approx(order, abs=0.03)
    smeared, _ = envelope_spectra(envelope, n_segment)
    assert log_power.max() > smeared.max() + 1
