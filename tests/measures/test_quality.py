import os
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import butter, oaconvolve, resample_poly, sosfilt

from skarxlag import (
    bearing_orders,
    make_alpio,
    make_windows,
    read_recording,
    recording_verdicts,
    signal_quality,
    window_verdicts,
)
from skarxlag.datasets import simulate_rig

rng = np.random.default_rng(0)
NOISE = rng.normal(size=(6, 1200))


def one(window, **arguments):
    return signal_quality(np.asarray(window)[np.newaxis], **arguments)[0]


@pytest.mark.parametrize("factor", [1.0, -3.0, 1e300, 1e-300])
@pytest.mark.parametrize("offset", [0.0, 100.0])
def test_every_kind_in_any_unit(factor, offset):
    windows = np.concatenate([NOISE, NOISE[:1]])
    windows[1] = 0.3
    windows[2, 500:] = windows[2, 500]
    windows[3] = np.round(windows[3] / 2)
    windows[4] = windows[4].clip(-1.5, 1.5)
    windows[5, 7] = np.nan
    found = signal_quality(factor * (windows + offset))
    assert found.tolist() == [
        "good",
        "constant",
        "held",
        "coarse",
        "clipped",
        "not finite",
        "good",
    ]


@pytest.mark.parametrize("value", [0.0, 5.0, -1e308, 0.1])
def test_dead_sensor(value):
    assert one(np.full(300, value)) == "constant"
    # What is left when a mean is taken off is rounding.
    assert (
        one(np.full(300, value) * (1 + 2e-16 * rng.integers(0, 2, size=300)))
        == "constant"
    )


def test_dropouts_are_tolerated_up_to_the_stated_share():
    window = NOISE[0].copy()
    window.reshape(-1, 12)[:, :4] = 0.0
    assert one(window) == "good"
    window.reshape(-1, 12)[:, :8] = 0.0
    assert one(window) == "held"


def test_a_stuck_part_is_tolerated_up_to_the_stated_share():
    window = NOISE[0].copy()
    window[100:200] = 0.0
    assert one(window) == "good"
    window[100:240] = 0.0
    assert one(window) == "stuck"


def test_clipping_is_tolerated_up_to_the_stated_share():
    window = NOISE[0].clip(-2.6, 2.6)
    assert one(window) == "good"
    assert one(NOISE[0].clip(-9, 1)) == "clipped"


def test_one_step_of_a_16_bit_converter_is_no_fault_of_a_signal():
    assert one(np.round(NOISE[0] * 30).astype(np.int16)) == "good"
    assert one(np.round(NOISE[0] * 0.4).astype(np.int16)) == "held"
    assert one(np.round(NOISE[0] * 0.8).astype(np.int16)) == "coarse"


def test_inputs_may_be_constant_but_not_nan():
    windows = np.stack([NOISE, np.full_like(NOISE, 40.0)], axis=1)
    windows[2, 1, 3] = np.inf
    windows[3, 0] = 1.0
    found = signal_quality(windows)
    assert found.tolist() == ["good", "good", "not finite", "constant", "good", "good"]


@pytest.mark.parametrize("n_samples", [2, 3, 5, 63])
def test_short_windows_are_good(n_samples):
    assert set(signal_quality(rng.normal(size=(200, n_samples)))) == {"good"}


def test_type_and_layout_do_not_matter():
    windows = np.concatenate([NOISE, NOISE.clip(-1, 1)])
    expected = signal_quality(windows)
    for other in (
        windows.astype(">f4"),
        windows.astype(np.float32),
        np.asfortranarray(windows),
        windows.tolist(),
    ):
        assert signal_quality(other).tolist() == expected.tolist()
    windows.flags.writeable = False
    assert signal_quality(windows).tolist() == expected.tolist()


def test_windows_are_judged_one_by_one():
    windows = np.tile(NOISE, (30, 1))
    windows[::7] = 0
    assert signal_quality(windows).tolist() == [one(w) for w in windows]


