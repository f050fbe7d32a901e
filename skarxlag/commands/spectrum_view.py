"""The spectrum of a typical window beside those of the nearest conditions, for the report."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ..comparison import SpectralDistance
from ..kernels.spectra import cepstrum, frequency_grid
from ..stretches import StretchResidual

#: Frequencies that are drawn.
_N_FREQUENCIES = 128
_DECIBELS = 10 / np.log(10)


class SpectrumView:
    """Collects the spectra of a recording's windows while they are diagnosed.

    The spectra are those of the innovations, what the model cannot predict: the first group of log
    spectra that the diagnoser compares, smoothed to its cosine coefficients and without the gain.

    Parameters
    ----------
    model : SavedModel
        The diagnoser. If none of its steps compares log spectra, there is no view.
    """

    def __init__(self, model: Any) -> None:
        self._groups, self._compare = _comparison(model.diagnoser)
        self._cepstra, self._places = [], []

    def add(self, X: NDArray[Any], places: NDArray[Any]) -> None:
        """Take some windows that carry a signal.

        Parameters
        ----------
        X : ndarray of shape (n_windows, ...)
            Windows, at least one.
        places : ndarray of int of shape (n_windows,)
            Their places in the recording.
        """
        if self._compare is not None:
            self._cepstra.append(cepstrum(self._groups(X)[:, 0]))
            self._places += places.tolist()

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
        classes = self._compare.classes_.tolist()
        whitener, references = self._compare.whiteners_[0], self._compare.references_[:, 0]
        references = solve_triangular(whitener, references.T, trans="T", lower=True)
        return {
            "place": self._places[typical],
            "frequency": (frequency_grid(_N_FREQUENCIES) / (2 * np.pi)).tolist(),
            "window": _curve(cepstra[typical]),
            "references": {
                str(name): _curve(references[:, classes.index(name)])
                for name in nearest_conditions(windows, conditions)
            },
        }


def nearest_conditions(windows: pd.DataFrame, conditions: list[str]) -> list[str]:
    """Return the two conditions of largest mean probability, the larger one first.

    Parameters
    ----------
    windows : DataFrame
        Rows of `window_verdicts`.
    conditions : list of str
        As there.

    Returns
    -------
    list of str
        The conditions.
    """
    means = windows[[f"probability of {name}" for name in conditions]].mean().to_numpy()
    return [conditions[place] for place in means.argsort()[::-1][:2]]


def _comparison(diagnoser):
    """Function from windows to groups of log spectra, and the step that compares them, or None."""
    place = next(
        (n for n, (_, step) in enumerate(diagnoser.steps) if isinstance(step, StretchResidual)),
        None,
    )
    if place is None:
        steps, before, windows_of = [s for _, s in diagnoser.steps], diagnoser[:1], None
    else:
        stretches = diagnoser[place]
        steps = [s for _, s in getattr(stretches.window_residual_, "steps", [])]
        before, windows_of = diagnoser[:place], stretches._windows
    compare = next((n for n, step in enumerate(steps) if isinstance(step, SpectralDistance)), 0)
    if compare == 0:
        return None, None
    measure = steps[compare - 1]

    def groups(X):
        innovations = before.transform(X)
        if windows_of is None:
            return measure.transform(innovations)
        found = measure.transform(windows_of(innovations))
        return found.reshape(len(X), -1, *found.shape[1:]).mean(axis=1)

    return groups, steps[compare]


def _curve(coefficients):
    orders = np.arange(1, len(coefficients) + 1)[:, np.newaxis]
    curve = coefficients @ np.cos(orders * frequency_grid(_N_FREQUENCIES))
    return (_DECIBELS * curve).round(2).tolist()
