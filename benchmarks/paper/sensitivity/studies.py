"""The sensitivity studies: functions from draws of the simulated rig to data frames.

Each returns one row for each setting, diagnoser, crack size and draw, with the accuracy
in % at 300, 400 and 450 rpm after calibration at 500 rpm, unless it states otherwise.
NaN: gains refused.
"""

import numpy as np
import pandas as pd

from benchmarks.paper.sensitivity.protocol import (
    CRACKS,
    DIAGNOSERS,
    FRESH,
    HEALTHY,
    TRAIN_RPM,
    accuracy,
    calibrated,
    is_refused,
    percentage,
    rows_of,
    standard_rig,
)
from skarxlag.datasets import simulate_rig
from skarxlag.datasets.rig import Rig

NOISE_MV = (0.5, 2.0, 5.0, 20.0)
WINDOW_LENGTHS = (300, 1200, 2400, 4800, 8000)
ORDERS = (4, 8, 16, 32, 64)
POLES = (0.0, 0.3, 0.6, 0.8, "optimise")
TEST_RPM = (200, 300, 400, 450, 500, 550, 600, 700)
CALIBRATION_RPM = (300, 500)


def _cases(seeds):
    for seed in seeds:
        for crack_mm in CRACKS:
            for name, make in DIAGNOSERS.items():
                yield {"seed": seed, "crack_mm": crack_mm, "diagnoser": name}, make


def noise(seeds, n_samples):
    """White sensor noise; in the calibration as well, or in the test alone.

    The signal-to-noise ratio is that of normal windows at the speeds of the test.
    """
    rows = []
    for seed in seeds:
        rigs = {
            level: simulate_rig(
                n_samples=n_samples, rig=Rig(noise_level=level / 1e3), random_state=seed
            )
            for level in NOISE_MV
        }
        clean = rigs[NOISE_MV[0]]
        normal = (clean.target == HEALTHY) & (clean.rpm != TRAIN_RPM)
        power = clean.data[normal, 0].var() - (NOISE_MV[0] / 1e3) ** 2
        for case, make in _cases([seed]):
            crack_mm = case["crack_mm"]
            at_default = calibrated(make(healthy=HEALTHY), clean, crack_mm)
            for level, rig in rigs.items():
                setting = {
                    "noise (mV)": level,
                    "SNR (dB)": 10 * np.log10(power / (level / 1e3) ** 2),
                }
                without_noise = accuracy(at_default, rig, crack_mm)
                if rig is clean:
                    same = without_noise
                else:
                    diagnoser = calibrated(make(healthy=HEALTHY), rig, crack_mm)
                    same = accuracy(diagnoser, rig, crack_mm)
                for noise_then, score in (
                    ("the same", same),
                    ("0.5 mV", without_noise),
                ):
                    scored = {"calibrated with": noise_then, "accuracy": score}
                    rows.append(case | setting | scored)
    return pd.DataFrame(rows)


def window_length(seeds, n_samples):
    """Window length; the recordings stay the same, so longer windows are fewer."""
    rows = []
    for length in WINDOW_LENGTHS:
        for seed in seeds:
            rig = simulate_rig(
                n_samples=n_samples // length * length,
                window_length=length,
                random_state=seed,
            )
            setting = {
                "window length": length,
                "ms": 1e3 * length / rig.sampling_rate,
                "windows to calibrate a condition": n_samples // length,
            }
            for case, make in _cases([seed]):
                diagnoser = calibrated(make(healthy=HEALTHY), rig, case["crack_mm"])
                rows.append(
                    case
                    | setting
                    | {"accuracy": accuracy(diagnoser, rig, case["crack_mm"])}
                )
    return pd.DataFrame(rows)


