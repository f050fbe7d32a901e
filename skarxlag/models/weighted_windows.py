"""Sums over the windows of one model, from which it is identified."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.parallel import map_batches
from ..kernels import arx_laguerre, pole_search
from ..kernels.least_squares import distinct_windows
from ..kernels.scaling import unit_rms_windows


class WeightedWindows(NamedTuple):
    """Windows of one model with the weight of each.

    Parameters
    ----------
    windows : ndarray of shape (n_windows, n_channels, n_samples)
        Windows of all models.
    rows : ndarray of int of shape (n_rows,)
        Those of this model.
    weights : ndarray of shape (n_rows,)
        Their weights.
    """

    windows: NDArray[Any]
    rows: NDArray[Any]
    weights: NDArray[Any]

    def faded(self, factor: float) -> WeightedWindows:
        """Return the same windows, each with a weight that fades with each later window."""
        fading = factor ** np.arange(len(self.rows) - 1, -1, -1.0)
        return self._replace(weights=fading * self.weights)

    def cross_spectra(self, n_jobs: int | None) -> NDArray[Any]:
        """Return the sum of the cross-spectra of the channels, as `search_poles` takes them."""

        def of_batch(scaled, weights):
            # Cross-spectra are squares of the signal, so a weight counts by its root.
            roots = np.sqrt(weights)[:, np.newaxis, np.newaxis]
            return (pole_search.cross_spectra(scaled * roots),)

        return self._add_up(of_batch, n_jobs)[0]

    def sums_of_products(
        self,
        orders: NDArray[Any],
        poles: NDArray[Any],
        n_transient: int,
        n_jobs: int | None,
    ) -> tuple[NDArray[Any], float]:
        """Return the sums for least squares, and the number of samples in them."""

        def of_batch(scaled, weights):
            parts = arx_laguerre.accumulate_sums(
                scaled, weights, orders, poles, n_transient
            )
            return *parts, weights.sum() * (scaled.shape[-1] - n_transient)

        *parts, n_counted = self._add_up(of_batch, n_jobs)
        return arx_laguerre.sums_of_products(*parts, orders, poles), n_counted

    def _add_up(self, function: Callable[..., Any], n_jobs: int | None) -> list[Any]:
        """Add up what a function returns of scaled windows and their weights, batch by batch."""

        def of_batch(batch):
            scaled, _ = unit_rms_windows(self.windows[self.rows[batch]])
            # Windows with a constant output do not count, whatever their inputs are.
            moves = np.any(scaled[:, 0] != 0, axis=-1)
            return function(scaled, self.weights[batch] * moves)

        parts = map_batches(of_batch, len(self.rows), n_jobs)
        return [sum(part) for part in zip(*parts, strict=True)]


def windows_of_models(
    windows: NDArray[Any], labels: NDArray[Any], weights: NDArray[Any], *, merge: bool
) -> dict[Any, WeightedWindows]:
    """Return the windows of each label; if `merge` is true, equal windows become one."""
    models = {}
    for name in np.unique(labels).tolist():
        rows = np.flatnonzero(labels == name)
        of_model = (rows, weights[rows])
        if merge:
            of_model = distinct_windows(windows, *of_model)
        models[name] = WeightedWindows(windows, *of_model)
    return models
