"""Search for the combs of bearing faults in rows, and sentences on the result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import Bunch

from ..bearings import BearingLike
from ..core.parallel import map_rows
from ..kernels.fault_orders import N_ORDERS, NEPER_IN_DB, order_contrast
from ..measures.envelope_spectra import (
    LEAST_REVOLUTIONS,
    best_combs,
    impact_orders,
    samples_per_revolution_of_rows,
)

#: Faults in words, and orders of their impacts, in the order of `FAULTS`.
_WORDS = "a rolling element", "the inner race", "the outer race"
_ORDERS = "2 BSF", "BPFI", "BPFO"


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

    def describe(
        self,
        matches: Bunch,
        row: int,
        ranking: Sequence[int],
        bearings: Sequence[BearingLike],
        limit: float | None,
        *,
        is_close: bool,
    ) -> str:
        """Describe the combs of a row in a sentence.

        Parameters
        ----------
        matches : Bunch
            As `match` returns it.
        row : int
            Index of the row.
        ranking : sequence of two int
            Faults of the largest and of the second largest score.
        bearings : sequence of BearingLike
            The bearings as the user gave them.
        limit : float or None
            Limit of the largest score in nepers if the score is below it, else None.
        is_close : bool
            Whether the second largest score is too close to name the largest.

        Returns
        -------
        str
            The sentence, without a period.
        """
        best, second = ranking
        bearing = matches.bearings[row, best]
        location = _WORDS[best]
        if isinstance(bearings[bearing], str):
            location += f" of {bearings[bearing]}"
        elif len(bearings) > 1:
            location += f" of bearing {bearing + 1}"
        size = f"{NEPER_IN_DB * matches.scores[row, best]:.0f} dB"
        if limit is not None:
            return (
                "no comb exceeds its limit; the strongest is that of "
                f"{location} with {size}, limit {NEPER_IN_DB * limit:.0f} dB"
            )
        if is_close:
            return (
                f"impacts of {size} fit {location} and {_WORDS[second]} nearly as well"
            )
        factor = matches.factors[row, best]
        order = impact_orders(self.orders)[bearing, best] * factor
        sentence = (
            f"impacts at {order:.2f} orders ({_ORDERS[best]}), {location}, {size}, "
            f"{100 * (factor - 1):+.1f} % from the nominal order"
        )
        if abs(np.log(factor)) > self.slip:
            sentence += (
                ", which is more than slip explains: check the speed and the bearing"
            )
        return sentence
