"""Search for the combs of bearing faults in rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils import Bunch

from ..bearings import BearingLike, bearing_orders
from ..core.parallel import map_rows
from ..core.speeds import samples_per_revolution
from ..core.state import expect
from ..core.validation import ABOVE_0, check_real, check_sampling_rate
from ..kernels.fault_orders import (
    FAULTS,
    N_MULTIPLES,
    N_ORDERS,
    ORDER_STEP,
    at_true_speed,
    fault_comb,
    no_fault_lines,
    order_contrast,
    speed_error,
)
from ..measures.envelope_spectra import (
    LEAST_REVOLUTIONS,
    impact_orders,
    samples_per_revolution_of_rows,
)
from ..measures.mains_hum import MAINS

#: Why there is no verdict on a row.
_NO_COMBS = "combs need a plausible speed, and two revolutions of the shaft in a row"
#: What counts beside the scores when rows are joined.
_BESIDE_SCORES = ("other_scores", "rpm", "n_revolutions")
#: Numbers of a row that are averaged over the rows of a recording.
N_EVIDENCE = len(FAULTS) + len(_BESIDE_SCORES)
_ORDERS = itemgetter("cage", "spin", "inner", "outer")
#: First multiples of the shaft, and of half of it.
_SHAFT_LINES = np.outer([1.0, 0.5], np.arange(1, N_MULTIPLES + 1))


def _shaft_score(contrast, factor=1.0):
    """Return the mean contrast at the lines of the shaft, at a factor on their orders."""
    cells = np.rint(_SHAFT_LINES * factor / ORDER_STEP).astype(int)
    return contrast[cells].mean(axis=1).max()


def refusals(matches: Bunch) -> NDArray[np.object_]:
    """Return why rows have no verdict, empty for the others."""
    has_no_combs = np.isnan(matches.rpm)
    return np.where(has_no_combs, _NO_COMBS, "").astype(object)


def evidence_of_rows(matches: Bunch) -> NDArray[Any]:
    """Return what is averaged over the rows of a recording, of shape (n_rows, 6)."""
    beside = [matches[name] for name in _BESIDE_SCORES]
    return np.column_stack([matches.scores, *beside])


def matches_of_evidence(evidence: NDArray[Any]) -> Bunch:
    """Return the part of the matches that `evidence_of_rows` keeps."""
    scores, beside = np.split(evidence, [len(FAULTS)], axis=1)
    return Bunch(scores=scores, **dict(zip(_BESIDE_SCORES, beside.T, strict=True)))


def orders_of_bearings(bearings: Sequence[BearingLike]) -> NDArray[Any]:
    """Return the orders of bearings.

    Parameters
    ----------
    bearings : sequence of BearingLike
        The bearings.

    Returns
    -------
    ndarray of shape (n_bearings, 4)
        Orders of the cage (FTF), the spin of an element (BSF), the inner race (BPFI)
        and the outer race (BPFO).
    """
    return np.array([_ORDERS(bearing_orders(bearing)) for bearing in bearings])


@dataclass(frozen=True, eq=False)
class CombSearch:
    """Search for the combs of one or several bearings on a shaft.

    Parameters
    ----------
    bearings : sequence of BearingLike
        The bearings.
    sampling_rate, gear_ratio, speed_tolerance, slip, speed_range
        As in `FaultOrderClassifier`.
    """

    bearings: Sequence[BearingLike]
    sampling_rate: float
    gear_ratio: float
    speed_tolerance: float
    slip: float
    speed_range: tuple[float, float] | None

    def check(self) -> None:
        """Check the parameters."""
        check_sampling_rate(self.sampling_rate)
        for name in ("gear_ratio", "slip"):
            check_real(getattr(self, name), name, **ABOVE_0)
        check_real(self.speed_tolerance, "speed_tolerance", min_val=0, max_val=0.3)
        if self.speed_range is not None:
            is_pair = np.size(self.speed_range) == 2
            expect(is_pair, "speed_range", self.speed_range, "two speeds")
            low, high = self.speed_range
            check_real(high, "speed_range[1]", **ABOVE_0)
            check_real(low, "speed_range[0]", **ABOVE_0 | {"max_val": high})

    @cached_property
    def orders(self) -> NDArray[Any]:
        """Orders of the bearings, see `orders_of_bearings`."""
        return orders_of_bearings(self.bearings)

    @property
    def least_revolutions(self) -> float:
        """Revolutions of the shaft whose speed is given that a row must have."""
        return LEAST_REVOLUTIONS / self.gear_ratio

    def check_revolutions(self, rpm: NDArray[Any], n_rows: int, n_samples: int) -> None:
        """Check that rows have the least revolutions at their speeds."""
        least = self.least_revolutions
        samples_per_revolution(rpm, self.sampling_rate, n_rows, n_samples, least)

    def match(
        self,
        X: NDArray[Any],
        rpm: ArrayLike | None,
        train_rpm: Sequence[float] | None = None,
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
        train_rpm : sequence of float or None, default=None
            Training speeds. Rows far from all of them have no plausible speed. None:
            each row needs a speed.
        with_contrasts : bool
            Whether to return contrasts, of 4001 numbers each.
        n_jobs : int or None
            Threads that work on rows.

        Returns
        -------
        Bunch
            As `FaultOrderClassifier.match` returns it.
        """
        if train_rpm is None and self.speed_range is None:
            expected = "the speed of each row, or a speed_range"
            expect(rpm is not None, "rpm", rpm, expected)
        periods = samples_per_revolution_of_rows(
            X,
            self.sampling_rate,
            rpm,
            self.speed_range,
            self.least_revolutions,
            train_rpm or (),
        )

        def match_row(index, samples):
            period = periods[index] / self.gear_ratio
            mean_period = np.mean(period)
            if np.isnan(mean_period):
                contrast, fields = self._unmatched
            else:
                contrasts = np.zeros((3, N_ORDERS))
                # Revolutions of less than two samples, which a large ratio of gears gives,
                # show no order.
                if mean_period >= 2:
                    contrasts = order_contrast(samples, period)
                contrast, fields = self.match_contrasts(
                    contrasts, len(samples), mean_period
                )
            return fields | {"contrasts": contrast} if with_contrasts else fields

        rows = map_rows(match_row, X, n_jobs)
        return Bunch(
            **{name: np.stack([row[name] for row in rows]) for name in rows[0]}
        )

    @cached_property
    def _unmatched(self) -> tuple[NDArray[Any], dict[str, Any]]:
        """Contrast and match of a row without a plausible speed."""
        return self.match_contrasts(np.zeros((3, N_ORDERS)), 0, np.nan)

    def match_contrasts(
        self, contrasts: NDArray[Any], n_samples: int, mean_period: float
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Find the true speed of a row, and match the combs at that speed.

        Parameters
        ----------
        contrasts : ndarray of shape (3, 4001)
            As `order_contrast` returns them.
        n_samples : int
            Samples of the row.
        mean_period : float
            Mean number of samples in a revolution of the bearing's shaft.

        Returns
        -------
        contrast : ndarray of shape (4001,)
            Over orders of the true speed.
        fields : dict
            As `combs` returns it, and "rpm", "n_revolutions" and "speed_errors".
        """
        error = speed_error(contrasts, self.impacts.ravel(), self.speed_tolerance)
        contrast = at_true_speed(contrasts, error)
        turns = n_samples / mean_period * np.exp(error)
        rpm = 60 * self.sampling_rate / (mean_period * self.gear_ratio)
        rpm *= np.exp(error)
        fields = self.combs(contrast, turns, rpm)
        # The signal itself shows lines that are too narrow for envelopes.
        of_signal = _shaft_score(contrasts[2], np.exp(error))
        fields["shaft_scores"] = max(fields["shaft_scores"], of_signal)
        fields["rpm"] = rpm
        fields["n_revolutions"] = turns
        fields["speed_errors"] = np.exp(error)
        return contrast, fields

    @cached_property
    def impacts(self) -> NDArray[Any]:
        """Orders of impacts of ball, inner and outer race of each bearing."""
        return impact_orders(self.orders)

    def combs(
        self, contrast: NDArray[Any], n_revolutions: float, rpm: float
    ) -> dict[str, Any]:
        """Match the combs of all bearings, and keep the better one of each fault.

        Parameters
        ----------
        contrast : ndarray of shape (4001,)
            Over orders of the true speed.
        n_revolutions : float
            Revolutions of the bearing's shaft in a row; NaN if there is no contrast.
        rpm : float
            True speed of the shaft whose speed is given.

        Returns
        -------
        dict
            "scores", "factors" and "bearings" of each fault; "other_orders" and
            "other_scores" of the strongest other comb; "shaft_scores", the mean
            contrast at the first multiples of the shaft, or of half of it.
        """
        # Rectifiers and magnetic forces have twice the frequency of the mains.
        mains = [120 * mains / (rpm * self.gear_ratio) for mains in MAINS]
        masked = no_fault_lines(mains)
        found = [
            fault_comb(contrast, impacts, self.slip, n_revolutions, masked)
            for impacts in self.impacts
        ]
        scores = np.array([comb.scores for comb in found])
        factors = np.array([comb.factors for comb in found])
        best = scores.argmax(axis=0)
        fault = range(len(FAULTS))
        # A comb that belongs to one of the bearings is no other comb.
        other = min(found, key=lambda comb: comb.other_score)
        return {
            "shaft_scores": _shaft_score(contrast),
            "scores": scores[best, fault],
            "factors": factors[best, fault],
            "bearings": best,
            "other_orders": other.other_order,
            "other_scores": other.other_score,
        }
