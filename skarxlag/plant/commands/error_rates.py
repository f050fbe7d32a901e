"""False alarms and missed faults of healthy limits, measured and stated."""

import warnings
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd
from scipy.stats import chi2
from sklearn.base import clone

from .training_rows import TrainingRows

#: Blocks of time, of which each is left out once.
_N_BLOCKS = 5
#: Probability with which the true rate is below the stated bound.
_CONFIDENCE = 0.95


class ErrorRates(NamedTuple):
    """Counts of rows that healthy limits judge wrongly.

    Attributes
    ----------
    n_false_alarms : int
        False alarms on healthy rows that the fit left out. Rows that exceed the limits
        one after another are one.
    n_healthy : int
        Healthy rows.
    n_missed : int
        Rows of faults within the limits.
    n_faulty : int
        Rows of faults.
    """

    n_false_alarms: int
    n_healthy: int
    n_missed: int
    n_faulty: int

    @classmethod
    def measured(cls, detector: Any, rows: TrainingRows, healthy: Any) -> Self | None:
        """Fit a detector without each of five blocks of time, and test it on them.

        Recorded faults are tested by a fit to all healthy rows.

        Parameters
        ----------
        detector : estimator
            Not fitted.
        rows : TrainingRows
            The rows, in the order of time.
        healthy : label
            The healthy condition.

        Returns
        -------
        ErrorRates or None
            None if the rows are too few.
        """
        of_healthy = rows.where(rows.y == healthy)
        faulty = rows.where(rows.y != healthy)
        recording = of_healthy.facts["recording"]
        order = recording.groupby(recording).cumcount()
        block = order * _N_BLOCKS // recording.groupby(recording).transform("size")
        exceeds = np.zeros(len(recording), dtype=bool)
        n_missed = 0
        try:
            for left_out in block.unique():
                test = (block == left_out).to_numpy()
                train = of_healthy.where(~test)
                exceeds[test] = _exceeds(detector, train, of_healthy.where(test))
            if len(faulty.X):
                n_missed = int((~_exceeds(detector, of_healthy, faulty)).sum())
        except ValueError:
            return None
        before = pd.Series(exceeds).groupby(recording).shift(fill_value=False)
        n_events = int((exceeds & ~before).sum())
        return cls(n_events, len(exceeds), n_missed, len(faulty.X))

    def sentences(self, rate: float, row_seconds: float, word: str) -> list[str]:
        """Describe the false alarms in an hour of operation, and the missed faults.

        Parameters
        ----------
        rate : float
            Stated false-alarm rate of a row.
        row_seconds : float
            Length of a row.
        word : str
            Word for the rows.

        Examples
        --------
        >>> for sentence in ErrorRates(0, 1800, 3, 60).sentences(0.01, 1.0, "stretches"):
        ...     print(sentence)
        False alarms of single stretches: 0 in 0.5 h of healthy signal that was left out, so at most
        6 an hour (95 % confidence); 36 an hour are expected.
        Missed faults: 3 of 60 stretches of recorded faults are within the healthy limits.
        """
        hours = self.n_healthy * row_seconds / 3600
        highest = chi2.ppf(_CONFIDENCE, 2 * (self.n_false_alarms + 1)) / 2 / hours
        return [
            f"False alarms of single {word}: {self.n_false_alarms} in {hours:.2g} h of "
            f"healthy signal that was left out, so at most {highest:.2g} an hour "
            f"({100 * _CONFIDENCE:.0f} % confidence); {3600 * rate / row_seconds:.2g} an "
            "hour are expected.",
            self.missed(word),
        ]

    def missed(self, word: str) -> str:
        """Describe the missed faults."""
        if not self.n_faulty:
            return "Missed faults: not measured, because no fault was recorded."
        return (
            f"Missed faults: {self.n_missed} of {self.n_faulty} {word} of recorded faults "
            "are within the healthy limits."
        )


def _exceeds(detector, train, test):
    """Return which rows exceed the limits that a detector learns from others."""
    speeds = [
        {} if each.speeds is None else {"rpm": each.speeds} for each in (train, test)
    ]
    with warnings.catch_warnings(action="ignore"):
        fitted = clone(detector).fit(train.X, **speeds[0])
        return fitted.predict(test.X, **speeds[1]) == -1
