"""Rigs drawn at random: vibration and acoustic emission of bearings whose numbers nobody chose.

A family fixes what is special about a rig, a seed draws all the rest. Every rig has three speeds
and a healthy condition first. Vibration is made of

- strikes of a local fault at its order of the shaft, with slip, through the modes of the structure,
  which each place of a fault excites in shares of its own;
- rubbing at the fault between the strikes, whose level follows the speed by a law of its own and,
  in the family "floor", also differs between speeds by a random factor;
- background noise of the machine through the same modes;
- tones at multiples of the shaft's speed;
- a smooth change of the transfer path for each speed, partly shared by all conditions;
- white noise of the sensor, which does not grow with speed, and a gain of each recording.
"""

import numpy as np
from scipy.fft import irfft, rfft
from scipy.signal import lfilter
from sklearn.utils import Bunch

from skarxlag.datasets import simulate_rig
from skarxlag.datasets.rig import Rig
from skarxlag.datasets.transmission import TransmissionPath, TransmissionPaths

WINDOWS_A_HALF = 24
#: Orders of the shaft at which faults strike: outer race, inner race, ball.
ORDERS = {"outer": 3.1, "inner": 4.9, "ball": 4.0}
#: What a family changes in `_vibration`: ranges that a seed draws from.
VIBRATION = {
    "strikes": {},
    "tones": {"n_tones": (10, 25), "tone_level": (0.5, 2.0)},
    "floor": {"floor_change": (0.5, 1.0), "rubbing": (0.5, 1.5)},
    "severity": {"n_places": (1, 1), "n_severities": (4, 5)},
    "noisy": {"noise_db": (-8.0, 2.0)},
    "wide": {"speed_ratio": (1.5, 2.0)},
}
_RANGES = {
    "n_places": (3, 3),
    "n_severities": (1, 2),
    "speed_ratio": (1.15, 1.4),
    "n_tones": (0, 6),
    "tone_level": (0.05, 0.4),
    "floor_change": (0.0, 0.15),
    "rubbing": (0.1, 0.6),
    "noise_db": (-35.0, -15.0),
}
EMISSION = ("emission", "emission and torque")
FAMILIES = (*VIBRATION, *EMISSION)


def random_rig(family, seed, window_length=1200, windows_a_half=None, *, one_order_a_place=False):
    """Windows of one rig.

    Parameters
    ----------
    family : str
        Of `FAMILIES`.
    seed : int
        Draws the rig.
    window_length : int, default=1200
        Samples in a window.
    windows_a_half : int or None, default=None
        Windows in half a recording; None for `WINDOWS_A_HALF`.
    one_order_a_place : bool, default=False
        Whether all severities of a fault strike at one order, in the families of vibration.

    Returns
    -------
    Bunch
        As the rigs of ``benchmarks.cross_speed.rigs``.
    """
    rng = np.random.default_rng([FAMILIES.index(family), seed])
    n_windows = 2 * (WINDOWS_A_HALF if windows_a_half is None else windows_a_half)
    if family in EMISSION:
        return _emission(rng, n_windows, window_length, has_torque=family == EMISSION[1])
    ranges = _RANGES | VIBRATION[family]
    return _vibration(rng, n_windows, window_length, ranges, one_order_a_place)


def _drawn(rng, ranges):
    """A number from each range, whole where the ends are."""
    return {
        name: int(rng.integers(low, high + 1)) if isinstance(low, int) else rng.uniform(low, high)
        for name, (low, high) in ranges.items()
    }


def _bunch(parts, window_length, sampling_rate):
    """Windows of recordings: parts of (condition, rpm, array of shape (n_channels, n_samples))."""
    data, target, rpm, recording, start = [], [], [], [], []
    for name, speed, signal in parts:
        n = signal.shape[-1] // window_length
        windows = signal[..., : n * window_length].reshape(len(signal), n, window_length)
        data.append(windows.swapaxes(0, 1))
        target += [name] * n
        rpm += [speed] * n
        recording += [f"{name} {speed:g}"] * n
        start += range(0, n * window_length, window_length)
    data = np.concatenate(data)
    names = list(dict.fromkeys(target))
    return Bunch(
        data=data[:, 0] if data.shape[1] == 1 else data,
        target=np.array(target),
        target_names=names,
        rpm=np.array(rpm, dtype=float),
        recording=np.array(recording),
        start=np.array(start),
        sampling_rate=sampling_rate,
    )


