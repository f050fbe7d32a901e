"""Classifier of conditions that states how sure it is of another specimen, too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, clone
from sklearn.utils import Bunch, column_or_1d
from sklearn.utils.metaestimators import available_if

from ..core.base import SignalEstimator
from ..core.capabilities import capabilities, offers, requests, training_speeds
from ..core.diagnosing_classifier import DiagnosingClassifier
from ..core.fault_locations import FAULT_LOCATIONS, location_of_label
from ..core.speeds import log_speeds, with_plausible_speeds
from ..core.state import expect, uses_fitted
from ..core.validation import (
    check_rate,
    check_real,
    validate_innovations,
    warn_of_lost_speeds,
    weighted_windows,
)
from ..distances.stretches import StretchResidual
from ..kernels import ladder, posterior
from ..kernels.coloured_noises import coloured_noises
from ..kernels.speed_references import drift_factor, speed_distance
from .left_out_specimens import location_exponent

#: Log probability of an unknown condition in rows that name none.
_NEVER = -700.0


@dataclass(kw_only=True, eq=False, repr=False)
class ConditionClassifier(SignalEstimator, DiagnosingClassifier, BaseEstimator):
    r"""Classifier of conditions by residuals, with a probability of an unknown condition.

    A diagnoser is trained on some specimens, such as bearings, and is used on others.
    This classifier asks three questions: whether a row is healthy, at which location its
    fault is, and which condition of that location it resembles. Each answer is as sure as
    it was on specimens and rigs that were left out of training. The equations are those
    of :func:`skarxlag.kernels.posterior.condition_log_probabilities`.

    - A row that resembles one answer much more than any other is probably of a specimen
      that was recorded. Its residuals then count with a large exponent.
    - Otherwise, it may be another specimen of a known condition. Its residuals count
      with small exponents: 8 for the question whether there is a fault, and 4 for its
      location.
    - Or its condition is unknown. The probability of this grows with the smallest
      residual.

    `fit` probes the comparison with noise, which carries no condition. A row must
    resemble one answer by more than noise does to count as a recorded specimen.

    With `specimen` in `fit`, each specimen of a location with several is left out in turn.
    The rows of the left-out specimens choose the exponent for the location: the more alike
    the specimens are, the larger it is.

    Parameters
    ----------
    residual : estimator or None, default=None
        Transformer from rows and their speeds to one residual for each condition, such
        as `StretchResidual`, or a pipeline that ends with one. None:
        ``StretchResidual()``.
    healthy : label or None, default=None
        The healthy condition. None: the conditions whose names say that they are
        healthy, of which the first counts for the alarm. Without one, there is no
        alarm.
    locations : mapping of label to str or None, default=None
        Location of each condition if its name does not say it: "healthy", "inner", "outer"
        or "ball". Any other condition is a location of its own.
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
        Limit of the residual of the healthy condition; 0 if there is none.
    n_healthy_ : int
        Number of rows of the healthy condition; 0 if there is none.
    noise_gaps_ : ndarray of shape (2,)
        Largest gap of noise in the questions about the fault and about its location.
    location_exponent_ : float
        Exponent of the residuals of locations for other specimens.
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
    array([0.02, 0.15])
    """

    residual: Any = None
    healthy: Any = None
    locations: Mapping[Any, str] | None = None
    recorded_prior: float = 0.5
    false_alarm_rate: float = 0.01

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {
        "rpm": True,
        "sample_weight": True,
        "specimen": True,
    }

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        specimen: ArrayLike | None = None,
    ) -> Self:
        """Learn the residuals of each condition, and how far noise and specimens are apart.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Innovations or plain rows.
        y : array-like of shape (n_rows,)
            Condition of each row.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed of each row in revolutions per minute. None: the speed is not
            known.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            How many rows each one stands for, at least 0. None: one each.
        specimen : array-like of shape (n_rows,) or None, default=None
            Identifier of the specimen, such as the bearing, of each row. None: each
            condition is one specimen.

        Returns
        -------
        ConditionClassifier
            The fitted classifier.

        Raises
        ------
        ValueError
            If a parameter is out of its range, `healthy` is not in `y`, `specimen` does
            not have an identifier for each row, or as `residual` raises it.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        rows, target, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        classes, target = np.unique(target, return_inverse=True)
        self.classes_: NDArray[Any] = classes
        self._name_locations()
        specimens = self._specimens(specimen, len(X))
        numbers = None if specimens is None else specimens[rows]
        self.n_specimens_: NDArray[Any] = self._counted(numbers, target)
        metadata = self._metadata(rpm, sample_weight)
        residual = clone(self._residual())
        self.residual_: Any = residual.fit(X, y, **metadata)
        levels = self._levels(X, rpm)[rows]
        self.detection_threshold_: float = 0.0
        self.n_healthy_: int = 0
        if self.healthy_index_ >= 0:
            own = target == self.healthy_index_
            healthy = levels[own, self.healthy_index_]
            self.n_healthy_ = len(healthy)
            rate = self.false_alarm_rate
            threshold = ladder.false_alarm_threshold(healthy, weights[own], rate)
            self.detection_threshold_ = threshold
        self.noise_gaps_: NDArray[Any] = self._probe(X, rpm)
        self.location_exponent_: float = posterior.LOCATION_EXPONENT
        if specimens is not None:
            self.location_exponent_ = location_exponent(
                self._residual(), X, y, specimens, self._location_of_rows(y), metadata
            )
        return self

    def _residual(self):
        return StretchResidual() if self.residual is None else self.residual

    def _metadata(self, rpm, sample_weight):
        """Return what `fit` of the residual is given."""
        residual = self._residual()
        given = {"rpm": rpm, "sample_weight": sample_weight}
        return {
            name: value
            for name, value in given.items()
            if value is not None and requests(residual, "fit", name)
        }

    def _name_locations(self):
        """Set the location of each class, and the healthy one."""
        names = self.classes_.tolist()
        stated = dict(self.locations or {})
        by_name = {name: location_of_label(name) for name in names}
        if self.healthy is not None:
            known = f"one of the conditions in y: {names}"
            expect(self.healthy in names, "healthy", self.healthy, known)
            stated[self.healthy] = "healthy"
            by_name = {
                name: None if p == "healthy" else p for name, p in by_name.items()
            }
        found = [stated.get(name, by_name[name]) for name in names]
        others = iter(range(len(FAULT_LOCATIONS), len(FAULT_LOCATIONS) + len(names)))
        numbers = [
            next(others) if p is None else FAULT_LOCATIONS.index(p) for p in found
        ]
        self.class_locations_: NDArray[Any] = np.array(numbers)
        healthy = [i for i, location in enumerate(found) if location == "healthy"]
        self.healthy_index_: int = -1
        if self.healthy is not None:
            self.healthy_index_ = names.index(self.healthy)
        elif healthy:
            self.healthy_index_ = healthy[0]

    def _specimens(self, specimen, n_rows):
        """Return the identifier of the specimen of each row as text, or None."""
        if specimen is None:
            return None
        names = column_or_1d(np.asarray(specimen, dtype=object))
        expect(
            len(names) == n_rows,
            "Length of specimen",
            len(names),
            f"{n_rows}, as X has rows",
        )
        return names.astype(str)

    def _counted(self, specimens, target):
        """Count the specimens of each class."""
        if specimens is None:
            return np.ones(len(self.classes_), dtype=int)
        return np.array(
            [len(set(specimens[target == c])) for c in range(len(self.classes_))]
        )

    def _levels(self, X, rpm):
        """Return the residuals of rows, in an array that may be changed."""
        takes_rpm = rpm is not None and requests(self.residual_, "transform", "rpm")
        return np.array(
            self.residual_.transform(X, **({"rpm": rpm} if takes_rpm else {}))
        )

    def _probe(self, X, rpm):
        """Return the largest gaps of noise as long as the rows, at the middle training speed."""
        rows = coloured_noises((X.shape[1], X.shape[-1])).astype(X.dtype)
        speeds = None
        if rpm is not None:
            speeds = np.full(len(rows), np.exp(np.median(log_speeds(rpm, len(X)))))
        logs = posterior.logarithms(self._levels(rows, speeds))
        return posterior.question_gaps(logs, *self.questions()).max(axis=0)

    def _location_of_rows(self, y):
        return self.class_locations_[np.searchsorted(self.classes_, y)]

    def questions(self) -> tuple[NDArray[Any], int]:
        """Return the number of the location of each class, and that of the healthy one."""
        present, locations = np.unique(self.class_locations_, return_inverse=True)
        healthy = np.flatnonzero(present == FAULT_LOCATIONS.index("healthy"))
        return locations, int(healthy[0]) if len(healthy) > 0 else -1

    @uses_fitted
    def diagnose(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute all that is known of each row from one set of residuals.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Their speeds, as in `fit`. None: not known.

        Returns
        -------
        Bunch
            ``levels``, the residuals of shape (n_rows, n_classes); ``row_evidence``, of
            which `join` takes the mean over the rows of a recording; ``log_probability``
            of shape (n_rows, n_classes + 1), that of the conditions and, in the last
            column, of an unknown one; ``recorded``, the probability of a recorded
            specimen; ``verdict``, ``probability`` and ``score``, the results of
            `predict`, `predict_proba` and `decision_function`; and, if there is a
            healthy condition, ``alarm``: whether its residual exceeds the detection
            threshold.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        speeds = training_speeds(self.residual_)
        is_plausible = np.ones(len(X), dtype=bool)
        if len(speeds) > 0:
            rpm, is_plausible = with_plausible_speeds(rpm, len(X), speeds)
            if rpm is None:
                warn_of_lost_speeds(self)
        levels = self._levels(X, rpm)
        # Equal residuals name no condition.
        levels[~is_plausible] = 1.0
        log_drift = np.log(self._drift(rpm, X))
        evidence = np.column_stack([posterior.logarithms(levels), log_drift])
        diagnosis = self._judged(evidence, is_plausible)
        diagnosis.update(levels=levels, row_evidence=evidence)
        if self.healthy_index_ >= 0:
            of_healthy = levels[:, self.healthy_index_]
            diagnosis.alarm = of_healthy > self.detection_threshold_
        return diagnosis

    @uses_fitted
    def join(self, evidence: ArrayLike, n_rows: ArrayLike = 1.0) -> Bunch:
        """Diagnose recordings by the mean evidence of their rows.

        Parameters
        ----------
        evidence : array-like of shape (n_recordings, n_classes + 1)
            Means of ``row_evidence``, which `diagnose` returns: natural logarithms of
            the residuals of each class, and of the factor on the drift.
        n_rows : float or array-like of shape (n_recordings,), default=1.0
            Number of rows, or the sum of their weights, above 0.

        Returns
        -------
        Bunch
            As `diagnose` returns it, without what only a row has.
        """
        means = np.asarray(evidence)
        return self._judged(means, np.ones(len(means), bool), np.asarray(n_rows))

    def _judged(self, evidence, is_plausible, n_rows=1.0):
        """Return probabilities and verdicts; equal ones for implausible rows."""
        locations, healthy = self.questions()
        found = posterior.condition_log_probabilities(
            evidence[:, :-1],
            locations,
            healthy,
            np.exp(evidence[:, -1]),
            noise_gaps=tuple(self.noise_gaps_.tolist()),
            prior=self.recorded_prior,
            location_exponent=self.location_exponent_,
            n_rows=n_rows,
        )
        n_classes = len(self.classes_)
        equal = np.append(np.full(n_classes, -np.log(n_classes)), _NEVER)
        found.log_probability[~is_plausible] = equal
        decided = posterior.decided(
            found.log_probability, self.classes_, locations, healthy
        )
        return Bunch(**found._asdict(), **decided)

    def _drift(self, rpm, X):
        """Return the factor on the drift at the speed of each row; 1 if the speed is not known."""
        known = np.array(training_speeds(self.residual_))
        if rpm is None or len(known) == 0:
            return np.ones(len(X))
        speeds = log_speeds(rpm, len(X), X.shape[-1])
        return drift_factor(speed_distance(speeds, np.log(known)).variance)

    @uses_fitted
    def detect(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Return whether the healthy residual of each row exceeds the detection threshold.

        The stated rate holds at the training speeds only. Use `FaultDetector` instead
        for others.

        Parameters
        ----------
        X, rpm : array-like
            As in `diagnose`.

        Returns
        -------
        ndarray of bool of shape (n_rows,)
            True for an alarm.

        Raises
        ------
        ValueError
            If there is no healthy condition.
        """
        known = "a healthy condition: name it by the parameter healthy"
        expect(self.healthy_index_ >= 0, "healthy_index_", self.healthy_index_, known)
        return self.diagnose(X, rpm).alarm

    @available_if(lambda self: offers(self._residual(), "adapt"))
    def adapt(self, X: ArrayLike, y: ArrayLike, rpm: ArrayLike | None = None) -> Self:
        """Adapt the residuals to rows of a new speed, which commonly are healthy.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Rows at the new speed.
        y : array-like of shape (n_rows,)
            Their conditions, among `classes_`.
        rpm : float, array-like of shape (n_rows,), default=None
            The new speed, as in `fit`.

        Returns
        -------
        ConditionClassifier
            This classifier, for use at the new speed.
        """
        X, y = validate_innovations(self, X, y, reset=False, any_length=True)
        self.residual_.adapt(X, y, **self._metadata(rpm, None))
        return self

    def _capabilities(self):
        inner = vars(capabilities(self.residual_))
        own = {name: inner[name] for name in ("speeds", "is_stretch", "sampling_rate")}
        own["takes_rpm"] = len(own["speeds"]) > 0
        own |= {
            "locations": self._location_names(),
            "n_specimens": tuple(self.n_specimens_.tolist()),
        }
        own |= {"states_unknown": True, "n_evidence": len(self.classes_) + 1}
        if self.healthy_index_ < 0:
            return own | {"alarm": False}
        healthy = self.classes_.tolist()[self.healthy_index_]
        own |= {"alarm": True, "n_healthy": self.n_healthy_}
        return own | {"healthy": healthy, "stated_rate": self.false_alarm_rate}

    def _location_names(self):
        """Return the location of each class; None for a condition that is a location of its own."""
        named = self.class_locations_.tolist()
        return tuple(
            FAULT_LOCATIONS[p] if p < len(FAULT_LOCATIONS) else None for p in named
        )

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
        # Larger gaps or exponents overflow.
        self._check_array("noise_gaps_", (2,), "at least 0 and below 1e3")
        self._check_number("location_exponent_", "above 0 and below 1e3")
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
        bounds = {"min_val": 0, "max_val": 1, "include_boundaries": "neither"}
        check_real(self.recorded_prior, "recorded_prior", **bounds)
        for label, location in (self.locations or {}).items():
            expect(
                location in FAULT_LOCATIONS,
                f"locations[{label!r}]",
                location,
                f"one of {FAULT_LOCATIONS}",
            )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # Made for signals of machines: on arbitrary features it need not separate
        # anything.
        tags.classifier_tags.poor_score = True
        return tags