@pytest.mark.parametrize(
    ("X", "arguments", "message"),
    [
        (NOISE, {"sampling_rate": 0.0}, "sampling_rate == 0"),
        (
            NOISE,
            {"rpm": [900, 900]},
            r"rpm == \[900, 900\], expected one speed for each window",
        ),
        (NOISE, {"rpm": "fast"}, "rpm must hold numbers"),
        (NOISE[0], {}, "Expected 2D array"),
        (NOISE[np.newaxis, np.newaxis], {}, r"X.shape == \(1, 1, 6, 1200\)"),
    ],
)
def test_errors_name_what_is_wrong(X, arguments, message):
    with pytest.raises(ValueError, match=message):
        signal_quality(X, **arguments)


DATA = os.environ.get("SKARXLAG_DATA")
REAL = {
    "uestc": ("uestc/Data/I_1200/I_1200_1.mat", 20_000.0),
    "uestc, healthy": ("uestc/Data/N_800/N_800_1.mat", 20_000.0),
    "hit_sm": ("hit_sm/Self-built dataset/OR5_1200.mat", 51_200.0),
    "cwru": ("cwru_drive_end/inner007_1797.npz", 12_000.0),
}
LENGTH = 4800


@pytest.fixture(scope="module", params=["simulated", *REAL])
def recorded(request):
    """Windows that carry a signal, and their sampling rate."""
    if request.param == "simulated":
        n = 4 * LENGTH  # Three periods of 50 Hz and more.
        rig = simulate_rig(rpm=500, crack_mm=3, n_samples=4 * n, window_length=n)
        return rig.data[:, 0], rig.sampling_rate
    if DATA is None:
        pytest.skip("SKARXLAG_DATA is not set")
    name, sampling_rate = REAL[request.param]
    path = Path(DATA) / name
    channel = "acceleration" if path.suffix == ".npz" else 0
    signal, _ = read_recording(path, channel=channel)
    return make_windows(signal[: 20 * LENGTH], LENGTH), sampling_rate


def wrapped(windows, overshoot):
    """As int16 of which so many of the largest values are out of range."""
    full = np.quantile(np.abs(windows), 1 - overshoot, axis=1, keepdims=True)
    return np.round(32768 * windows / full).astype(np.int64).astype(np.int16)


def with_hum(windows, sampling_rate, frequency, decibel):
    seconds = np.arange(windows.shape[1]) / sampling_rate
    amplitude = np.sqrt(2) * windows.std(axis=1, keepdims=True) * 10 ** (decibel / 20)
    return windows + amplitude * np.sin(2 * np.pi * frequency * seconds + 1)


def below(windows, high):
    """Without the frequencies above a share of the highest one."""
    spectra = np.fft.rfft(windows, axis=1)
    spectra[:, int(high * windows.shape[1] / 2) :] = 0
    return np.fft.irfft(spectra, windows.shape[1], axis=1)


def share_of(windows, kind, least=0.9, **arguments):
    """Mean share of the windows of a kind, which must be nearly all."""
    quality, share = signal_quality(windows, return_share=True, **arguments)
    assert np.mean(quality == kind) > least, np.unique(quality, return_counts=True)
    return share[quality == kind].mean()


def test_recorded_windows_are_good(recorded):
    windows, sampling_rate = recorded
    windows = windows - windows.mean(axis=1, keepdims=True)
    for scale in (1, 1e-6, 3000):
        quality = signal_quality(scale * windows, sampling_rate=sampling_rate)
        assert np.all(quality == "good")
    quality, share = signal_quality(
        np.round(200 * windows / windows.std()), return_share=True
    )
    assert np.all(quality == "good") and np.all(share == 0)


