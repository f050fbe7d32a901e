"""Changes of a recording: what ordinary sensors and loggers do, and what damages it.

Each is a function of samples, of shape (n_samples,), and their rate. It returns both.
"""

from functools import partial

import numpy as np
from scipy import signal

#: Cut-off frequencies in Hz and orders of the high-pass filters of AC-coupled sensors.
_COUPLED = (1, 10, 100, 500)
_ORDERS = (1, 2, 4, 8)
#: Cut-off frequencies of the low-pass filter of order 8, relative to half the sampling
#: rate.
_PASSED = (0.5, 0.25, 0.125)
#: Factors on the sampling rate.
_RESAMPLED = ("1/4", "1/2", "2", "4")
#: Bits of the converter, of which the recording fills the range.
_BITS = (8, 10, 12, 16, 24)
#: Seconds over which an automatic gain control averages.
_GAIN_SECONDS = 0.1


def _filtered(samples, rate, order, frequency, kind):
    sections = signal.butter(order, frequency, kind, fs=rate, output="sos")
    return signal.sosfilt(sections, samples - samples.mean()), rate


def _resampled(samples, rate, factor):
    up, _, down = factor.partition("/")
    up = int(up)
    down = int(down or 1)
    return signal.resample_poly(samples, up, down), rate * up / down


def _quantised(samples, rate, bits):
    step = 2 * np.abs(samples).max() / 2**bits
    return np.round(samples / step) * step, rate


def _velocity(samples, rate, frequency):
    return _filtered(
        np.cumsum(samples - samples.mean()) / rate, rate, 2, frequency, "highpass"
    )


def _gain_controlled(samples, rate):
    share = np.exp(-1 / (_GAIN_SECONDS * rate))
    centred = samples - samples.mean()
    start = [share * np.mean(centred**2)]
    power, _ = signal.lfilter([1 - share], [1, -share], centred**2, zi=start)
    return centred / np.sqrt(power), rate


#: Groups of treatments after which a good recording is still good.
ORDINARY = {
    "as recorded": {"as recorded": lambda samples, rate: (samples, rate)},
    "high-pass": {
        f"high-pass {frequency} Hz, order {order}": partial(
            _filtered, order=order, frequency=frequency, kind="highpass"
        )
        for frequency in _COUPLED
        for order in _ORDERS
    },
    "low-pass": {
        f"low-pass {share} of half the rate": lambda samples, rate, share=share: (
            _filtered(samples, rate, 8, share * rate / 2, "lowpass")
        )
        for share in _PASSED
    },
    "resampled": {
        f"rate x {each}": partial(_resampled, factor=each) for each in _RESAMPLED
    },
    "quantised": {f"{bits} bit": partial(_quantised, bits=bits) for bits in _BITS},
    "velocity": {
        f"velocity from {frequency} Hz": partial(_velocity, frequency=frequency)
        for frequency in (1, 10)
    },
    "gain control": {"gain control": _gain_controlled},
}


def _with_part(samples, share, value):
    changed = samples.copy()
    start = len(samples) // 4
    changed[start : start + int(share * len(samples))] = value
    return changed


def _constant(samples, rate):
    return np.full_like(samples, samples[0]), rate


def _lost(samples, rate):
    return np.where(np.arange(len(samples)) == len(samples) // 3, np.nan, samples), rate


def _unplugged(samples, rate):
    return _with_part(samples, 0.6, 0.0), rate


def _stuck(samples, rate):
    return _with_part(samples, 0.2, samples[len(samples) // 4]), rate


def _dropouts(samples, rate):
    return np.where(np.arange(len(samples)) % 12 < 8, 0.0, samples), rate


def _few_levels(samples, rate):
    return np.round(6 * (samples - samples.min()) / np.ptp(samples)), rate


def _clipped(samples, rate):
    centred = samples - samples.mean()
    full = np.quantile(np.abs(centred), 0.95)
    return centred.clip(-full, full), rate


def _wrapped(samples, rate):
    centred = samples - samples.mean()
    full = np.quantile(np.abs(centred), 0.95)
    return (centred / full + 1) % 2 - 1, rate


def _hum(samples, rate):
    seconds = np.arange(len(samples)) / rate
    return samples - samples.mean() + 150 * samples.std() * np.sin(
        100 * np.pi * seconds
    ), rate


def _sine(samples, rate):
    return np.sin(2 * np.pi * 159.2 * np.arange(len(samples)) / rate), rate


def _harmonics(samples, rate):
    angle = 2 * np.pi * 25 * np.arange(len(samples)) / rate
    return sum(np.sin(h * angle + h**2) / h for h in range(1, 6)), rate


#: Treatments after which no recording can be diagnosed.
DAMAGED = {
    "constant": _constant,
    "one sample not finite": _lost,
    "60 % zero": _unplugged,
    "20 % stuck": _stuck,
    "dropouts, 2 of 3 samples": _dropouts,
    "7 levels": _few_levels,
    "5 % clipped": _clipped,
    "5 % wrapped round": _wrapped,
    "hum of 50 Hz, 40 dB above": _hum,
    "sine without noise": _sine,
    "5 harmonics without noise": _harmonics,
}
