"""Classifier of conditions that states how sure it is of another specimen, too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sklearn.base import clone
from sklearn.utils import Bunch, column_or_1d

from ..core.base import NO_RESIDUAL
from ..core.batches import batches_of, chosen_rows
from ..core.capabilities import capabilities
from ..core.fault_locations import (
    FAULT_LOCATIONS,
    HEALTHY,
    check_locations,
    warn_of_own_locations,
)
from ..core.speeds import log_speeds
from ..core.state import expect
from ..core.validation import check_rate, weighted_windows
from ..distances.stretches import StretchResidual
from ..kernels import ladder, posterior
from ..kernels.coloured_noises import coloured_noises
from ..kernels.speed_references import group_speeds
from .condition_locations import (
    locate_conditions,
    location_answers,
    location_names,
)
from .signal_classifier import SignalClassifier

#: Most groups of specimens that are left out of the limits in turn.
_MOST_GROUPS = 5
#: Log probability of an unknown condition in rows that name none.
_NEVER = -700.0


@dataclass(kw_only=True, eq=False, repr=False)
class ConditionClassifier(SignalClassifier):
    r"""Classifier of conditions by residuals, with a probability of an unknown condition.

    A diagnoser is trained on some specimens, such as bearings, and is used on others.
    This classifier asks three questions: whether a row is healthy, at which location its
    fault is, and which condition of that location it resembles. Each answer is as sure as
    it was on specimens and rigs that were left out of training. The equations are those
    of :func:`skarxlag.kernels.posterior.condition_log_probabilities`.

    - A row that resembles one answer much more than any other is probably of a specimen
      that was recorded. Its nearest answer is then right.
    - Otherwise, it may be another specimen of a known condition. Its residuals count
      with the exponent 8.
    - Or its condition is unknown.

    `fit` probes the comparison with noise, which carries no condition. A row must
    resemble one answer by more than noise does to count as a recorded specimen.

    Parameters
    ----------
    residual : estimator or None, default=None
        Transformer from rows and their speeds to one residual for each condition, such
        as `StretchResidual`, or a pipeline that ends with one. It is given `rpm` and
        `sample_weight` if `fit` is. None: ``StretchResidual()``.
    healthy : label or None, default=None
        The healthy condition. None: the conditions whose names say that they are
        healthy, of which the first counts for the alarm. Without one, there is no
        alarm.
    locations : mapping of label to str or None, default=None
        Location of each condition if its name does not say it: "healthy", "inner", "outer"
        or "ball". Any other condition is a location of its own. A warning names it if
        other conditions state the location of a fault. The location None, as
        in ``{"cage": None}``, states that a condition is a location of its own.
    recorded_prior : float, default=0.5
        Probability in (0, 1) that a row is of a specimen that was recorded for
        training. Raise it for a machine whose bearings are never exchanged. Lower it
        for a fleet.
    false_alarm_rate : float, default=0.01
        Share in (0, 1) of healthy rows that may exceed the detection threshold.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Conditions, sorted.
    residual_ : estimator
        The fitted `residual`.
    class_locations_ : ndarray of int of shape (n_classes,)
        Location of each class: 0 ball, 1 inner race, 2 outer race, 3 healthy. Conditions
        of other locations have the numbers from 4.
    healthy_index_ : int
        Index of the healthy condition in `classes_`; -1 if there is none.
    detection_threshold_ : float
        Limit of the residual of the healthy condition; 0 if there is none. It is that of
        healthy rows that were left out: of one specimen at a time if `fit` had several
        healthy ones, otherwise of half the rows of each condition and speed. So of two
        recordings of one speed, one after the other, each is left out.
    n_healthy_ : int
        Number of rows of the healthy condition; 0 if there is none.
    noise_gaps_ : ndarray of shape (2,)
        Largest gap of noise in the questions about the fault and about its location.
    n_specimens_ : ndarray of int of shape (n_classes,)
        Number of specimens of each condition.
    n_models_, n_features_in_ : int
        Number of models, or 0 and the samples of a plain row.
    window_shape_, feature_names_in_ : ndarray
        Shape of one row, and column names if fitted on a table.

    See Also
    --------
    skarxlag.make_diagnoser : This classifier behind a model of the signal.
    FaultOrderClassifier : Adds the orders of a bearing.

    Examples
    --------
    Two conditions of different colour, and noise that is like neither:

    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> noise = np.random.default_rng(0).normal(size=(41, 4800))
    >>> X = np.concatenate(
    ...     [lfilter([1], [1, -0.8], noise[:20]), lfilter([1], [1, 0.8], noise[20:40])]
    ... )
    >>> y = np.repeat(["healthy", "inner"], 20)
    >>> classifier = ConditionClassifier().fit(X, y)
    >>> classifier.predict(X[[0, 39]])
    array(['healthy', 'inner'], dtype='<U7')
    >>> found = classifier.diagnose(np.stack([X[39], noise[40]]))
    >>> np.exp(found.log_probability[:, -1]).round(2)  # of an unknown condition
    array([0.04, 0.1 ])
    """

    residual: Any = None
    healthy: Any = None
    locations: Mapping[Any, str | None] | None = None
    recorded_prior: float = 0.5
    false_alarm_rate: float = 0.01

    _learns_in_batches = True

    def _learn(self, X, y, rpm, sample_weight, specimen):
        rows, labels, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        classes, target = np.unique(labels, return_inverse=True)
        locations, healthy = locate_conditions(
            classes.tolist(), self.locations, self.healthy
        )
        # Without a located fault, the conditions need not be of bearings.
        if (locations < FAULT_LOCATIONS.index(HEALTHY)).any():
            own = classes[locations >= len(FAULT_LOCATIONS)]
            warn_of_own_locations(own.tolist(), self.locations)
        names = _specimens(specimen, rows, len(X))
        residual = clone(self._residual())
        residual.fit(X, y, **_given(rpm=rpm, sample_weight=sample_weight))
        threshold = 0.0
        is_healthy = target == healthy
        if healthy >= 0:
            groups = np.full(len(X), -1)
            groups[rows] = _left_out_groups(
                target, is_healthy, _chosen(rpm, rows), names
            )
            levels = self._left_out_levels(X, y, rpm, sample_weight, groups, residual)
            threshold = ladder.false_alarm_threshold(
                levels[rows][is_healthy, healthy],
                weights[is_healthy],
                self.false_alarm_rate,
            )
        probes, speeds = _probes(X, rpm)
        noise_gaps = posterior.noise_gaps(
            posterior.logarithms(residual.transform(probes, **_given(rpm=speeds))),
            *location_answers(locations),
        )
        self.classes_: NDArray[Any] = classes
        self.class_locations_: NDArray[Any] = locations
        self.healthy_index_: int = healthy
        of_classes = pd.Series(names).groupby(target)
        self.n_specimens_: NDArray[Any] = of_classes.nunique().to_numpy()
        self.residual_: Any = residual
        self.detection_threshold_: float = threshold
        self.n_healthy_: int = int(is_healthy.sum())
        self.noise_gaps_: NDArray[Any] = noise_gaps

    def _residual(self):
        return StretchResidual() if self.residual is None else self.residual

    def _left_out_levels(self, X, y, rpm, sample_weight, groups, residual):
        """Return the residuals of rows that were left out of the fit, one group at a time.

        Rows of the fit are nearer to the mean of their condition than new ones. Rows of
        the group -1 are never left out.
        """
        levels = _levels_in_batches(residual, X, rpm)
        for number in range(groups.max() + 1):
            is_other = groups != number
            metadata = _given(
                rpm=_chosen(rpm, is_other),
                sample_weight=_chosen(sample_weight, is_other),
            )
            others = chosen_rows(X, is_other)
            fitted = clone(residual).fit(others, y[is_other], **metadata)
            rest, speeds = chosen_rows(X, ~is_other), _chosen(rpm, ~is_other)
            levels[~is_other] = _levels_in_batches(fitted, rest, speeds)
        return levels

    def questions(self) -> tuple[NDArray[Any], int]:
        """Return the number of the location of each class, and that of the healthy one."""
        return location_answers(self.class_locations_)

    def _diagnosed(self, X, rpm):
        levels = self.residual_.transform(X, **_given(rpm=rpm))
        # Residuals mark rows without a plausible speed.
        is_plausible = (levels != NO_RESIDUAL).any(axis=1)
        evidence = posterior.logarithms(levels)
        diagnosis = self._joined(evidence, 1.0, is_plausible)
        diagnosis.update(levels=levels, row_evidence=evidence)
        if self.healthy_index_ >= 0:
            of_healthy = levels[:, self.healthy_index_]
            diagnosis.alarm = of_healthy > self.detection_threshold_
        return diagnosis

    def _joined(self, evidence, n_rows, is_plausible=True):
        """Return probabilities and verdicts; equal ones for implausible rows."""
        locations, healthy = self.questions()
        expected = f"one column for each of {len(locations)} conditions"
        fits = evidence.shape[1:] == locations.shape
        expect(fits, "evidence.shape", evidence.shape, expected)
        joined = posterior.condition_log_probabilities(
            evidence,
            locations,
            healthy,
            self.noise_gaps_,
            self.recorded_prior,
            n_rows,
        )
        logs = joined.log_probability
        if not np.all(is_plausible):
            logs[~is_plausible] = -np.log(len(self.classes_))
            logs[~is_plausible, -1] = _NEVER
        decided = posterior.decided(logs, self.classes_, locations, healthy)
        return Bunch(log_probability=logs, recorded=joined.recorded, **decided)

    def _adaptive_part(self):
        return getattr(self, "residual_", self._residual())

    def _capabilities(self):
        measured = capabilities(self.residual_)
        described = {
            "alarm": self.healthy_index_ >= 0,
            "is_stretch": measured.is_stretch,
            "compares_orders": measured.compares_orders,
            "locations": location_names(self.class_locations_),
            "n_evidence": len(self.classes_),
            "n_specimens": tuple(self.n_specimens_.tolist()),
            "sampling_rate": measured.sampling_rate,
            "speeds": measured.speeds,
            "states_unknown": True,
            "takes_rpm": len(measured.speeds) > 0,
        }
        if self.healthy_index_ >= 0:
            described["healthy"] = self.classes_.tolist()[self.healthy_index_]
            described["n_healthy"] = self.n_healthy_
            described["limits"] = (
                f"the detection threshold {self.detection_threshold_:.4g}"
            )
            described["stated_rate"] = self.false_alarm_rate
        return described

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        self._check_classes()
        self._check_part("residual_")
        n_classes = len(self.classes_)
        self._check_array("class_locations_", (n_classes,), kind=int)
        # A condition that is at none of the locations has a number of its own.
        numbers = range(len(FAULT_LOCATIONS) + n_classes)
        locations = self.class_locations_
        are_locations = np.isin(locations, numbers)
        expect(are_locations, "class_locations_", locations, "numbers of locations")
        self._check_healthy()
        # Larger gaps overflow.
        self._check_array("noise_gaps_", (2,), "at least 0 and below 1e3")
        self._check_array("n_specimens_", (n_classes,), kind=int)
        are_counts = (self.n_specimens_ >= 1) & (self.n_specimens_ < 1e6)
        expect(are_counts, "n_specimens_", self.n_specimens_, "counts of at least 1")

    def _check_healthy(self):
        """Check the index of the healthy class, -1 if there is none, and its limits."""
        self._check_number("healthy_index_", kind=int)
        index = self.healthy_index_
        is_healthy = self.class_locations_ == FAULT_LOCATIONS.index("healthy")
        if index == -1:
            is_index = not is_healthy.any()
        else:
            is_index = 0 <= index < len(is_healthy) and is_healthy[index]
        expected = "the index of a healthy class, or -1"
        expect(is_index, "healthy_index_", index, expected)
        self._check_number("detection_threshold_", "at least 0")
        self._check_number("n_healthy_", kind=int)
        n_healthy = self.n_healthy_
        is_count = 0 <= n_healthy < 1e9 and (n_healthy > 0) == (index >= 0)
        expect(is_count, "n_healthy_", n_healthy, "a count")

    def _check_parameters(self):
        check_rate(self.false_alarm_rate, "false_alarm_rate")
        check_rate(self.recorded_prior, "recorded_prior")
        check_locations(self.locations)


def _specimens(specimen, rows, n_rows):
    """Return the names of the specimens of rows, one name if they are not stated."""
    if specimen is None:
        return np.zeros(len(rows), dtype=int)
    names = column_or_1d(np.asarray(specimen, dtype=object)).astype(str)
    expected = f"{n_rows}, as X has rows"
    expect(len(names) == n_rows, "Length of specimen", len(names), expected)
    return names[rows]


def _chosen(values, is_chosen):
    """Return values of some rows; one value stands for all rows, and None for none."""
    if values is None:
        return None
    values = np.asarray(values)
    return values if values.ndim == 0 else values[is_chosen]


def _left_out_groups(target, is_healthy, rpm, specimen):
    """Return the group of each row, of which each is left out once; -1 for rows that stay.

    If the healthy rows are of several specimens, these are left out. Otherwise, the first
    and the second halves of all conditions are, in time and at each speed: smaller groups
    gave limits that were too low on most rigs.
    """
    names, number = np.unique(specimen[is_healthy], return_inverse=True)
    if len(names) > 1:
        groups = np.full(len(target), -1)
        groups[is_healthy] = number * min(len(names), _MOST_GROUPS) // len(names)
        return groups
    at = np.zeros(len(target), dtype=int)
    if rpm is not None:
        at = group_speeds(log_speeds(rpm, len(target)))[1]
    cells = pd.Series(at).groupby([target, at])
    size = cells.transform("size")
    half = np.where(size > 1, 2 * cells.cumcount() // size, at % 2)
    has_both = pd.Series(half).groupby(target).transform("nunique") > 1
    return np.where(has_both, half, -1)


def _given(**metadata):
    """Return the metadata that are known."""
    return {name: value for name, value in metadata.items() if value is not None}


def _levels_in_batches(residual, X, rpm):
    """Return the residuals of rows, computed batch by batch."""
    parts = [
        residual.transform(X[batch], **_given(rpm=_chosen(rpm, batch)))
        for batch in batches_of(X)
    ]
    return np.concatenate(parts)


def _probes(X, rpm):
    """Return rows of noise as long as those of X, and the middle training speed for each."""
    rows = coloured_noises((X.shape[1], X.shape[-1])).astype(X.dtype)
    if rpm is None:
        return rows, None
    middle = np.exp(np.median(log_speeds(rpm, len(X))))
    return rows, np.full(len(rows), middle)