@pytest.mark.parametrize("overshoot", [0.03, 0.06])
def test_integers_that_wrapped_round(recorded, overshoot):
    windows = recorded[0] - recorded[0].mean(axis=1, keepdims=True)
    assert (
        0 < share_of(wrapped(windows, overshoot), "wrapped", least=0.75) < 3 * overshoot
    )


@pytest.mark.parametrize("n_samples", [400, 1200, 4800])
def test_noise_did_not_wrap_round(n_samples):
    noise = np.random.default_rng(2).normal(size=(2000, n_samples))
    assert np.all(signal_quality(noise) == "good")


def test_clipping_of_a_recording(recorded):
    windows = recorded[0] - recorded[0].mean(axis=1, keepdims=True)
    full = np.quantile(np.abs(windows), 0.95, axis=1, keepdims=True)
    assert share_of(windows.clip(-full, full), "clipped") == pytest.approx(
        0.05, abs=0.005
    )


def test_quantisation_of_a_recording(recorded):
    windows = recorded[0] - recorded[0].mean(axis=1, keepdims=True)
    steps = np.round(windows / np.ptp(windows, axis=1, keepdims=True) * 6)
    quality, share = signal_quality(steps, return_share=True)
    # Quiet recordings stay at one level for most of the time.
    assert set(quality) <= {"coarse", "held", "stuck"} and np.all(share >= 0.1)
    assert np.all(share[quality == "coarse"] >= 1 / 7)


def test_missing_bands_of_a_recording(recorded):
    windows = recorded[0] - recorded[0].mean(axis=1, keepdims=True)
    windows *= np.hanning(windows.shape[1])
    assert share_of(below(windows, 0.1), "band missing") == pytest.approx(0.9, abs=0.05)
    assert np.all(signal_quality(below(windows, 0.25)) == "good")


