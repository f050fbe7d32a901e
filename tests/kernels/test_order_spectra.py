import numpy as np
import pytest
from scipy.signal import welch

from skarxlag.kernels.order_spectra import (
    at_orders,
    band_envelopes,
    distances,
    envelopes_over_angle,
    equal_angles,
    match,
    order_spectrum,
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
            [
                abs(windowed @ np.exp(-2j * np.pi * f * k / frame)) ** 2
                for f in range(1, 8)
            ]
        )
    share = np.array(power) / np.mean(power, axis=0)
    expected = [share[:, :3].mean(1), share[:, 3:5].mean(1), share[:, 5:].mean(1)]
    np.testing.assert_allclose(
        band_envelopes(samples, frame, hop, n_bands), expected, rtol=1e-9
    )


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
    # The Hann window of 64 samples hides most of a tone at the middle of a cell; what
    # is left of it must not be whitened to the size of a signal.
    assert band_envelopes(tone, 64, 32, 4)[3].max() < 1.5


def test_envelopes_have_a_floor_of_1e_14_of_the_power_of_the_signal(rng):
    # A low tone, whose leakage falls below the weak noise far from it.
    frame, k = 4096, np.arange(16 * 4096)
    samples = 100 * np.sin(2 * np.pi * 8 / frame * k) + 1e-5 * rng.normal(size=len(k))
    unit = samples - samples.mean()
    window = np.sin(np.pi * np.arange(1, frame + 1) / (frame + 1)) ** 2
    power = np.abs(np.fft.fft(unit.reshape(16, frame) * window)[:, 1 : frame // 2]) ** 2
    mean, floor = power.mean(axis=0), 1e-14 * frame * np.mean(unit**2)
    top = np.array_split(np.arange(len(mean)), 4)[3]
    assert 0.1 < mean[top].mean() / floor < 10
    expected = (power[:, top] / (mean[top] + floor)).mean(axis=1)
    np.testing.assert_allclose(
        band_envelopes(samples, frame, frame, 4)[3], expected, rtol=1e-6
    )


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
    turns_a_frame, orders, factors = (
        0.03,
        np.arange(1.0, 12.0, 0.37),
        np.array([0.9, 1.0, 1.1]),
    )
    log_power, step = order_spectrum(envelopes, 1.0, n_segment)
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
    # Between two cells of the zero-padded spectrum there is a straight line. Valleys,
    # where few segments cancel each other, are narrower than peaks.
    high = expected > -1
    assert high.mean() > 0.7
    assert np.abs(spectra - expected)[high].max() < 0.12
    assert np.median(np.abs(spectra - expected)) < 0.02


def test_orders_above_the_spectrum_are_outside(rng):
    log_power = rng.normal(size=(2, 11))
    spectra, inside = at_orders(
        log_power, 1.0, np.array([2.0, 5.0, 9.0]), np.array([1.0, 2.0])
    )
    np.testing.assert_array_equal(inside, [[True, True, True], [True, True, False]])
    np.testing.assert_array_equal(spectra[1, :, 2], 0)
    values = log_power[:, [4, 10]]
    np.testing.assert_allclose(
        spectra[1, :, :2], values - values.mean(axis=1, keepdims=True)
    )
    _, none = at_orders(np.zeros((2, 1)), 1.0, np.array([1.0, 2.0]), np.ones(1))
    assert not none.any()


def test_each_factor_has_the_median_of_its_own_orders(rng):
    log_power, orders = rng.normal(size=(3, 60)), np.arange(0.5, 9, 0.5)
    factors = np.array([0.5, 0.8, 1.1, 1.7, 90.0])
    spectra, inside = at_orders(log_power, 0.1, orders, factors)
    assert inside.sum(axis=1).tolist() == [17, 14, 10, 6, 0]
    for factor, found, counts in zip(factors, spectra, inside, strict=True):
        np.testing.assert_array_equal(found[:, ~counts], 0)
        for curve, row in zip(log_power, found, strict=True):
            values = np.interp(orders[counts] * factor / 0.1, np.arange(60), curve)
            expected = values - np.median(values) if counts.any() else []
            np.testing.assert_allclose(row[counts], expected, atol=1e-12)


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
    # Frame 10 is centred between samples 87 and 88.
    first = np.arange(n_frames) * hop + 7
    turns = (angle[first] + angle[first + 1]) / 2
    envelope = np.cos(2 * np.pi * order * turns)[np.newaxis]
    tracked, step = equal_angles(envelope, 60 * sampling_rate / rpm, frame, hop)
    n_segment = round(10 / step)
    log_power, cells = order_spectrum(tracked, 1.0, n_segment)
    peak = log_power[0].argmax() * cells / step
    assert peak == pytest.approx(order, abs=0.03)
    smeared, _ = order_spectrum(envelope, 1.0, n_segment)
    assert log_power.max() > smeared.max() + 1


def test_an_envelope_that_follows_the_angle_of_the_middle_of_each_frame_is_a_line(rng):
    turn = rng.uniform(20, 60, 50)
    # Frames of 7 samples, 4 samples apart: the middle of the first is the fourth
    # sample.
    angle = [sum(1 / each for each in turn[: middle + 1]) for middle in range(3, 47, 4)]
    tracked, step = equal_angles(np.array([angle]), turn, 7, 4)
    np.testing.assert_allclose(tracked[0], angle[0] + step * np.arange(len(angle)))
    assert step == pytest.approx((angle[-1] - angle[0]) / 10)


def test_steps_between_two_frames_are_the_whole_way():
    tracked, step = equal_angles(np.array([[1.0, 3.0]]), np.full(8, 8.0), 2, 2)
    assert step == 0.25
    np.testing.assert_array_equal(tracked, [[1.0, 3.0]])


# A turn of 1000 samples and frames of 64: half a cycle a hop of 32 is order 15.6.
@pytest.mark.parametrize(
    ("frame", "max_order", "hop"),
    [
        (64, 1, 32),
        (64, 15, 32),
        (64, 15.625, 32),
        (64, 16, 16),
        (64, 31, 16),
        (64, 32, 8),
        (64, 1e6, 8),
        (8, 1e6, 1),
        (6, 1e6, 1),
    ],
)
def test_frames_overlap_as_much_as_the_highest_order_needs(rng, frame, max_order, hop):
    samples = rng.normal(size=2000)
    envelopes, step = envelopes_over_angle(samples, 1000.0, frame, 2, max_order)
    assert step == hop / 1000
    np.testing.assert_array_equal(envelopes, band_envelopes(samples, frame, hop, 2))


def test_a_speed_that_is_given_for_each_sample_may_be_constant(rng):
    samples = rng.normal(size=2000)
    expected, step = envelopes_over_angle(samples, 1000.0, 64, 2, 16)
    found, same_step = envelopes_over_angle(samples, np.full(2000, 1000.0), 64, 2, 16)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert same_step == pytest.approx(step, rel=1e-9)


def test_a_signal_of_less_than_32_samples_has_one_value(rng):
    envelopes, step = envelopes_over_angle(rng.normal(size=31), 10.0, 64, 3, 5)
    np.testing.assert_array_equal(envelopes, np.zeros((3, 1)))
    log_power, cell = order_spectrum(envelopes, step, 10)
    np.testing.assert_array_equal(log_power, np.zeros((3, 1)))
    assert (step, cell) == (1.0, 1.0)
    # Frames of four samples, two apart.
    assert envelopes_over_angle(rng.normal(size=32), 10.0, 64, 3, 2)[0].shape == (3, 15)


def test_a_constant_envelope_is_90_db_below_one():
    log_power, _ = order_spectrum(np.ones((1, 40)), 1.0, 10)
    np.testing.assert_allclose(log_power, np.log(1e-9), rtol=1e-9)


@pytest.mark.parametrize(("n_turns", "n_segment"), [(5, 25), (1e9, 100), (0.01, 2)])
def test_segments_hold_so_many_turns_as_far_as_there_are_values(
    rng, n_turns, n_segment
):
    envelopes = 1 + 0.1 * rng.normal(size=(2, 100))
    log_power, cell = order_spectrum(envelopes, 0.2, n_turns)
    assert cell == pytest.approx(1 / (4 * n_segment * 0.2))
    expected, step = order_spectrum(envelopes, 1.0, n_segment)
    np.testing.assert_array_equal(log_power, expected)
    assert cell == pytest.approx(step / 0.2)
    assert order_spectrum(envelopes[:, :2], 0.2, n_turns)[0].shape[1] > 1


@pytest.mark.parametrize("deviation", [0.0, 0.03, 0.21, 0.3])
def test_match_is_the_least_of_all_factors_within_two_deviations(rng, deviation):
    orders, step, n_turns = np.arange(1.0, 9.0, 0.5), 0.04, 6.0
    envelopes = 1 + 0.1 * rng.normal(size=(2, 400))
    envelopes += 0.5 * np.sin(2 * np.pi * 4 * 1.3 * step * np.arange(400))
    references = rng.normal(size=(3, 2, len(orders)))
    variances = rng.uniform(0.5, 2, size=(2, len(orders)))
    least = [np.inf] * 3
    factors, closest = [1.0] * 3, [None] * 3
    # Groups that are at most 0.4 wide, and factors that are 2 % apart.
    centres = {
        0.0: [0.0],
        0.03: [0.0],
        0.21: [-0.28, 0.0, 0.28],
        0.3: [-0.4, 0.0, 0.4],
    }[deviation]
    widths = {0.0: 0, 0.03: 3, 0.21: 7, 0.3: 10}[deviation]
    for centre in centres:
        log_power, cell = order_spectrum(envelopes, step * np.exp(centre), n_turns)
        for near in range(-widths, widths + 1):
            found, inside = at_orders(log_power, cell, orders, np.exp([0.02 * near]))
            unlikely = (centre + 0.02 * near) / deviation if deviation else 0.0
            for c, reference in enumerate(references):
                d = distances(found, inside, reference[np.newaxis], variances)[0, 0]
                r = np.sqrt(d**2 + unlikely**2 / 50)
                if r < least[c] - 1e-12:
                    least[c], factors[c] = r, np.exp(centre + 0.02 * near)
                    closest[c] = found[0]
    residuals, best, spectra = match(
        envelopes, step, n_turns, orders, deviation, references, variances
    )
    np.testing.assert_allclose(residuals, least, rtol=1e-9)
    np.testing.assert_allclose(best, factors, rtol=1e-9)
    np.testing.assert_allclose(spectra, closest, rtol=1e-9, atol=1e-12)


def test_match_finds_the_factor_of_a_wrong_nominal_speed(rng):
    orders, step, n_turns = np.arange(1.0, 12.0, 0.1), 0.03, 20.0
    true = (
        1
        + 0.05 * rng.normal(size=(1, 3000))
        + np.sin(2 * np.pi * 5 * step * np.arange(3000))
    )
    log_power, cell = order_spectrum(true, step, n_turns)
    reference, _ = at_orders(log_power, cell, orders, np.ones(1))
    # The shaft turned by 22 % less than was said in each step.
    variances = np.ones((1, len(orders)))
    _, factors, _ = match(true, step / 0.78, n_turns, orders, 0.3, reference, variances)
    assert factors[0] == pytest.approx(0.78, rel=0.011)


def test_shortest_frames_have_one_frequency(rng):
    samples = rng.normal(size=40)
    centred = samples - samples.mean()
    hann = np.sin(np.pi * np.arange(1, 5) / 5) ** 2
    powers = [
        abs((centred[k : k + 4] * hann) @ [1, -1j, -1, 1j]) ** 2
        for k in range(0, 37, 2)
    ]
    expected = [powers / np.mean(powers)]
    np.testing.assert_allclose(band_envelopes(samples, 4, 2, 1), expected, rtol=1e-9)


@pytest.mark.parametrize("n_segment", [10, 11, 60])
def test_envelope_spectra_are_those_of_welch(rng, n_segment):
    envelopes = rng.normal(size=(2, 100))
    log_power, step = order_spectrum(envelopes, 1.0, n_segment)
    assert step == pytest.approx(1 / (4 * n_segment), rel=0.1)
    # The last frequency is half a cycle a value.
    assert (log_power.shape[1] - 1) * step == pytest.approx(0.5)
    window = np.sin(np.pi * np.arange(1, n_segment + 1) / (n_segment + 1)) ** 2
    overlap = n_segment - int(np.ceil(n_segment / 4))
    _, power = welch(envelopes, window=window, noverlap=overlap, nfft=round(1 / step))
    np.testing.assert_allclose(np.exp(log_power) - 1e-9, power, rtol=1e-6, atol=1e-12)


def test_orders_within_the_first_cell_are_interpolated():
    spectra, _ = at_orders(
        np.array([[0.0, 4.0, 8.0, 0.0]]), 1.0, np.array([0.25, 0.5, 2]), np.ones(1)
    )
    np.testing.assert_allclose(spectra, [[[-1.0, 0.0, 6.0]]])


def test_a_single_order_inside_is_its_own_median():
    log_power = np.array([[1.0, 2.0, 5.0]])
    spectra, inside = at_orders(log_power, 1.0, np.array([2.0, 3.0]), np.ones(1))
    np.testing.assert_array_equal(inside, [[True, False]])
    np.testing.assert_array_equal(spectra, np.zeros((1, 1, 2)))


def test_distance_of_one_value_and_of_a_reference_from_itself(rng):
    one = np.full((1, 1, 1), 3.0)
    found = distances(
        one, np.ones((1, 1), dtype=bool), np.zeros((1, 1, 1)), np.full((1, 1), 4.0)
    )
    np.testing.assert_allclose(found, [[1.5]])
    same = rng.normal(size=(1, 2, 5))
    found = distances(same, np.ones((1, 5), dtype=bool), same, np.ones((2, 5)))
    np.testing.assert_allclose(found, 0, atol=1e-6)


def test_padded_length_is_even():
    # 4 x 33 = 132 values; the next length that a transform is fast for is 135 = 27 x 5.
    log_power, step = order_spectrum(
        np.random.default_rng(1).normal(size=(1, 33)), 1.0, 33
    )
    assert step == 1 / 136 and log_power.shape == (1, 69)


def test_of_two_factors_that_are_as_good_the_lower_one_is_returned(rng):
    # No order lies within the spectrum, so only the size of the factor counts. Several
    # groups of segments are tried, the lower factors first.
    envelopes = 1 + 0.1 * rng.normal(size=(1, 64))
    references, variances = np.zeros((1, 1, 1)), np.ones((1, 1))
    arguments = 1.0, 8.0, np.array([1e9]), 0.15, references, variances
    _, factors, _ = match(envelopes, *arguments)
    np.testing.assert_allclose(factors, np.exp(-0.01))
