"""Residual evaluations: from the output error of an observer to one number."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels import observer, residual_levels, spectra

#: Exponent of the cepstral norm, half-way between the plain norm (0) and Martin's
#: metric (1).
_QUEFRENCY_EXPONENT = 0.5


class ResidualEvaluation(NamedTuple):
    """Way to turn an observer's output error of one window and one model into a number.

    Parameters
    ----------
    levels : callable
        Function of innovations of shape (n_windows, n_models, n_samples) and of the
        fitted observer. It returns levels of shape (n_windows, n_models).
    trajectory : str or None
        Trajectory of `Observer.observe` whose size the level measures, in its unit.
        None if the level does not depend on the scale of the innovations.
    """

    levels: Callable[[NDArray[Any], Any], NDArray[Any]]
    trajectory: str | None


def _power(innovations, fitted):
    return residual_levels.power_levels(innovations, fitted._loop())


def _switching_gain(innovations, fitted):
    error = observer.observe(innovations, fitted._loop())[0]
    surface = residual_levels.sliding_surface(error, fitted.sliding_slope)
    surface = surface.reshape(-1, surface.shape[-1])
    gain = residual_levels.switching_gain(surface, fitted.adaptation_step)
    return residual_levels.settled_level(gain).reshape(error.shape[:2])


def _whiteness(innovations, fitted):
    error = observer.observe(innovations, fitted._loop())[0]
    signals = spectra.unit_peak(error.reshape(-1, error.shape[-1]))
    n_cells = spectra.LOG_SPECTRUM_CELLS
    log_spectrum = spectra.autoregressive_log_spectrum(
        signals, fitted.spectrum_order, n_cells
    )
    response = _small_signal_response(fitted, spectra.frequency_grid(n_cells))
    log_spectrum -= 2 * np.log(np.abs(response))
    levels = residual_levels.cepstral_norm(log_spectrum, _QUEFRENCY_EXPONENT)
    return levels.reshape(error.shape[:2])


def _small_signal_response(fitted, frequency):
    """Compute the response of the error to the innovations for small faults."""
    pole, kp, ki, _ = fitted._loop()
    z = np.exp(1j * frequency)
    return (z - pole) * (z - 1) / ((z - pole + kp) * (z - 1) + ki)


#: Residual evaluations of an observer, by the value of its parameter `evaluation`.
RESIDUAL_EVALUATIONS = {
    "power": ResidualEvaluation(_power, "error"),
    "switching_gain": ResidualEvaluation(_switching_gain, "residual"),
    "whiteness": ResidualEvaluation(_whiteness, None),
}
