"""The order spectrum of a stretch beside those of the nearest conditions, for the report."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from .._answers import answers
from ..stretches import order_comparison
from .spectrum_view import nearest_conditions

_DECIBELS = 10 / np.log(10)


class OrderView:
    """Collects the order spectra of a recording's stretches while they are diagnosed.

    Parameters
    ----------
    model : SavedModel
        The diagnoser. If none of its steps compares order spectra, there is no view.
    rpm : float or None
        Nominal speed of the recording.
    """

    def __init__(self, model: Any, rpm: float | None) -> None:
        try:
            self._before, self._residual = order_comparison(model.diagnoser)
        except ValueError:
            self._before, self._residual = None, None
        else:
            self._rpm = rpm if answers(model.diagnoser).takes_rpm else None
        self._found, self._places = [], []

    def add(self, X: NDArray[Any], places: NDArray[Any]) -> None:
        """Take some stretches that carry a signal.

        Parameters
        ----------
        X : ndarray of shape (n_stretches, ...)
            Stretches, at least one.
        places : ndarray of int of shape (n_stretches,)
            Their places in the recording.
        """
        if self._residual is not None:
            levels = X if self._before is None else self._before.transform(X)
            found = self._residual.match(levels, rpm=self._rpm)
            spectra = found.spectra.mean(axis=2)
            self._found += zip(found.residuals, found.factors, spectra, strict=True)
            self._places += places.tolist()

    def drawn(
        self, windows: pd.DataFrame, conditions: list[str], place: int | None = None
    ) -> dict[str, Any] | None:
        """What there is to draw.

        Parameters
        ----------
        windows : DataFrame
            Rows of `window_verdicts`.
        conditions : list of str
            As there.
        place : int or None, default=None
            The stretch to draw; None for the first one that carries a signal.

        Returns
        -------
        dict or None
            ``place`` of the stretch; ``orders``; ``rpm``, the nominal speed or None; and
            ``conditions``, of two conditions by name: ``spectrum`` of the stretch and
            ``reference`` in decibels, ``factor`` on the speed and ``residual``.
        """
        if not self._places:
            return None
        row = 0 if place is None else self._places.index(place)
        residuals, factors, spectra = self._found[row]
        classes = self._residual.classes_.tolist()

        def of_condition(name):
            c = classes.index(name)
            return {
                "spectrum": _curve(spectra[c]),
                "reference": _curve(self._residual.references_[c].mean(axis=0)),
                "factor": float(factors[c]),
                "residual": float(residuals[c]),
            }

        return {
            "place": self._places[row],
            "orders": self._residual.orders_.round(6).tolist(),
            "rpm": None if self._rpm is None else float(self._rpm),
            "conditions": {
                str(name): of_condition(name) for name in nearest_conditions(windows, conditions)
            },
        }


def _curve(values):
    return (_DECIBELS * values).round(2).tolist()