def _identification(seeds, n_samples, name, values):
    rows = []
    for case, make in _cases(seeds):
        rig = standard_rig(case["seed"], n_samples)
        for value in values:
            diagnoser = make(healthy=HEALTHY).set_params(**{f"identify__{name}": value})
            score = np.nan
            observer = diagnoser.named_steps.get("observe")
            if name == "pole" and observer is not None and value != "optimise":
                observer.set_params(pole=value)
            if observer is None or not is_refused(observer):
                calibrated(diagnoser, rig, case["crack_mm"])
                score = accuracy(diagnoser, rig, case["crack_mm"])
            rows.append(case | {name: value, "accuracy": score})
    return pd.DataFrame(rows)


def order(seeds, n_samples):
    """Order of the Laguerre networks of output and torque."""
    return _identification(seeds, n_samples, "order", ORDERS)


def pole(seeds, n_samples):
    """Pole of the networks and, where there is an observer, of the observer.

    An observer keeps its default pole if the pole of the networks is optimised.
    """
    return _identification(seeds, n_samples, "pole", POLES)


def torque(seeds, n_samples):
    """The measured torque as an input, or the output alone."""
    rows = []
    for case, make in _cases(seeds):
        rig = standard_rig(case["seed"], n_samples)
        alone = rig | {"data": rig.data[:, :1]}
        for label, seen in (
            ("output and torque", rig),
            ("output alone", type(rig)(**alone)),
        ):
            diagnoser = calibrated(make(healthy=HEALTHY), seen, case["crack_mm"])
            score = accuracy(diagnoser, seen, case["crack_mm"])
            crack = {"crack size": f"{case['crack_mm']:g} mm"}
            rows.append(case | crack | {"measured": label, "accuracy": score})
    return pd.DataFrame(rows)


def speed(seeds, n_samples):
    """Accuracy by calibration and test speed, on recordings that are not in the calibration."""
    rows = []
    for seed in seeds:
        rig = standard_rig(seed, n_samples)
        fresh = simulate_rig(
            rpm=TEST_RPM, n_samples=n_samples, random_state=seed + FRESH
        )
        for case, make in _cases([seed]):
            crack_mm = case["crack_mm"]
            for train_rpm in CALIBRATION_RPM:
                diagnoser = calibrated(
                    make(healthy=HEALTHY), rig, crack_mm, rpm=train_rpm
                )
                for rpm in TEST_RPM:
                    kept = rows_of(fresh, crack_mm, rpm=rpm)
                    hits = diagnoser.predict(fresh.data[kept]) == fresh.target[kept]
                    rows.append(
                        case
                        | {
                            "calibrated at": train_rpm,
                            "rpm": rpm,
                            "accuracy": percentage(hits),
                        }
                    )
    return pd.DataFrame(rows)


def crack_size(seeds, n_samples):
    """Calibration on one crack size or both, test on each, at 500 rpm and at the other speeds.

    All tests are on recordings that are not in the calibration; only faulty windows are
    scored, as the normal ones are the same for both sizes.
    """
    rows = []
    for seed in seeds:
        rig = standard_rig(seed, n_samples)
        fresh = standard_rig(seed + FRESH, n_samples)
        for name, make in DIAGNOSERS.items():
            for trained in (*CRACKS, None):
                diagnoser = calibrated(make(healthy=HEALTHY), rig, trained)
                on = "both" if trained is None else f"{trained:g} mm"
                case = {"seed": seed, "diagnoser": name, "calibrated on": on}
                for crack_mm in CRACKS:
                    faulty = fresh.crack_mm == crack_mm
                    for at, kept in (
                        ("500 rpm", faulty & (fresh.rpm == TRAIN_RPM)),
                        ("300 to 450 rpm", faulty & (fresh.rpm != TRAIN_RPM)),
                    ):
                        hits = diagnoser.predict(fresh.data[kept]) == fresh.target[kept]
                        tested = {"tested at": at, "tested on": f"{crack_mm:g} mm"}
                        rows.append(case | tested | {"accuracy": percentage(hits)})
    return pd.DataFrame(rows)
