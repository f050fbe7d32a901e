"""Peers of the speed benchmark: plain loops, and other libraries.

A library that is not installed is left out.
"""

import importlib.util

import numba
import numpy as np

from skarxlag.kernels.laguerre import laguerre_matrices


@numba.njit(fastmath={"contract"})
def window_at_a_time(windows, pole, coef):
    """Return the root-mean-square innovation of one Laguerre model, one window after another."""
    n_windows, n_samples = windows.shape
    levels, states = np.empty(n_windows), np.empty(len(coef))
    entering = np.sqrt(1.0 - pole * pole)
    for w in range(n_windows):
        states[:] = 0.0
        power = 0.0
        for k in range(n_samples):
            error = windows[w, k]
            for n in range(len(coef)):
                error -= coef[n] * states[n]
            power += error * error
            before = states[0]
            states[0] = pole * before + entering * windows[w, k]
            for n in range(1, len(coef)):
                held = states[n]
                states[n] = before + pole * (held - states[n - 1])
                before = held
        levels[w] = np.sqrt(power / n_samples)
    return levels


def over_windows(windows, pole, coef):
    """The same, all windows at once in NumPy, with the triangular state matrix."""
    A, b = laguerre_matrices(len(coef), pole)
    states, power = np.zeros((len(coef), len(windows))), np.zeros(len(windows))
    for samples in np.ascontiguousarray(windows.T):
        power += (samples - coef @ states) ** 2
        states = A @ states + np.multiply.outer(b, samples)
    return np.sqrt(power / windows.shape[1])


def filterpy_loop(windows, pole, coef):
    """The same, as filterpy's steady-state Kalman filter: predictor A + b coef', gain b."""
    from filterpy.kalman import KalmanFilter

    A, b = laguerre_matrices(len(coef), pole)
    kalman = KalmanFilter(dim_x=len(coef), dim_z=1)
    kalman.F, kalman.H = A + np.outer(b, coef), coef[np.newaxis]
    kalman.K = np.linalg.solve(kalman.F, b)[:, np.newaxis]
    levels = np.zeros(len(windows))
    for w, window in enumerate(windows):
        kalman.x = np.zeros((len(coef), 1))
        for sample in window:
            kalman.predict_steadystate()
            kalman.update_steadystate(sample)
            levels[w] += kalman.y[0, 0] ** 2
    return np.sqrt(levels / windows.shape[1])


def minirocket():
    """MiniRocket of aeon with its defaults, on one thread."""
    from aeon.classification.convolution_based import MiniRocketClassifier

    numba.set_num_threads(1)
    return MiniRocketClassifier(random_state=0, n_jobs=1)


def lagged(y, u, n_lags):
    """Return the matrix of the samples before each one: y(k-1) .. y(k-n), u(k-1) .. u(k-n)."""
    n_samples = len(y) - n_lags
    matrix = np.empty((n_samples, 2 * n_lags))
    for lag in range(1, n_lags + 1):
        matrix[:, lag - 1] = y[n_lags - lag : n_lags - lag + n_samples]
        matrix[:, n_lags + lag - 1] = u[n_lags - lag : n_lags - lag + n_samples]
    return matrix


def normal_equations(y, u, n_lags):
    """Return the coefficients of lagged samples by the normal equations in NumPy."""
    matrix = lagged(y, u, n_lags)
    return np.linalg.solve(matrix.T @ matrix, matrix.T @ y[n_lags:])


def statsmodels_autoreg(y, u, n_lags):
    """Fit the same model by statsmodels, which takes inputs as columns next to the lags."""
    from statsmodels.tsa.ar_model import AutoReg

    before = np.zeros((len(y), n_lags))
    for lag in range(1, n_lags + 1):
        before[lag:, lag - 1] = u[:-lag]
    return AutoReg(y, n_lags, trend="n", exog=before).fit().params


def sysidentpy_least_squares(y, u, n_lags):
    """The same model by SysIdentPy, every linear term taken."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    model = FROLS(
        order_selection=False,
        n_terms=2 * n_lags,
        ylag=n_lags,
        xlag=n_lags,
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=1),
    )
    return model.fit(X=u[:, np.newaxis], y=y[:, np.newaxis]).theta


def sippy_arx(y, u, n_lags):
    """The same model by SIPPY."""
    import sippy_unipi

    return sippy_unipi.system_identification(
        y, u, "ARX", ARX_orders=[n_lags, n_lags, 0]
    )


def llsi_arx(y, u, n_lags):
    """The same model by llsi."""
    import llsi

    data = llsi.SysIdData(y=y, u=u, Ts=1.0)
    return llsi.sysid(data, "y", "u", (n_lags, n_lags, 1), method="arx")


_IDENTIFICATION = {
    "statsmodels": ("statsmodels AutoReg", statsmodels_autoreg),
    "sysidentpy": ("sysidentpy", sysidentpy_least_squares),
    "sippy_unipi": ("sippy-unipi", sippy_arx),
    "llsi": ("llsi", llsi_arx),
}


def is_installed(module):
    """Return whether a library can be imported."""
    return importlib.util.find_spec(module) is not None


def identification_peers():
    """Functions of (y, u, n_lags) of the identification libraries that are installed, by name."""
    return {
        name: f for module, (name, f) in _IDENTIFICATION.items() if is_installed(module)
    }


def missing_libraries():
    """Return the libraries of the benchmark that are not installed."""
    return [
        name
        for name in ("aeon", "filterpy", "river", *_IDENTIFICATION)
        if not is_installed(name)
    ]
