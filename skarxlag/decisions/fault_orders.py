"""Classifier that names faults without recordings of them, by the orders of the bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import clone
from sklearn.utils import Bunch

from ..bearings import BearingLike, bearing_orders, listed
from ..core.capabilities import training_speeds
from ..core.fault_locations import (
    FAULT_LOCATIONS,
    FAULTS,
    HEALTHY,
    OWN_LOCATION,
    check_locations,
)
from ..core.speeds import samples_per_revolution, speeds_of_rows
from ..core.state import expect, uses_fitted
from ..core.validation import (
    ABOVE_0,
    check_real,
    check_sampling_rate,
    of_one_model,
    validate_innovations,
    weighted_windows,
)
from ..kernels.evidence import COMB_CORRELATION, SMALLEST_PROBABILITY, effective_number
from ..kernels.posterior import decided
from .comb_limits import (
    OF_NOISE,
    HealthyCombs,
    compare_combs,
    healthy_combs,
    length_allowance,
    without_healthy,
)
from .comb_probabilities import evidence_beside_spectra, verdicts_by_combs
from .comb_search import CombSearch
from .comb_sentences import comb_sentences
from .labelled_rows import locate_labels
from .signal_classifier import SignalClassifier

_ORDERS = itemgetter("cage", "spin", "inner", "outer")
_ROW_METADATA = {"rpm": True, "bearing": True}
#: What counts beside the scores when rows are joined.
_BESIDE_SCORES = ("other_scores", "rpm", "n_revolutions")
#: Why there is no verdict on a row.
_NO_COMBS = "combs need a plausible speed, and two revolutions of the shaft in a row"


def _orders(bearings):
    """Return the orders of bearings, of shape (n_bearings, 4)."""
    return np.array([_ORDERS(bearing_orders(bearing)) for bearing in bearings])


def _gain(n_rows):
    """Return how much less the mean of several rows of a machine scatters."""
    return np.sqrt(effective_number(n_rows, COMB_CORRELATION))


@dataclass(kw_only=True, eq=False, repr=False)
class FaultOrderClassifier(SignalClassifier):
    r"""Classifier that names the location of a bearing fault without recordings of faults.

    A fault of a race or a rolling element causes impacts at orders of the shaft that
    follow from the bearing's geometry [1]_: BPFO and BPFI for the outer and the inner
    race, and twice BSF for a rolling element. The score of a fault location is the mean
    contrast of the envelope spectra at the first four multiples of its order, see
    :func:`skarxlag.kernels.fault_orders.order_contrast` and
    :func:`skarxlag.kernels.fault_orders.fault_comb`. The location with the largest
    score is named if the score exceeds a limit; otherwise the row is healthy. Lines of
    the shaft, of the mains and of other impacts do not count. The lines of the shaft
    also show its true speed, :func:`skarxlag.kernels.fault_orders.speed_error`.

    A row of X is a raw signal, or the innovations of one model
    (``ARXLaguerre(bank=False)``), with at least two revolutions of the shaft, and
    better ten revolutions and a second. Its speed is given as `rpm`.

    Without `y`, the classes are "ball", "healthy", "inner" and "outer". The limit is
    that of healthy recordings of other machines: a quantile of a Gumbel distribution
    (location 1.65, scale .28 nepers for rows of 100 revolutions), and half a neper more
    for each neper of length,
    :func:`skarxlag.decisions.comb_limits.length_allowance`. The stated false-alarm rate
    holds as far as the machine resembles those.

    With `y`, each label stands for a fault location. The mean scores of healthy rows are
    subtracted, and the limit is the conformal quantile of the largest rest. The stated
    rate then holds for rows like these, at their speeds. At other speeds the limit is
    at least a quantile of a Gumbel distribution (location .06, scale .28). If all rows
    are healthy and their label is a text, the faults are added to the classes.

    The probabilities follow from the scores above the limit by
    :func:`skarxlag.decisions.comb_probabilities.comb_evidence`. A fault shows its comb
    with the probability .6, so that of healthy is at most .45 if all locations are
    classes. If impacts at no order of the bearing are stronger by more than .5 nepers,
    as with another bearing than the stated one, no location gets more than .73.

    With `conditions`, a classifier that learned the spectra of several conditions, the
    probability of condition c is

    .. math:: p_c \propto P_c\, q_c

    with the probability :math:`P_c` of its location by combs, and its probability
    :math:`q_c` by spectra. An unknown condition has the :math:`P_c` of a healthy one.
    If no condition is near, as after another mounting or load, combs decide the
    location. Spectra decide among conditions of one location, and alone in rows without
    `rpm` or of less than two revolutions.

    Rows of another machine get its bearing with them: ``predict(X, rpm=900,
    bearing="6203")``. Rows of shape (n_rows, 1, n_samples) have any length.

    Parameters
    ----------
    bearing : BearingLike or sequence of BearingLike, default=None
        The bearing, or several bearings on one shaft: names such as "6205", dimensions,
        or orders, see :func:`skarxlag.bearings.bearing_orders`. It is required.
    sampling_rate : float, default=None
        In Hz, above 0. It is required.
    locations : mapping of label to str or None, default=None
        Fault location of each label in `y`: "healthy", "inner", "outer" or "ball".
        Other labels get the location that their name states, such as "IR7" or "outer
        race", or else the one that their rows show: that of the largest mean score. If
        it is below the limit, the label has a location of its own. A warning names it
        unless `locations` maps it to None.
    conditions : ConditionClassifier or None, default=None
        Learns the spectra of conditions if `y` has several, as in `make_diagnoser`.
        None: combs decide alone.
    gear_ratio : float, default=1.0
        Revolutions of the bearing's shaft for each revolution of the shaft whose speed
        is given, above 0.
    false_alarm_rate : float, default=0.02
        Share in (0, 1) of healthy rows that may be named faulty.
    speed_tolerance : float, default=0.12
        Largest logarithm of the true speed over the nominal speed, in [0, 0.3]. The
        true speed is found by the lines of the shaft.
    slip : float, default=0.02
        Largest logarithm of the factor by which slip of the elements moves the order of
        one comb, above 0.
    speed_range : tuple of two floats or None, default=None
        Lowest and highest speed in revolutions per minute. Without `rpm`, the speed of
        each row is searched in this range, as in :func:`skarxlag.estimate_shaft_speed`.
        None: `rpm` is required.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Labels, sorted.
    class_locations_ : ndarray of int of shape (n_classes,)
        Fault location of each class: 0 ball, 1 inner race, 2 outer race, 3 healthy, 4
        of its own.
    orders_ : ndarray of shape (n_bearings, 4)
        Orders of the cage (FTF), the spin of an element (BSF), the inner race (BPFI)
        and the outer race (BPFO), in multiples of the bearing's shaft.
    reference_ : ndarray of shape (3,)
        Mean scores of healthy rows at ball, inner and outer race; 0 without such rows.
    limit_ : float
        Limit above the reference in nepers, at the speeds of the healthy rows.
    healthy_scores_, healthy_speeds_ : ndarray of shape (n_healthy,)
        Largest scores above the reference, and speeds of healthy rows, ascending.
    conditions_ : ConditionClassifier or None
        The fitted `conditions`. None if `y` has one condition or is not given.
    n_models_, n_features_in_ : int
        1 and 1 if rows were innovations; 0 and the samples of a plain row.
    window_shape_, feature_names_in_ : ndarray
        Shape of one row, and column names if fitted on a table.

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

    #: Metadata routing passes these without `set_predict_request` and its siblings.
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
        self.orders_: NDArray[Any] = _orders(listed(self.bearing))
        self.conditions_: Any = None
        if y is None:
            self._set_healthy(without_healthy(self.false_alarm_rate))
            classes, locations = np.unique(FAULT_LOCATIONS, return_index=True)
        else:
            located = self._locate(X, y, rpm, sample_weight)
            classes, locations = located.classes()
            if len(located.labels) > 1 and self.conditions is not None:
                learner = clone(self.conditions)
                learner.set_params(locations=located.of_conditions())
                self.conditions_ = learner.fit(X, y, rpm, sample_weight, specimen)
        self.classes_: NDArray[Any] = classes
        self.class_locations_: NDArray[Any] = locations

    def _locate(self, X, y, rpm, sample_weight):
        """Locate the labels of rows by their combs, and set the limits of healthy rows."""
        rows, labels, weights = weighted_windows(np.arange(len(X)), y, sample_weight)
        speeds = None
        if rpm is not None:
            speeds = speeds_of_rows(rpm, len(X))[rows]
            samples_per_revolution(
                speeds,
                self.sampling_rate,
                len(rows),
                X.shape[-1],
                self._search().least_revolutions,
            )
        matches = self._match(X[rows], speeds, with_contrasts=False)
        counted = np.repeat(np.arange(len(rows)), np.ceil(weights).astype(int))
        scores = matches.scores[counted]
        allowance = length_allowance(matches.n_revolutions[counted])
        located = locate_labels(
            labels[counted],
            scores - allowance[:, np.newaxis],
            self.locations,
            without_healthy(self.false_alarm_rate).limit,
        )
        is_healthy = located.is_healthy
        speeds = matches.rpm[counted][is_healthy]
        self._set_healthy(
            healthy_combs(scores[is_healthy], speeds, self.false_alarm_rate)
        )
        return located

    def _set_healthy(self, healthy):
        """Store what the combs of healthy rows show."""
        self.reference_: NDArray[Any] = healthy.reference
        self.healthy_scores_: NDArray[Any] = healthy.best
        self.healthy_speeds_: NDArray[Any] = healthy.speeds
        self.limit_: float = healthy.limit

    def _bearings(self, bearing):
        """Return the bearings of rows: another one, or those of `fit`."""
        if bearing is not None:
            return [bearing]
        self._check_relations()
        return listed(self.bearing)

    def _search(self, bearing=None):
        return CombSearch(
            orders=_orders(self._bearings(bearing)),
            sampling_rate=float(self.sampling_rate),
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
            Nominal speed; None only with `speed_range`. Rows of less than two
            revolutions, or without a plausible speed, get the score 0, and the speed
            NaN.
        bearing : BearingLike or None, default=None
            As in `diagnose`.

        Returns
        -------
        Bunch
            ``scores``, in nepers, ``factors``, true over nominal order, and
            ``bearings``, the index of the bearing that fits best, all of shape (n_rows,
            3) for ball, inner and outer race; ``other_orders`` and ``other_scores`` of
            the strongest comb at another order; ``shaft_scores`` of the lines at
            multiples of the shaft; ``rpm``, the true mean speed of each
            row, ``speed_errors``, its ratio to the stated speed, and ``n_revolutions``
            of the bearing's shaft; and ``contrasts`` of shape (n_rows, 4001), at the
            orders 0, .01, ... 40 of the bearing's shaft at its true speed.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        return self._match(X, rpm, bearing)

    def _match(self, X, rpm, bearing=None, *, with_contrasts=True):
        train_rpm = ()
        if self.conditions_ is not None:
            train_rpm = training_speeds(self.conditions_)
        elif self.speed_range is None:
            expected = "the speed of each row, or a speed_range"
            expect(rpm is not None, "rpm", rpm, expected)
        return self._search(bearing).match(
            X, rpm, train_rpm, with_contrasts=with_contrasts, n_jobs=self.n_jobs
        )

    def _diagnosed(self, X, rpm, bearing=None):
        matches = self._match(X, rpm, bearing)
        if self.conditions_ is None:
            judged = self._judge(matches, bearing=bearing)
            has_no_combs = np.isnan(matches.rpm)
            judged.refusal = np.where(has_no_combs, _NO_COMBS, "").astype(object)
            beside = [matches[name] for name in _BESIDE_SCORES]
            judged.row_evidence = np.column_stack([matches.scores, *beside])
        else:
            learned = self.conditions_.diagnose(X, rpm)
            judged = self._judge(matches, learned.log_probability, bearing=bearing)
            judged.update(recorded=learned.recorded, levels=learned.levels)
            # No row excludes a condition by its comb alone.
            by_combs = np.maximum(judged.pop("by_combs"), np.log(SMALLEST_PROBABILITY))
            judged.row_evidence = np.hstack([learned.row_evidence, by_combs])
            if "alarm" in learned:
                judged.alarm = learned.alarm
        judged.update(
            contrasts=matches.contrasts, rpm=matches.rpm, comb_scores=matches.scores
        )
        return judged

    def _joined(self, evidence, n_rows):
        if self.conditions_ is None:
            scores = evidence[:, : len(FAULTS)]
            beside = dict(
                zip(_BESIDE_SCORES, evidence[:, len(FAULTS) :].T, strict=True)
            )
            matches = Bunch(scores=scores, **beside)
            healthy = self._healthy()
            compared = self._compared(matches, n_rows, healthy)
            return self._by_combs(compared, matches, healthy)
        by_spectra, by_combs = np.split(evidence, [len(self.classes_)], axis=1)
        learned = self.conditions_.join(by_spectra, n_rows)
        weights = effective_number(n_rows).reshape(-1, 1)
        scores = learned.log_probability + weights * by_combs
        return Bunch(recorded=learned.recorded, **self._decided(scores))

    @uses_fitted
    def diagnose_gathered(
        self,
        contrast: NDArray[Any],
        n_rows: float,
        rpm: float,
        evidence: NDArray[Any] | None = None,
        n_joined: float = 1.0,
        bearing: BearingLike | None = None,
    ) -> Bunch:
        """Diagnose the mean contrast of several rows of a machine.

        The mean has less noise than one contrast, so fainter combs stand out. At the
        speeds of healthy rows, the limit of one row is divided by the root of the
        effective number of rows (`skarxlag.kernels.evidence.effective_number`). Scores
        that join spectra are multiplied by that root at all speeds.

        Parameters
        ----------
        contrast : ndarray of shape (4001,)
            Mean of ``contrasts``, which `diagnose` returns, over rows as long as those
            of `fit`.
        n_rows : float
            Number of rows, or the sum of their weights.
        rpm : float
            Their speed. NaN: combs are not used.
        evidence : ndarray of shape (2 * n_classes + 1,) or None, default=None
            Mean of ``row_evidence``, of which spectra are used. Required with
            `conditions`, and not used without them.
        n_joined : float, default=1.0
            Number of rows of `evidence`, or the sum of their weights, above 0.
        bearing : BearingLike or None, default=None
            As in `diagnose`.

        Returns
        -------
        Bunch
            As `diagnose` returns it, for one row, without ``contrasts``.
        """
        n_samples = self.window_shape_[-1]
        matches = self._search(bearing).match_gathered(contrast, n_samples, rpm)
        if self.conditions_ is None:
            return self._judge(matches, None, n_rows, bearing)
        by_spectra = np.asarray(evidence)[: len(self.classes_)]
        learned = self.conditions_.join(by_spectra[np.newaxis], n_joined)
        return self._judge(matches, learned.log_probability, n_rows, bearing)

    def p_values(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the probability that a healthy row has a comb as strong.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows,)
            In (0, 1]. With healthy rows in `fit`: the share of rows with a larger
            score, and an exponential tail above all of them.
        """
        return self.diagnose(X, rpm, **params).p_value

    def _adaptive_part(self):
        return getattr(self, "conditions_", self.conditions)

    def _judge(self, matches, spectra=None, n_rows=1, bearing=None):
        """Judge matched rows, with the log probabilities by spectra if conditions were learned."""
        healthy = self._healthy()
        if bearing is not None:
            healthy = without_healthy(self.false_alarm_rate)
        compared = self._compared(matches, n_rows, healthy)
        bearings = self._bearings(bearing)
        sentences = comb_sentences(matches, compared, _orders(bearings), bearings)
        judged = Bunch(
            has_comb=compared.alarm,
            p_value=compared.p_value,
            comb_limit=compared.score_limits,
            evidence=sentences,
        )
        if spectra is None:
            judged.update(self._by_combs(compared, matches, healthy))
        else:
            gain = _gain(n_rows)
            without_comb = np.maximum(gain * healthy.reference, OF_NOISE)
            by_combs, judged.comb = evidence_beside_spectra(
                gain * matches.scores - without_comb,
                ~np.isnan(matches.rpm),
                self.class_locations_,
            )
            judged.update(self._decided(spectra + by_combs), by_combs=by_combs)
        return judged

    def _healthy(self):
        """Return what the combs of healthy rows show."""
        return HealthyCombs(
            self.reference_, self.healthy_scores_, self.healthy_speeds_, self.limit_
        )

    def _compared(self, matches, n_rows, healthy):
        """Compare mean scores of rows with those of healthy rows."""
        return compare_combs(matches, healthy, _gain(n_rows), self.false_alarm_rate)

    def _by_combs(self, compared, matches, healthy):
        """Return the verdicts of combs alone."""
        verdicts = verdicts_by_combs(
            compared,
            ~np.isnan(matches.rpm),
            self.classes_,
            self.class_locations_,
            healthy_was_recorded=len(healthy.best) > 0,
        )
        return Bunch(alarm=compared.alarm, **verdicts)

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
            "n_evidence": len(FAULTS) + len(_BESIDE_SCORES),
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
        locations = self.class_locations_
        are_locations = np.isin(locations, range(OWN_LOCATION + 1))
        expect(are_locations, "class_locations_", locations, "0, 1, 2, 3 or 4")
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
        if not np.array_equal(_orders(listed(self.bearing)), self.orders_):
            raise ValueError(
                f"orders_ are not of bearing {self.bearing!r}: parameters changed since fit: "
                "call fit, or pass bearing= to predict."
            )

    def _check_parameters(self):
        check_sampling_rate(self.sampling_rate)
        for name in ("gear_ratio", "slip"):
            check_real(getattr(self, name), name, **ABOVE_0)
        check_real(self.false_alarm_rate, "false_alarm_rate", max_val=1, **ABOVE_0)
        check_real(self.speed_tolerance, "speed_tolerance", min_val=0, max_val=0.3)
        if self.speed_range is not None:
            is_pair = np.size(self.speed_range) == 2
            expect(is_pair, "speed_range", self.speed_range, "two speeds")
            low, high = self.speed_range
            check_real(high, "speed_range[1]", **ABOVE_0)
            check_real(low, "speed_range[0]", **ABOVE_0 | {"max_val": high})
        check_locations(self.locations)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = False
        return tags
