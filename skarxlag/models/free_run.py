"""Output of identified models that are fed their own predictions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels import arx_laguerre
from ..kernels.laguerre import network_matrices
from ..kernels.scaling import unit_rms_windows


def free_run_output(
    windows: NDArray[Any],
    orders: NDArray[Any],
    poles: NDArray[Any],
    coef: NDArray[Any],
    names: NDArray[Any],
    n_transient: int,
) -> NDArray[Any]:
    """Simulate the output from the inputs and from the samples of the transient.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Output and inputs.
    orders, poles : ndarray of shape (n_channels,)
        The networks.
    coef : ndarray of shape (n_models, n_states)
        Coefficients of each model.
    names : ndarray of shape (n_models,)
        What an error calls the models.
    n_transient : int
        Number of samples of the output that are used.

    Returns
    -------
    ndarray of shape (n_windows, n_models, n_samples - n_transient)
        Simulated output, with the mean of the window's output.

    Raises
    ------
    ValueError
        If a model is unstable when it is fed its own output.
    """
    A, b = network_matrices(orders, poles)
    loops = A + b[:, :1] * coef[:, np.newaxis]
    radii = np.abs(np.linalg.eigvals(loops)).max(axis=1)
    if radii.max() >= 1:
        unstable = str(names[radii.argmax()])
        raise ValueError(
            f"The model {unstable!r} is unstable in free run: its spectral radius is "
            f"{radii.max():.6g}. Use free_run=False, a lower order or a larger alpha."
        )
    scaled, rms = unit_rms_windows(windows)
    simulated = arx_laguerre.free_run(scaled, orders, poles, coef, n_transient)
    mean = np.mean(windows[:, :1], axis=-1, keepdims=True)
    return simulated[..., n_transient:] * rms[:, np.newaxis, np.newaxis] + mean