def _emission(rng, n_windows, window_length, has_torque):
    """The package's simulated rig with paths, levels and conditions drawn at random."""

    def path():
        n = int(rng.integers(2, 5))
        return TransmissionPath(
            frequencies=tuple(rng.uniform(0.05, 0.45, n) * sampling_rate),
            damping=tuple(rng.uniform(0.02, 0.15, n)),
            amplitudes=tuple(rng.lognormal(0, 0.7, n)),
            gain=float(rng.lognormal(0, 0.4)),
            delay=0.0,
        )

    sampling_rate = float(rng.uniform(100e3, 400e3))
    speeds = float(rng.uniform(300, 900)) * float(rng.uniform(1.15, 1.5)) ** np.arange(3)
    faults = ["IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]
    chosen = rng.choice(faults, size=4, replace=False).tolist()
    rig = simulate_rig(
        rpm=speeds.round().tolist(),
        crack_mm=float(rng.uniform(2, 5)),
        conditions=["Normal", *chosen],
        n_samples=n_windows * window_length,
        window_length=window_length,
        rig=Rig(
            sampling_rate=sampling_rate,
            paths=TransmissionPaths(outer=path(), inner=path(), ball=path()),
            torque_leak=tuple(rng.normal(0, 0.1, 4)) if has_torque else (),
            impact_level=float(rng.uniform(0.2, 1.0)),
            friction_level=float(rng.uniform(0.01, 0.04)),
            rubbing_level=float(rng.uniform(0.003, 0.02)),
            noise_level=float(10 ** rng.uniform(-4, -2.7)),
        ),
        random_state=int(rng.integers(2**31)),
    )
    if not has_torque:
        rig.data = np.ascontiguousarray(rig.data[:, 0])
    return rig


def _vibration(rng, n_windows, window_length, ranges, one_order_a_place):
    number = _drawn(rng, ranges)
    n_samples = n_windows * window_length
    sampling_rate = 10 ** rng.uniform(np.log10(20e3), np.log10(51.2e3))
    speeds = rng.uniform(500, 1500) * number["speed_ratio"] ** np.arange(3)
    n_modes = int(rng.integers(5, 10))
    modes = rng.uniform(0.02, 0.47, n_modes), rng.uniform(0.01, 0.06, n_modes)
    places = rng.permutation(list(ORDERS))[: number["n_places"]]
    conditions = {"healthy": None}
    for place in places:
        shares = rng.lognormal(0, 0.8, n_modes) * rng.choice([-1, 1], n_modes)
        for severity in range(number["n_severities"]):
            # A larger fault strikes harder and with a longer pulse, and rubs more.
            growth = 1.6**severity * rng.lognormal(0, 0.15)
            conditions[f"{place} {severity}"] = {
                "order": ORDERS[place] * rng.uniform(0.95, 1.05),
                "shares": shares * rng.lognormal(0, 0.15, n_modes),
                "strike": rng.uniform(1.5, 4.0) * growth,
                "pulse": rng.uniform(0.2, 0.6) + 0.1 * severity,
                "rubbing": number["rubbing"] * growth,
                "turns": place != "outer",
            }
            if one_order_a_place:
                first = conditions[f"{place} 0"]
                conditions[f"{place} {severity}"]["order"] = first["order"]
    background = rng.lognormal(0, 0.5, n_modes), rng.uniform(0.3, 0.8)
    laws = dict(zip(("strike", "rubbing", "background"), rng.uniform(0.6, 1.6, 3), strict=True))
    tones = rng.uniform(1, 60, number["n_tones"]), rng.lognormal(0, 0.5, number["n_tones"])
    parts = []
    for speed in speeds:
        relative = speed / speeds[0]
        shared = _smooth_path(rng, abs(np.log(relative)))
        for name, fault in conditions.items():
            noise = _ringing(rng.normal(size=n_samples), modes, background[0])
            signal = relative ** laws["background"] * (
                _unit(noise) + background[1] * rng.normal(size=n_samples)
            )
            if fault is not None:
                change = np.exp(number["floor_change"] * rng.normal())
                rubbing = _ringing(rng.normal(size=n_samples), modes, fault["shares"])
                signal += fault["rubbing"] * change * relative ** laws["rubbing"] * _unit(rubbing)
                train = _strikes(rng, fault, speed / 60 / sampling_rate, n_samples)
                signal += relative ** laws["strike"] * _ringing(train, modes, fault["shares"])
            turn = 2 * np.pi * speed / 60 / sampling_rate * np.arange(n_samples)
            for order, level in zip(*tones, strict=True):
                wave = np.sin(order * turn + rng.uniform(0, 2 * np.pi))
                signal += number["tone_level"] * level * relative * wave
            signal = _through(signal, shared + 0.5 * _smooth_path(rng, abs(np.log(relative))))
            noise_level = 10 ** (number["noise_db"] / 20)
            signal += noise_level * rng.normal(size=n_samples)
            parts.append((name, float(round(speed)), rng.lognormal(0, 1) * signal[np.newaxis]))
    return _bunch(parts, window_length, sampling_rate)


def _unit(signal):
    return signal / np.sqrt(np.mean(signal**2))


def _ringing(source, modes, shares):
    """Source through all modes; frequencies in cycles a sample."""
    found = np.zeros(len(source))
    for frequency, damping, share in zip(*modes, shares, strict=True):
        angle = 2 * np.pi * frequency
        radius = np.exp(-damping * angle)
        found += share * lfilter(
            [np.sin(angle)], [1, -2 * radius * np.cos(angle), radius**2], source
        )
    return found


def _strikes(rng, fault, turns_a_sample, n_samples):
    interval = 1 / (fault["order"] * turns_a_sample)
    n = int(n_samples / interval * 1.2) + 5
    times = rng.uniform(0, interval) + np.cumsum(interval * (1 + 0.015 * rng.normal(size=n)))
    times = times[times < n_samples - 1]
    sizes = fault["strike"] * rng.lognormal(0, 0.25, len(times))
    if fault["turns"]:
        sizes *= np.clip(0.4 + np.cos(2 * np.pi * turns_a_sample * times), 0, None)
    train = np.zeros(n_samples)
    np.add.at(train, times.astype(int), sizes)
    return lfilter([1 - fault["pulse"]], [1, -fault["pulse"]], train)


def _smooth_path(rng, log_ratio):
    """Cosine coefficients of a smooth log gain, larger for a larger change of speed."""
    n = np.arange(1, 9)
    return np.sqrt(log_ratio) * 0.6 * rng.normal(size=8) / n


def _through(signal, coefficients):
    """Signal under a log gain over frequency that its cosine coefficients give."""
    spectrum = rfft(signal)
    frequency = np.linspace(0, np.pi, len(spectrum))
    n = np.arange(1, len(coefficients) + 1)
    # In nepers of power: half of it in nepers of amplitude.
    return irfft(
        spectrum * np.exp(0.5 * np.cos(np.outer(frequency, n)) @ coefficients), len(signal)
    )
