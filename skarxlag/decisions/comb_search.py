"""Search for the combs of bearing faults in rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import Bunch

from ..core.parallel import map_rows
from ..kernels.fault_orders import N_ORDERS, order_contrast
from ..measures.envelope_spectra import (
    LEAST_REVOLUTIONS,
    best_combs,
    samples_per_revolution_of_rows,
)


@dataclass(frozen=True, eq=False)
class CombSearch:
    """Search for the combs of one or several bearings on a shaft.

    Parameters
    ----------
    orders : ndarray of shape (n_bearings, 4)
        Orders of the cage (FTF), the spin of an element (BSF), the inner race (BPFI)
        and the outer race (BPFO).
    sampling_rate : float
        In Hz.
    gear_ratio, speed_tolerance, slip, speed_range
        As in `FaultOrderClassifier`.
    """

    orders: NDArray[Any]
    sampling_rate: float
    gear_ratio: float
    speed_tolerance: float
    slip: float
    speed_range: tuple[float, float] | None

    @property
    def least_revolutions(self) -> float:
        """Revolutions of the shaft whose speed is given that a row must have."""
        return LEAST_REVOLUTIONS / self.gear_ratio

    def match(
        self,
        X: NDArray[Any],
        rpm: ArrayLike | None,
        train_rpm: Sequence[float] = (),
        *,
        with_contrasts: bool,
        n_jobs: int | None,
    ) -> Bunch:
        """Compute scores, factors, bearings, contrasts and speeds of rows.

        Parameters
        ----------
        X : ndarray of shape (n_rows, 1, n_samples)
            Rows.
        rpm : array-like or None
            Nominal speeds; None searches in `speed_range`.
        train_rpm : sequence of float, default=()
            Training speeds. Rows far from all of them have no plausible speed.
        with_contrasts : bool
            Whether to return contrasts, of 4001 numbers each.
        n_jobs : int or None
            Threads that work on rows.

        Returns
        -------
        Bunch
            As `FaultOrderClassifier.match` returns it.
        """
        samples_per_revolution = samples_per_revolution_of_rows(
            X,
            self.sampling_rate,
            rpm,
            self.speed_range,
            self.least_revolutions,
            train_rpm,
        )

        def match_row(index, samples):
            period = samples_per_revolution[index] / self.gear_ratio
            n_revolutions = len(samples) / np.mean(period)
            contrast = np.zeros(N_ORDERS)
            # Revolutions of less than two samples, which a large ratio of gears gives,
            # show no order.
            if n_revolutions <= len(samples) / 2:
                contrast = order_contrast(samples, period, self.sampling_rate)
            combs = self.combs(contrast, n_revolutions)
            if with_contrasts:
                combs["contrasts"] = contrast
            return combs

        rows = map_rows(match_row, X, n_jobs)
        fields = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
        mean_period = samples_per_revolution.reshape(len(X), -1).mean(axis=1)
        return Bunch(**fields, rpm=60 * self.sampling_rate / mean_period)

    def match_gathered(
        self, contrast: NDArray[Any], n_samples: int, rpm: float
    ) -> Bunch:
        """Match the mean contrast of several rows of n_samples samples each."""
        n_revolutions = n_samples * rpm * self.gear_ratio / (60 * self.sampling_rate)
        combs = self.combs(contrast, n_revolutions)
        fields = {name: values[np.newaxis] for name, values in combs.items()}
        return Bunch(**fields, rpm=np.array([rpm]))

    def combs(
        self, contrast: NDArray[Any], n_revolutions: float
    ) -> dict[str, NDArray[Any]]:
        """Return score, factor and bearing of each fault, see `best_combs`."""
        return best_combs(
            contrast, n_revolutions, self.orders, self.speed_tolerance, self.slip
        )
