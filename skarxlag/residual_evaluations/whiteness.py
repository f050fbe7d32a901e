"""Distance of the error's spectrum from white (Mehra and Peschon 1971)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernels.observer import observe
from ..kernels.residual_levels import cepstral_norm
from ..kernels.spectra import LOG_SPECTRUM_CELLS, autoregressive_log_spectrum, frequency_grid

TRAJECTORY = None


def levels(innovations: NDArray[Any], loop: Any, observer: Any) -> NDArray[Any]:
    """Weighted cepstral norm of each error, with the observer's own response taken out."""
    error = observe(innovations, loop)[0]
    signals = error.reshape(-1, error.shape[-1])
    spectra = autoregressive_log_spectrum(signals, observer.spectrum_order, LOG_SPECTRUM_CELLS)
    response = observer.small_signal_response(frequency_grid(LOG_SPECTRUM_CELLS))
    spectra -= 2 * np.log(np.abs(response))
    return cepstral_norm(spectra, observer.quefrency_exponent).reshape(error.shape[:2])
