"""Time of the kernels next to other ways to compute the same, in one run: ratios, not seconds.

    python benchmarks/speed.py

Every pair is timed in turn, five times after a warm-up; the ratio of the medians is printed, above
1 where the package is faster.
"""

import time

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from skarxlag import ARXLaguerre, make_diagnoser
from skarxlag.kernels import arx_laguerre, observer
from skarxlag.kernels.laguerre import laguerre_matrices
from skarxlag.kernels.spectra import lagged_sums

N_WINDOWS, N_SAMPLES, ORDER, POLE = 64, 1200, 32, 0.3


def laguerre_cascade(windows):
    """States of the network by SciPy's filter, one all-pass after another."""
    low_pass = lfilter([0, np.sqrt(1 - POLE**2)], [1, -POLE], windows, axis=-1)
    states = [low_pass]
    for _ in range(ORDER - 1):
        states.append(lfilter([-POLE, 1], [1, -POLE], states[-1], axis=-1))
    return np.stack(states, axis=-1)


def triangular(windows, coef):
    """Innovations with the triangular state matrix, all windows at once."""
    A, b = laguerre_matrices(ORDER, POLE)
    states = np.zeros((len(windows), ORDER))
    errors = np.empty((N_SAMPLES, len(coef), len(windows)))
    for k in range(N_SAMPLES):
        errors[k] = windows[:, k] - coef @ states.T
        states = states @ A.T + np.outer(windows[:, k], b)
    return errors


def recursive_least_squares(samples):
    """The paper's recursion, one sample after another."""
    states = laguerre_cascade(samples)
    coef, covariance = np.zeros(ORDER), np.eye(ORDER) * 1e6
    for x, y in zip(states, samples, strict=True):
        gain = covariance @ x / (1 + x @ covariance @ x)
        coef = coef + gain * (y - coef @ x)
        covariance = covariance - np.outer(gain, x @ covariance)
    return coef


def observer_loop(innovations, pole, kp, ki):
    """The linear observer in NumPy, all windows at once."""
    error = np.empty_like(innovations)
    correction = integral = np.zeros(len(innovations))
    for k in range(innovations.shape[1]):
        error[:, k] = innovations[:, k] - correction
        correction = pole * correction + kp * error[:, k] + integral
        integral = integral + ki * error[:, k]
    return error


def pairs():
    """What is timed: (name, the package's way, the other way and its name)."""
    rng = np.random.default_rng(0)
    windows = rng.normal(size=(N_WINDOWS, N_SAMPLES))
    y = np.repeat(["a", "b", "c", "d"], N_WINDOWS // 4)
    coef = rng.normal(size=(4, ORDER)) / ORDER
    network = np.array([ORDER]), np.array([POLE])
    model, diagnoser = ARXLaguerre(order=ORDER, pole=POLE), make_diagnoser().fit(windows, y)
    bank = ARXLaguerre(order=ORDER, pole=POLE).fit(windows, y)
    return [
        (
            "innovations of 4 models",
            lambda: arx_laguerre.innovations(windows[:, None], *network, coef, 0),
            "states by scipy.signal.lfilter",
            lambda: laguerre_cascade(windows) @ coef.T,
        ),
        (
            "innovations of 4 models",
            lambda: arx_laguerre.innovations(windows[:, None], *network, coef, 0),
            "triangular A in NumPy",
            lambda: triangular(windows, coef),
        ),
        (
            "fit of one window",
            lambda: model.fit(windows[:1]),
            "literal recursive least squares",
            lambda: recursive_least_squares(windows[0]),
        ),
        (
            "linear observer",
            lambda: observer.observe(windows, POLE, 0.1, 0.05, 0.0, 1.0, 1.0, 0.0),
            "loop in NumPy over samples",
            lambda: observer_loop(windows, POLE, 0.1, 0.05),
        ),
        (
            "lagged sums, order 128",
            lambda: [lagged_sums(window, 128) for window in windows],
            "product of lagged matrices",
            lambda: [
                lagged.T @ lagged
                for lagged in np.lib.stride_tricks.sliding_window_view(windows, 129, axis=1)
            ],
        ),
        (
            "verdicts of make_diagnoser",
            lambda: diagnoser.predict(windows),
            "innovations of its bank of 4 alone",
            lambda: bank.transform(windows),
        ),
    ]


def median_times(*functions, n_runs=5):
    """Median seconds of each function, called in turn after a warm-up."""
    times = np.empty((n_runs + 1, len(functions)))
    for run in range(n_runs + 1):
        for i, function in enumerate(functions):
            start = time.perf_counter()
            function()
            times[run, i] = time.perf_counter() - start
    return np.median(times[1:], axis=0)


def main():
    """Print the table."""
    rows = []
    for name, ours, other_name, other in pairs():
        seconds = median_times(ours, other)
        rows.append(
            {
                "the package": name,
                "next to": other_name,
                "ratio": round(seconds[1] / seconds[0], 1),
                "ms a window": round(
                    seconds[0] / (1 if "one window" in name else N_WINDOWS) * 1e3, 3
                ),
            }
        )
    print(pd.DataFrame(rows).to_string(index=False))


if __name__ == "__main__":
    main()
