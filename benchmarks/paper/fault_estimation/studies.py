"""Fault estimates against known faults, on draws of the simulated rig: functions to data frames."""

import numpy as np
import pandas as pd

from benchmarks.paper.fault_estimation.metrics import (
    aligned,
    bias,
    delay,
    normalised_error,
    settling_time,
)
from benchmarks.paper.fault_estimation.signals import (
    CONDITIONS,
    POLE,
    SHAPES,
    bearing_fault,
    identified,
    recordings,
    seen_through,
    synthetic_fault,
)
from skarxlag import ExtendedStatePIObserver, PIObserver

#: Added to a draw for the recording that the healthy model is identified on.
OTHER = 1000
CRACKS = (3.0, 6.0)
KP = PIObserver().kp
KI = (0.005, 0.02, 0.05, 0.15, 0.4)
#: Steps whose settling is reported, in units of the healthy output.
SIZES = (0.1, 1.0, 5.0)
#: Both poles of the loop in the origin: the estimate is the disturbance two samples
#: before.
DEAD_BEAT = {"kp": POLE + 1, "ki": 1.0}


def step_response(observer, size, n_samples=5_000):
    """Estimate of a step in the first sample, free of noise."""
    seen = seen_through(POLE, np.full((1, n_samples), size))
    return observer.fit(seen).observe(seen).fault_estimate[0]


def settling(observer, size=1.0):
    """Samples until the estimate of a step stays within 5 % of it."""
    return settling_time(step_response(observer, size), size, 0)


def as_fast_as(observer):
    """The linear observer of least integral gain that settles as soon as another does."""
    goal = settling(observer)
    gains = np.arange(0.02, 0.5, 0.002)
    chosen = next(
        ki for ki in gains if settling(PIObserver(pole=POLE, kp=KP, ki=ki)) <= goal
    )
    return PIObserver(pole=POLE, kp=KP, ki=float(chosen))


def compared():
    """The observers that the studies compare, by name."""
    ki = PIObserver().ki
    extended = ExtendedStatePIObserver(pole=POLE, kp=KP, ki=ki, n_observers=1)
    return {
        "extended state": extended,
        "linear, same small-signal gain": PIObserver(pole=POLE, kp=KP, ki=ki),
        "linear, same settling": as_fast_as(extended),
        "linear, dead-beat": PIObserver(pole=POLE, **DEAD_BEAT),
    }


def _estimate(observer, innovations):
    return observer.fit(innovations).observe(innovations).fault_estimate


def measures(estimate, true):
    """Compute the reported figures of an estimate; its last sample has no counterpart in `true`."""
    estimate = estimate[:, :-1]
    lag, correlation = delay(estimate, true)
    return {
        "error": normalised_error(estimate, true),
        "delay": lag,
        "correlation": correlation,
        "bias": bias(estimate, true),
    }


def observers(seeds, n_samples):
    """Settling times at steps of three sizes, and noise of the estimate on a healthy bearing."""
    rows = []
    for seed in seeds:
        healthy = identified(seed + OTHER, n_samples)
        rig = recordings(seed, n_samples)
        quiet = healthy.innovations(rig.data[rig.target == "Normal"])
        for name, observer in compared().items():
            row = {
                "seed": seed,
                "observer": name,
                "noise": _rms(_estimate(observer, quiet)),
            }
            for size in SIZES:
                row[f"settling at {size:g}"] = settling(observer, size)
            rows.append(row)
    return pd.DataFrame(rows)


def synthetic(seeds, n_samples):
    """Faults of known shape on a healthy bearing.

    Error and delay over whole windows; bias over the last quarter, where a step has
    settled, and there once more with the fault added to the output before windows are
    centred.
    """
    rows = []
    for seed in seeds:
        healthy = identified(seed + OTHER, n_samples)
        rig = recordings(seed, n_samples)
        for shape in SHAPES:
            fault = synthetic_fault(healthy, rig, shape)
            last = (
                slice(3 * fault.true.shape[1] // 4, None)
                if shape != "impact"
                else slice(None)
            )
            for name, observer in compared().items():
                row = {"seed": seed, "fault": shape, "observer": name}
                estimate = _estimate(observer, fault.innovations)
                centred = _estimate(observer, fault.through_windows)
                row |= measures(estimate, fault.true)
                row["bias"] = bias(estimate[:, :-1][:, last], fault.true[:, last])
                row["bias, centred windows"] = bias(
                    centred[:, :-1][:, last], fault.true[:, last]
                )
                rows.append(row)
    return pd.DataFrame(rows)


def bearing(seeds, n_samples):
    """The rig's own faults: impacts and rubbing of a crack, whole windows.

    "aligned error" is the error once the delay is taken out, "level" the
    root-mean-square of the estimate over that of the true signal, which is in the
    column "true".
    """
    rows = []
    for seed in seeds:
        healthy = identified(seed + OTHER, n_samples)
        rig = recordings(seed, n_samples)
        for crack_mm in CRACKS:
            for condition in CONDITIONS:
                fault = bearing_fault(healthy, rig, condition, crack_mm)
                for name, observer in compared().items():
                    estimate = _estimate(observer, fault.innovations)
                    row = {"seed": seed, "crack_mm": crack_mm, "condition": condition}
                    row |= {"observer": name, "true": _rms(fault.true)}
                    row |= measures(estimate, fault.true)
                    moved = aligned(estimate[:, :-1], fault.true, row["delay"])
                    row["aligned error"] = normalised_error(*moved)
                    row["level"] = _rms(estimate) / row["true"]
                    rows.append(row)
    return pd.DataFrame(rows)


def gains(seeds, n_samples):
    """Integral gain of both observers: noise, settling, a step, a ramp and impacts.

    The extended state has the small-signal gain of the linear observer in the same row.
    """
    settings = [(KP, ki) for ki in KI] + [(DEAD_BEAT["kp"], DEAD_BEAT["ki"])]
    rows = []
    for seed in seeds:
        healthy = identified(seed + OTHER, n_samples)
        rig = recordings(seed, n_samples)
        quiet = healthy.innovations(rig.data[rig.target == "Normal"])
        faults = {
            shape: synthetic_fault(healthy, rig, shape) for shape in ("step", "ramp")
        }
        faults["OR, 6 mm"] = bearing_fault(healthy, rig, "OR", 6.0)
        for kp, ki in settings:
            observers = {
                "linear": PIObserver(pole=POLE, kp=kp, ki=ki),
                "extended state": ExtendedStatePIObserver(
                    pole=POLE, kp=kp, ki=ki, n_observers=1
                ),
            }
            for name, observer in observers.items():
                row = {"seed": seed, "kp": kp, "ki": ki, "observer": name}
                rows.append(row | _gain_row(observer, quiet, faults))
    return pd.DataFrame(rows)


def _gain_row(observer, quiet, faults):
    row = {"settling": settling(observer), "noise": _rms(_estimate(observer, quiet))}
    for shape, fault in faults.items():
        estimate = _estimate(observer, fault.innovations)[:, :-1]
        row[f"{shape}: error"] = normalised_error(estimate, fault.true)
        if shape == "OR, 6 mm":
            lag, _ = delay(estimate, fault.true)
            moved = aligned(estimate, fault.true, lag)
            row[f"{shape}: delay"] = lag
            row[f"{shape}: aligned error"] = normalised_error(*moved)
    return row


def _rms(signal):
    return float(np.sqrt(np.mean(signal**2)))
