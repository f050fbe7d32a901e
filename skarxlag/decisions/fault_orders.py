"""Classifier that names faults without recordings of them, by the orders of the bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import clone
from sklearn.utils import Bunch

from ..bearings import BearingLike, bearing_list
from ..core.capabilities import capabilities
from ..core.fault_locations import (
    FAULT_LOCATIONS,
    FAULTS,
    HEALTHY,
    OWN_LOCATION,
    check_locations,
)
from ..core.speeds import speeds_of_rows
from ..core.state import expect, uses_fitted
from ..core.validation import (
    ABOVE_0,
    check_real,
    of_one_model,
    validate_innovations,
    weighted_windows,
)
from ..kernels.evidence import SMALLEST_PROBABILITY, effective_number
from ..kernels.posterior import decided
from .comb_limits import (
    HealthyCombs,
    compare_combs,
    healthy_combs,
    length_allowance,
    without_healthy,
)
from .comb_probabilities import evidence_beside_spectra, verdicts_by_combs
from .comb_search import (
    N_EVIDENCE,
    CombSearch,
    evidence_of_rows,
    matches_of_evidence,
    refusals,
)
from .comb_sentences import comb_sentences
from .condition_locations import location_numbers, locations_by_combs
from .signal_classifier import SignalClassifier

_ROW_METADATA = {"rpm": True, "bearing": True}


@dataclass(kw_only=True, eq=False, repr=False)
class FaultOrderClassifier(SignalClassifier):
    r"""Classifier that names the location of a bearing fault without recordings of faults.

    A fault of a race or a rolling element causes impacts at orders of the shaft that
    follow from the bearing's geometry [1]_: BPFO and BPFI for the outer and the inner
    race, and twice BSF for a rolling element. The score of a fault location is the mean
    contrast of the envelope spectra at the first four multiples of its order, see
    :func:`skarxlag.kernels.fault_orders.order_contrast` and
    :func:`skarxlag.kernels.fault_orders.fault_comb`. The location with the largest score
    is named if the score exceeds a limit; otherwise the row is healthy. Lines of the
    shaft, of the mains and of other impacts do not count. Those of the shaft show its
    true speed, :func:`skarxlag.kernels.fault_orders.speed_error`.

    - Without `y`, the classes are "ball", "healthy", "inner" and "outer". The limit is
      that of healthy recordings of other machines: a quantile of a Gumbel distribution
      (location 1.65, scale .28 nepers), and more for rows of more than 100 revolutions,
      :func:`skarxlag.decisions.comb_limits.length_allowance`.
    - With `y`, each label stands for a fault location. The mean scores of healthy rows
      are subtracted, and the limit is the conformal quantile of the largest rest; at
      other speeds, at least a quantile of a Gumbel distribution (location .06, scale
      .28). If all rows are healthy and their label is a text, the faults are classes,
      too.

    The probabilities follow from the scores above the limit,
    :func:`skarxlag.decisions.comb_probabilities.comb_evidence`. A fault shows its comb
    with the probability .6, so that of healthy is at most .45 if all locations are
    classes. If impacts at no order of the bearing are stronger by more than .5 nepers,
    no location gets more than .73.

    With `conditions`, a classifier that learned the spectra of several conditions, the
    probability of a condition is proportional to its probability by spectra times that
    of its location by combs. An unknown condition has that of a healthy one. Spectra
    decide alone in rows without `rpm` or of less than two revolutions.

    Rows are raw signals, or the innovations of one model (``ARXLaguerre(bank=False)``),
    with at least two revolutions of the shaft, and better ten and a second. Rows of
    shape (n_rows, 1, n_samples) have any length.

    Parameters
    ----------
    bearing : BearingLike or sequence of BearingLike, default=None
        The bearing, or several on one shaft: names such as "6205", dimensions, or
        orders, see :func:`skarxlag.bearings.bearing_orders`. It is required.
    sampling_rate : float, default=None
        In Hz, above 0; required.
    locations : mapping of label to str or None, default=None
        Fault location of each label in `y`: "healthy", "inner", "outer" or "ball".
        Other labels get the location that their name states, such as "IR7", or else
        that of the largest mean score of their rows. If it is below the limit, the
        label has a location of its own. A warning names it unless it is mapped to None.
    conditions : ConditionClassifier or None, default=None
        Learns the spectra of conditions if `y` has several. None: combs decide alone.
    gear_ratio : float, default=1.0
        Revolutions of the bearing's shaft for each revolution of the shaft whose speed
        is given, above 0.
    false_alarm_rate : float, default=0.02
        Share in (0, 1) of healthy rows that may be named faulty.
    speed_tolerance : float, default=0.12
        Largest logarithm of the true speed over the nominal speed, in [0, 0.3].
    slip : float, default=0.02
        Largest logarithm of the factor by which slip moves a comb, above 0.
    speed_range : tuple of two floats or None, default=None
        Lowest and highest speed in revolutions per minute, between which the speed of
        rows without `rpm` is searched. None: `rpm` is required.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Labels, sorted.
    class_locations_ : ndarray of int of shape (n_classes,)
        Their fault locations: 0 ball, 1 inner, 2 outer race, 3 healthy, 4 of its own.
    orders_ : ndarray of shape (n_bearings, 4)
        FTF, BSF, BPFI and BPFO in orders of the bearing's shaft.
    reference_ : ndarray of shape (3,)
        Mean scores of healthy rows at ball, inner and outer race; 0 without such rows.
    limit_ : float
        Limit above the reference in nepers, at the speeds of the healthy rows.
    healthy_scores_, healthy_speeds_ : ndarray of shape (n_healthy,)
        Largest scores above the reference, and speeds of healthy rows, ascending.
    conditions_ : ConditionClassifier or None
        The fitted `conditions`; None without several conditions in `y`.

    See Also
    --------
    skarxlag.make_diagnoser : The classifier with `conditions`, behind a model.
    skarxlag.make_fault_order_classifier : The same without `conditions`.

    References
    ----------
    .. [1] R. B. Randall and J. Antoni (2011), "Rolling element bearing diagnostics - a
           tutorial", Mechanical Systems and Signal Processing 25, 485-520.

    Examples
    --------
    A bearing 6205 at 900 rpm, and a fault of its inner race (BPFI 5.415):

    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(2, 20_000))
    >>> intervals = 20_000 / (15 * 5.415) * rng.normal(1, 0.01, size=80)
    >>> X[1, np.cumsum(intervals).astype(int)] += 10
    >>> classifier = FaultOrderClassifier(bearing="6205", sampling_rate=20_000).fit(X)
    >>> classifier.predict(X, rpm=[900, 900])
    array(['healthy', 'inner'], dtype='<U7')
    """

    #: Passed without `set_predict_request` and its siblings.
    __metadata_request__predict: ClassVar = _ROW_METADATA
    __metadata_request__predict_proba: ClassVar = _ROW_METADATA
    __metadata_request__predict_log_proba: ClassVar = _ROW_METADATA
    __metadata_request__decision_function: ClassVar = _ROW_METADATA
    __metadata_request__score: ClassVar = _ROW_METADATA

    bearing: BearingLike | Sequence[BearingLike] | None = None
    sampling_rate: float | None = None
    locations: Mapping[Any, str | None] | None = None
    conditions: Any = None
    gear_ratio: float = 1.0
    false_alarm_rate: float = 0.02
    speed_tolerance: float = 0.12
    slip: float = 0.02
    speed_range: tuple[float, float] | None = None
    n_jobs: int | None = None

    def _learn(self, X, y, rpm, sample_weight, specimen):
        of_one_model(X[:1])
        self.orders_: NDArray[Any] = self._search_of(bearing_list(self.bearing)).orders
        self.conditions_: Any = None
        if y is None:
            healthy = without_healthy(self.false_alarm_rate)
            classes, locations = np.unique(FAULT_LOCATIONS, return_index=True)
        else:
            located, healthy = self._locate(X, y, rpm, sample_weight)
            classes = np.array([*located], dtype=y.dtype)
            numbers = location_numbers(list(located.values()))
            locations = np.minimum(numbers, OWN_LOCATION)
            if len(located) > 1 and self.conditions is not None:
                learner = clone(self.conditions).set_params(locations=located)
                self.conditions_ = learner.fit(X, y, rpm, sample_weight, specimen)
            elif [*located.values()] == [HEALTHY] and classes.dtype.kind in "UO":
                names = [*FAULTS, *classes]
                classes, locations = np.unique(names, return_index=True)
        self.classes_: NDArray[Any] = classes
        self.class_locations_: NDArray[Any] = locations
        self.reference_: NDArray[Any] = healthy.reference
        self.healthy_scores_: NDArray[Any] = healthy.best
        self.healthy_speeds_: NDArray[Any] = healthy.speeds
        self.limit_: float = healthy.limit

    def _locate(self, X, y, rpm, sample_weight):
        """Locate the labels of rows by their combs, and learn from the healthy ones."""
        rows, labels, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        if rpm is not None:
            rpm = speeds_of_rows(rpm, len(X))[rows]
            self._search().check_revolutions(rpm, *X[rows].shape[::2])
        matches = self._match(X[rows], rpm, with_contrasts=False)
        counted = np.repeat(np.arange(len(rows)), np.ceil(weights).astype(int))
        scores = matches.scores[counted]
        located = locations_by_combs(
            labels[counted],
            scores - length_allowance(matches.n_revolutions[counted])[:, np.newaxis],
            self.locations,
            without_healthy(self.false_alarm_rate).limit,
        )
        names = [label for label, place in located.items() if place == HEALTHY]
        healthy = np.isin(labels[counted], names)
        speeds = matches.rpm[counted][healthy]
        return located, healthy_combs(scores[healthy], speeds, self.false_alarm_rate)

    def _search(self, bearing=None):
        if bearing is not None:
            return self._search_of([bearing])
        search = self._search_of(bearing_list(self.bearing))
        if not np.array_equal(search.orders, self.orders_):
            raise ValueError(
                f"orders_ are not of bearing {self.bearing!r}: parameters changed since fit: "
                "call fit, or pass bearing= to predict."
            )
        return search

    def _search_of(self, bearings):
        return CombSearch(
            bearings=bearings,
            sampling_rate=self.sampling_rate,
            gear_ratio=self.gear_ratio,
            speed_tolerance=self.speed_tolerance,
            slip=self.slip,
            speed_range=self.speed_range,
        )

    @uses_fitted
    def match(
        self,
        X: ArrayLike,
        rpm: ArrayLike | None = None,
        bearing: BearingLike | None = None,
    ) -> Bunch:
        """Compute the scores of all faults, and the factors on the speed that fit best.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed; None only with `speed_range`. Rows without a plausible speed,
            or of less than two revolutions, get the score 0 and the speed NaN.
        bearing : BearingLike or None, default=None
            As in `diagnose`.

        Returns
        -------
        Bunch
            ``scores``, in nepers, ``factors``, true over nominal order, and
            ``bearings``, the index of the bearing that fits best, all of shape (n_rows,
            3) for ball, inner and outer race; ``other_orders`` and ``other_scores`` of
            the strongest comb at another order; ``shaft_scores`` of multiples of the
            shaft; ``rpm``, the true mean speed, ``speed_errors``, its ratio to the
            stated one, and ``n_revolutions`` of the bearing's shaft; and ``contrasts``
            of shape (n_rows, 4001), at the orders 0, .01, ... 40 at the true speed.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        return self._match(X, rpm, bearing)

    def _match(self, X, rpm, bearing=None, *, with_contrasts=True):
        learned = self.conditions_
        train_rpm = None if learned is None else capabilities(learned).speeds
        return self._search(bearing).match(
            X, rpm, train_rpm, with_contrasts=with_contrasts, n_jobs=self.n_jobs
        )

    def _diagnosed(self, X, rpm, bearing=None):
        matches = self._match(X, rpm, bearing, with_contrasts=False)
        healthy = self._healthy(bearing)
        compared = compare_combs(matches, healthy, 1, self.false_alarm_rate)
        search = self._search(bearing)
        judged = Bunch(
            has_comb=compared.alarm,
            p_value=compared.p_value,
            comb_limit=compared.score_limits,
            evidence=comb_sentences(matches, compared, search.bearings, search.orders),
            rpm=matches.rpm,
            comb_scores=matches.scores,
        )
        locations = self.class_locations_
        if self.conditions_ is None:
            judged.refusal = refusals(matches)
            judged.row_evidence = evidence_of_rows(matches)
            judged.update(
                verdicts_by_combs(matches, healthy, compared, self.classes_, locations)
            )
            return judged
        learned = self.conditions_.diagnose(X, rpm)
        logs, judged.comb = evidence_beside_spectra(
            matches, healthy.reference, locations
        )
        judged.update(self._decided(learned.log_probability + logs))
        by_combs = np.maximum(logs, np.log(SMALLEST_PROBABILITY))
        judged.row_evidence = np.hstack([learned.row_evidence, by_combs])
        judged.update(recorded=learned.recorded, levels=learned.levels)
        if "alarm" in learned:
            judged.alarm = learned.alarm
        return judged

    def _joined(self, evidence, n_rows):
        if self.conditions_ is None:
            matches = matches_of_evidence(evidence)
            healthy = self._healthy(None)
            compared = compare_combs(matches, healthy, n_rows, self.false_alarm_rate)
            return verdicts_by_combs(
                matches, healthy, compared, self.classes_, self.class_locations_
            )
        by_spectra, by_combs = np.split(evidence, [len(self.classes_)], axis=1)
        learned = self.conditions_.join(by_spectra, n_rows)
        weights = effective_number(n_rows).reshape(-1, 1)
        scores = learned.log_probability + weights * by_combs
        return Bunch(recorded=learned.recorded, **self._decided(scores))

    def _adaptive_part(self):
        return getattr(self, "conditions_", self.conditions)

    def _healthy(self, bearing):
        """Return what the combs of healthy rows show; no row is of another bearing."""
        if bearing is not None:
            return without_healthy(self.false_alarm_rate)
        return HealthyCombs(
            self.reference_, self.healthy_scores_, self.healthy_speeds_, self.limit_
        )

    def _decided(self, scores):
        """Return log probabilities, probabilities, verdicts and scores of conditions."""
        logs = log_softmax(scores, axis=1)
        of_classes = decided(logs, self.classes_, *self.conditions_.questions())
        return {"log_probability": logs} | of_classes

    def _capabilities(self):
        if self.conditions_ is not None:
            return self.conditions_._capabilities() | {
                "sampling_rate": self.sampling_rate,
                "takes_rpm": True,
                # Each condition by spectra; by combs also an unknown one.
                "n_evidence": 2 * len(self.classes_) + 1,
            }
        healthy = self.classes_[self.class_locations_ == FAULT_LOCATIONS.index(HEALTHY)]
        return {
            "alarm": True,
            "combs_alone": True,
            "healthy_was_recorded": len(self.healthy_scores_) > 0,
            "limits": f"combs {self.limit_:.2f} nepers above the healthy rows",
            "n_evidence": N_EVIDENCE,
            "healthy": next(iter(healthy.tolist()), None),
            "is_stretch": True,
            "needs_rpm": self.speed_range is None,
            "sampling_rate": self.sampling_rate,
            "stated_rate": self.false_alarm_rate,
        }

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        self._check_classes()
        self._check_array("class_locations_", self.classes_.shape, kind=int)
        are_locations = np.isin(self.class_locations_, range(OWN_LOCATION + 1))
        expected = "0, 1, 2, 3 or 4"
        expect(are_locations, "class_locations_", self.class_locations_, expected)
        self._check_array("orders_", (None, 4), "above 0")
        self._check_array("reference_", (len(FAULTS),))
        self._check_array("healthy_speeds_", (None,), "above 0")
        self._check_array("healthy_scores_", self.healthy_speeds_.shape)
        are_sorted = np.diff(self.healthy_scores_) >= 0
        expect(are_sorted, "healthy_scores_", self.healthy_scores_, "ascending")
        self._check_number("limit_")
        if self.conditions_ is not None:
            self._check_part("conditions_")

    def _check_relations(self):
        self._search()

    def _check_parameters(self):
        self._search_of(bearing_list(self.bearing)).check()
        check_real(self.false_alarm_rate, "false_alarm_rate", max_val=1, **ABOVE_0)
        check_locations(self.locations)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = False
        return tags
