"""The spectrum of a typical window beside those of the nearest conditions, for the report."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ..cepstral import CepstralResidual
from ..kernels.spectra import (
    LOG_SPECTRUM_CELLS,
    autoregressive_log_spectrum,
    cepstrum,
    frequency_grid,
)

#: Frequencies that are drawn, and windows of a recording that the typical one is chosen among.
_N_FREQUENCIES, _N_WINDOWS = 128, 256
_DECIBELS = 10 / np.log(10)


class SpectrumView:
    """Collects the spectra of a recording's windows while they are diagnosed.

    The spectra are those of the innovations, what the model cannot predict, smoothed to the cosine
    coefficients that the diagnoser compares, and without the gain.

    Parameters
    ----------
    model : SavedModel
        The diagnoser. If none of its steps compares log spectra, there is no view.
    """

    def __init__(self, model: Any) -> None:
        self._model, self._compare = model, _comparison(model.diagnoser)
        self._cepstra, self._places, self._n_seen = [], [], 0

    def add(self, X: NDArray[Any], quality: NDArray[Any]) -> None:
        """Take some of the next windows.

        Parameters
        ----------
        X : ndarray of shape (n_windows, ...)
            Windows.
        quality : ndarray of str of shape (n_windows,)
            As `signal_quality` gives it.
        """
        wanted = _N_WINDOWS - len(self._places)
        good = np.flatnonzero(quality == "good")[:wanted]
        if self._compare is not None and len(good) > 0:
            innovations = self._model.diagnoser[0].transform(X[good])[:, 0]
            self._cepstra.append(self._coefficients(innovations))
            self._places += (self._n_seen + good).tolist()
        self._n_seen += len(X)

    def drawn(self, windows: pd.DataFrame, conditions: list[str]) -> dict[str, Any] | None:
        """What there is to draw.

        Parameters
        ----------
        windows : DataFrame
            Rows of `window_verdicts`.
        conditions : list of str
            As there.

        Returns
        -------
        dict or None
            ``place`` of the window that is nearest to the mean of all, ``frequency`` in cycles a
            sample, ``window``, and ``references``, of two conditions by name, in decibels.
        """
        if not self._places:
            return None
        cepstra = np.concatenate(self._cepstra)
        typical = np.sum((cepstra - cepstra.mean(axis=0)) ** 2, axis=1).argmin()
        means = windows[[f"probability of {name}" for name in conditions]].mean().to_numpy()
        classes = self._compare.classes_.tolist()
        whitener = self._compare.whitener_
        references = solve_triangular(whitener, self._compare.references_.T, trans="T", lower=True)
        nearest = [conditions[place] for place in means.argsort()[::-1][:2]]
        return {
            "place": self._places[typical],
            "frequency": (frequency_grid(_N_FREQUENCIES) / (2 * np.pi)).tolist(),
            "window": _curve(cepstra[typical]),
            "references": {
                str(name): _curve(references[: cepstra.shape[1], classes.index(name)])
                for name in nearest
            },
        }

    def _coefficients(self, innovations):
        compare = self._compare
        spectra = autoregressive_log_spectrum(
            innovations, compare.spectrum_order, LOG_SPECTRUM_CELLS
        )
        return cepstrum(spectra)[:, : compare.n_coefficients]


def _comparison(diagnoser):
    """The step that compares log spectra of one model's innovations with each condition."""
    for _, step in diagnoser.steps:
        compare = getattr(step, "window_residual_", step)
        if isinstance(compare, CepstralResidual) and compare.n_models_ == 1:
            return compare
    return None


def _curve(coefficients):
    orders = np.arange(1, len(coefficients) + 1)[:, np.newaxis]
    curve = coefficients @ np.cos(orders * frequency_grid(_N_FREQUENCIES))
    return (_DECIBELS * curve).round(2).tolist()