@pytest.mark.parametrize("noise", [0, 1e-12, 1e-9, 1e-7])
def test_a_stuck_part_of_a_recording(recorded, noise):
    windows = recorded[0].copy()
    n = windows.shape[1]
    windows[:, 1000 : 1000 + n // 5] = windows[:, 1000:1001]
    # A converter of many bits goes on to record its own noise.
    windows += (
        noise * np.ptp(windows) * np.random.default_rng(6).uniform(-1, 1, windows.shape)
    )
    assert share_of(windows, "stuck") == pytest.approx(0.2, abs=0.001)
    windows[:, : n // 2 + 100] = windows[:, n // 2 + 100 :][:, :1]
    windows += (
        noise * np.ptp(windows) * np.random.default_rng(7).uniform(-1, 1, windows.shape)
    )
    assert share_of(windows, "held") == pytest.approx(0.5 + 100 / n, abs=0.2)


@pytest.mark.parametrize("frequency", [49.8, 50, 60, 60.2])
def test_hum_of_a_recording(recorded, frequency):
    windows, sampling_rate = recorded
    windows = windows - windows.mean(axis=1, keepdims=True)
    humming = with_hum(windows, sampling_rate, frequency, 40)
    assert share_of(humming, "hum", sampling_rate=sampling_rate) > 0.999
    assert np.all(signal_quality(humming) == "good")
    # Of 10 dB, nine tenths of the energy are hum.
    faint = with_hum(windows, sampling_rate, frequency, 10)
    assert np.all(signal_quality(faint, sampling_rate=sampling_rate) == "good")


def test_a_window_shorter_than_three_periods_has_no_hum():
    humming = with_hum(NOISE, 50e3, 50, 40)
    assert np.all(signal_quality(humming, sampling_rate=50e3) == "good")
    assert np.all(signal_quality(humming[:, ::20], sampling_rate=2500.0) == "good")


@pytest.mark.parametrize(
    ("rpm", "kind"),
    [
        *[(rpm, "good") for rpm in (1500, 1490, 3000)],
        *[(rpm, "hum") for rpm in (1450, 1000, 6000, np.nan, 0, [1e5] * 3)],
    ],
)
def test_a_harmonic_of_the_shaft_is_no_hum(rpm, kind):
    noise = np.random.default_rng(0).normal(size=(3, 4000))
    assert set(
        signal_quality(with_hum(noise, 2000, 50, 40), sampling_rate=2000, rpm=rpm)
    ) == {kind}


def test_shares_of_the_other_kinds():
    windows = NOISE.copy()
    windows[1] = 4.0
    windows[2, :3] = np.nan
    windows[3].reshape(-1, 10)[:, :7] = 0.0
    windows[4, :6] = -9999.0
    quality, share = signal_quality(windows, return_share=True)
    kinds = ["good", "constant", "not finite", "held", "overflow"]
    assert quality[:5].tolist() == kinds
    assert_allclose(share[:5], [0, 1, 3 / 1200, 0.6, 6 / 1200], atol=1e-3)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("size", [999.25, -9999, 99999, 9.9e37, -9.91e37])
def test_only_outstanding_samples_are_an_overflow(size, dtype):
    window = NOISE[0].astype(dtype)
    window[500] = size
    assert one(window) == "overflow"
    window[700] = size / 2.9
    assert one(window) != "overflow"
    assert one(np.full(1200, size, dtype)) == "constant"


def test_what_is_wrong_reaches_verdicts_with_its_share():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(12, 1200))
    X[6:] = X[6:].cumsum(axis=1)
    diagnoser = make_alpio().fit(X, np.repeat(["good", "worn"], 6))
    new = X[:3].copy()
    new[1, :900] = 0.0
    new[2] = with_hum(new[2:], 2000, 50, 40)[0]
    found = window_verdicts(diagnoser, new, sampling_rate=2000)
    assert found["verdict"].tolist() == ["good", "no signal", "no signal"]
    assert found["quality"].tolist() == ["good", "held", "hum"]
    assert_allclose(found["quality share"], [0, 0.75, 1], atol=2e-3)
    run = recording_verdicts(diagnoser, new, ["run"] * 3, sampling_rate=2000)
    assert run.loc["run", "no signal"] == 2


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_one_huge_sample_hides_the_others(dtype):
    noise = np.random.default_rng(0).normal(size=(2, 400)).astype(dtype)
    noise[1, 17] = np.finfo(dtype).max / 2
    assert signal_quality(noise).tolist() == ["good", "held"]


RATE = 25_600
SECONDS = (0.05, 0.5, 3, 60)


@pytest.fixture(scope="module")
def minute():
    """A minute of impacts at the outer race of a bearing 6205 at 1500 rpm, and noise."""
    rng = np.random.default_rng(3)
    frequency = bearing_orders("6205")["outer"] * 1500 / 60
    impacts = np.zeros(60 * RATE)
    impacts[(np.arange(frequency * 60) / frequency * RATE).astype(int)] = 1.0
    seconds = np.arange(0, 0.02, 1 / RATE)
    ringing = np.exp(-1000 * seconds) * np.sin(2 * np.pi * 3200 * seconds)
    return oaconvolve(impacts, ringing)[: 60 * RATE] + 0.1 * rng.normal(size=60 * RATE)


def qualities(samples, rate=RATE):
    """Quality of the beginnings of a recording, of each length that it has."""
    lengths = [round(each * rate) for each in SECONDS if each * rate <= len(samples)]
    return [one(samples[:length], sampling_rate=rate, rpm=1500) for length in lengths]


@pytest.mark.parametrize("frequency", [1, 10, 100, 500])
@pytest.mark.parametrize("order", [1, 2, 4, 8])
def test_an_ac_coupled_sensor_is_good_at_any_length(minute, frequency, order):
    sections = butter(order, frequency, "highpass", fs=RATE, output="sos")
    assert qualities(sosfilt(sections, minute)) == ["good"] * len(SECONDS)


def test_low_pass_and_resampled_recordings_are_good_at_any_length(minute):
    sections = butter(8, 2000, fs=RATE, output="sos")
    assert qualities(sosfilt(sections, minute)) == ["good"] * len(SECONDS)
    part = minute[: 3 * RATE]
    for factor in ((1, 4), (1, 2), (4, 1)):
        rate = RATE * factor[0] / factor[1]
        found = qualities(resample_poly(part, *factor), rate)
        assert found == ["good"] * len(found)


def test_a_velocity_is_good_at_any_length(minute):
    sections = butter(2, 1, "highpass", fs=RATE, output="sos")
    velocity = sosfilt(sections, np.cumsum(minute))
    assert qualities(velocity) == ["good"] * len(SECONDS)


@pytest.mark.parametrize("bits", [8, 10, 12, 16, 24])
def test_a_converter_of_any_resolution_is_good_at_any_length(minute, bits):
    step = 2 * np.abs(minute).max() / 2**bits
    assert qualities(np.round(minute / step)) == ["good"] * len(SECONDS)


@pytest.mark.parametrize("seconds", SECONDS)
def test_a_quantised_sine_is_not_clipped(seconds):
    time = np.arange(int(seconds * RATE)) / RATE
    noise = 1e-3 * np.random.default_rng(1).normal(size=len(time))
    slow = np.sin(2 * np.pi * 25 * time) + noise
    assert one(np.round(511 * slow)) == "good"
    assert one(np.round(511 * slow.clip(-0.9, 0.9))) in ("clipped", "stuck")


def test_one_transient_does_not_hide_a_long_recording(minute):
    minute = minute.copy()
    minute[RATE] = 1e4
    assert one(minute) == "good"
    # A dead sensor is not good for one transient, however long it is.
    minute[2 * RATE :] = 1e-7 * minute[2 * RATE :]
    assert one(minute) == "held"


def test_a_few_strong_impacts_did_not_wrap_round():
    noise = np.random.default_rng(4).normal(size=20 * RATE)
    noise[RATE :: 4 * RATE] = 50.0
    noise[RATE + 1 :: 4 * RATE] = -50.0
    noise[RATE + 2 :: 4 * RATE] = 50.0
    assert one(noise) == "good"


@pytest.mark.parametrize("seconds", SECONDS)
@pytest.mark.parametrize("frequency", [25.0, 159.2, 5000.0])
def test_a_sine_without_noise_fills_few_bands(frequency, seconds):
    time = np.arange(int(seconds * RATE)) / RATE
    sine = np.sin(2 * np.pi * frequency * time).astype(np.float32)
    assert one(sine, sampling_rate=RATE) == "band missing"


@pytest.mark.parametrize("seconds", [0.1, 3, 60])
def test_hum_whose_frequency_wanders_is_found_at_any_length(minute, seconds):
    time = np.arange(int(seconds * RATE)) / RATE
    phase = 2 * np.pi * 50 * time + 3 * np.sin(2 * np.pi * time / 20)
    humming = minute[: len(time)] + 100 * minute.std() * np.sin(phase)
    assert one(humming, sampling_rate=RATE) == "hum"


@pytest.mark.parametrize(("decibel", "kind"), [(-80, "good"), (-100, "band missing")])
def test_a_band_is_empty_from_90_decibels_below_the_mean_on(decibel, kind):
    noise = np.random.default_rng(5).normal(size=(2, 20_000))
    narrow = below(noise[:1], 0.1)[0]
    # Its density is ten times the mean of all bands.
    white = noise[1] * np.sqrt(0.1) * 10 ** (decibel / 20)
    assert one(narrow + white) == kind


def test_fewer_than_512_samples_have_no_missing_band():
    sine = np.sin(0.3 * np.arange(512))
    assert one(sine) == "band missing" and one(sine[:511]) == "good"


def test_the_share_of_missing_bands():
    quality, share = signal_quality([np.sin(0.3 * np.arange(5000))], return_share=True)
    assert quality == ["band missing"] and share[0] == pytest.approx(0.94, abs=0.01)
