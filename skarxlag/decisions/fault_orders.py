"""Classifier that names faults without recordings of them, by the orders of the bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import BaseEstimator, clone
from sklearn.utils import Bunch
from sklearn.utils.metaestimators import available_if

from ..bearings import BearingLike, bearing_orders, listed
from ..core.base import SignalEstimator
from ..core.capabilities import capabilities, training_speeds
from ..core.diagnosing_classifier import DiagnosingClassifier
from ..core.fault_locations import (
    FAULT_LOCATIONS,
    FAULTS,
    HEALTHY,
    NOT_IDENTIFIABLE,
    location_of_label,
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
from ..kernels.evidence import (
    COMB_CORRELATION,
    SMALLEST_PROBABILITY,
    effective_number,
)
from ..kernels.posterior import decided
from .comb_probabilities import (
    VISIBLE_ALONE,
    WITHOUT_COMB,
    comb_evidence,
    least_margin,
    limit_elsewhere,
    limit_of_healthy,
    p_values_of_healthy,
)
from .comb_search import CombSearch

#: Logarithm of speed up to which rows count as rows of the same speed.
_SAME_SPEED = 0.05
_ORDERS = itemgetter("cage", "spin", "inner", "outer")
_HEALTHY = FAULT_LOCATIONS.index(HEALTHY)
#: Fields of `Capabilities` that a classifier takes from its learned conditions.
_OF_CONDITIONS = (
    "alarm",
    "healthy",
    "stated_rate",
    "speeds",
    "is_stretch",
    "locations",
    "n_specimens",
    "states_unknown",
    "n_healthy",
)
#: Why there is no verdict on a row.
_NO_COMBS = "combs need a plausible speed, and two revolutions of the shaft in a row"


@dataclass(kw_only=True, eq=False, repr=False)
class FaultOrderClassifier(SignalEstimator, DiagnosingClassifier, BaseEstimator):
    r"""Classifier that names the location of a bearing fault without recordings of faults.

    A fault of a race or a rolling element causes impacts at orders of the shaft that
    follow from the bearing's geometry [1]_: BPFO and BPFI for the outer and the inner
    race, and twice BSF for a rolling element. The score of a fault location is the mean
    contrast of the envelope spectra at the multiples of its order, see
    :func:`skarxlag.kernels.fault_orders.order_contrast` and
    :func:`skarxlag.kernels.fault_orders.fault_comb`. The location with the largest
    score is named if the score exceeds a limit; otherwise the row is healthy.

    A row of X is a raw signal, or the innovations of one model
    (``ARXLaguerre(bank=False)``), with at least two revolutions of the shaft, and
    better ten revolutions and a second. Its speed is given as `rpm`.

    Without `y`, the classes are "ball", "healthy", "inner" and "outer". The limit is
    that of healthy recordings of other machines, whose largest scores have a Gumbel
    distribution (location .86, scale .31 nepers). The stated false-alarm rate holds as
    far as the machine resembles those.

    With `y`, each label stands for a fault location. The mean scores of healthy rows are
    subtracted, and the limit is the conformal quantile of the largest rest. The stated
    rate then holds for rows like these, at their speeds. At other speeds the limit is
    at least that of a Gumbel distribution (location .06, scale .31), as other machines
    show it. If all rows are healthy and their label is a text, the faults are added to
    the classes.

    The probabilities are those of :func:`skarxlag.decisions.comb_probabilities.comb_evidence`
    for scores above the limit, and faults that show their comb with the probability .6.
    The probability of healthy is thus at most .45 if all locations are classes.

    With `conditions`, a classifier that learned the spectra of several conditions, the
    probability of condition c is

    .. math:: p_c \propto P_c\, q_c

    with the probability :math:`P_c` of its location by combs, and its probability
    :math:`q_c` by spectra. An unknown condition has the :math:`P_c` of a healthy one,
    and its own :math:`q_c`, see `ConditionClassifier`. If no condition is near, as
    after another mounting or load, the probabilities by spectra are similar, and combs
    decide the location. Conditions of one location share the combs; spectra decide
    among them, and alone in rows without `rpm` or of less than two revolutions.

    Parameters
    ----------
    bearing : BearingLike or sequence of BearingLike, default=None
        The bearing, or several bearings on one shaft: names such as "6205", dimensions,
        or orders, see :func:`skarxlag.bearings.bearing_orders`. It is
        required.
    sampling_rate : float, default=None
        In Hz, above 0. It is required.
    locations : mapping of label to str or None, default=None
        Fault location of each label in `y`: "healthy", "inner", "outer" or "ball".
        Other labels get the location that their name states, such as "IR7" or "outer
        race", or else the one that their rows show: that of the largest mean score, or
        healthy if it is below the limit.
    conditions : ConditionClassifier or None, default=None
        Learns the spectra of conditions if `y` has several, as in `make_diagnoser`.
        None: combs decide alone.
    gear_ratio : float, default=1.0
        Revolutions of the bearing's shaft for each revolution of the shaft whose speed
        is given, above 0.
    false_alarm_rate : float, default=0.02
        Share in (0, 1) of healthy rows that may be named faulty.
    wrong_name_rate : float, default=0.02
        Share in (0, 0.5) of wrong locations among the rows that are named. `diagnose`
        names a row "not identifiable" if the two best scores are closer than the margin
        that this share needs.
    speed_tolerance : float, default=0.1
        Largest logarithm of the true speed over the nominal speed, in [0, 0.3]. All
        combs share it.
    slip : float, default=0.03
        Largest logarithm of the factor by which slip of the elements moves the order of
        one comb, above 0. The largest slip costs .15 nepers. An error of the speed of
        this size costs all combs .4 nepers. Both costs are proportional to the square
        of the logarithm.
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
        Fault location of each class: 0 ball, 1 inner race, 2 outer race, 3 healthy.
    orders_ : ndarray of shape (n_bearings, 4)
        Orders of the cage (FTF), the spin of an element (BSF), the inner race (BPFI)
        and the outer race (BPFO), in multiples of the bearing's shaft.
    reference_ : ndarray of shape (3,)
        Mean scores of healthy rows at the ball, the inner and the outer race; 0 without
        such rows.
    limit_ : float
        Limit above the reference in nepers, at the speeds of the healthy rows.
    healthy_scores_, healthy_speeds_ : ndarray of shape (n_healthy,)
        Largest scores above the reference, and speeds of the healthy rows, each
        ascending.
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

    bearing: BearingLike | Sequence[BearingLike] | None = None
    sampling_rate: float | None = None
    locations: Mapping[Any, str] | None = None
    conditions: Any = None
    gear_ratio: float = 1.0
    false_alarm_rate: float = 0.02
    wrong_name_rate: float = 0.02
    speed_tolerance: float = 0.1
    slip: float = 0.03
    speed_range: tuple[float, float] | None = None
    n_jobs: int | None = None

    #: Metadata routing passes `rpm` without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {
        "rpm": True,
        "sample_weight": True,
        "specimen": True,
    }

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        specimen: ArrayLike | None = None,
    ) -> Self:
        """Learn limits from healthy rows, and conditions from their labels.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows, or the innovations of one model.
        y : array-like of shape (n_rows,) or None, default=None
            Condition of each row.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed in revolutions per minute. It is needed with `y`.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            How many rows each one stands for, at least 0; combs count the next integer.
            None: one.
        specimen : array-like of shape (n_rows,) or None, default=None
            Identifier of the specimen of each row, for `conditions`. None: each
            condition is one specimen.

        Returns
        -------
        FaultOrderClassifier
            The fitted classifier.

        Raises
        ------
        ValueError
            If a parameter is missing or out of its range, a speed is not above 0, or a
            row has less than two revolutions.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        of_one_model(X[:1])
        self.orders_: NDArray[Any] = np.array(
            [_ORDERS(bearing_orders(bearing)) for bearing in listed(self.bearing)]
        )
        self.conditions_: Any = None
        self._calibrate(np.empty((0, len(FAULTS))), np.empty(0))
        if y is None:
            labels = FAULT_LOCATIONS
            locations = range(len(FAULT_LOCATIONS))
        else:
            labels, locations = self._learn(X, y, rpm, sample_weight, specimen)
        classes, index = np.unique(labels, return_index=True)
        self.classes_: NDArray[Any] = classes
        self.class_locations_: NDArray[Any] = np.asarray(locations)[index]
        return self

    def _learn(self, X, y, rpm, sample_weight, specimen):
        """Learn limits and spectra from labelled rows, and return classes and their locations."""
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
        counts = np.ceil(weights).astype(int)
        scores = np.repeat(matches.scores, counts, axis=0)
        speeds = np.repeat(matches.rpm, counts, axis=0)
        classes, target = np.unique(np.repeat(labels, counts), return_inverse=True)
        names = classes.tolist()
        stated = {name: self._stated_location(name) for name in names}
        locations = np.array(
            [
                self._shown_location(scores[target == c])
                if stated[name] is None
                else FAULT_LOCATIONS.index(stated[name])
                for c, name in enumerate(names)
            ]
        )
        is_healthy = locations[target] == _HEALTHY
        self._calibrate(scores[is_healthy], speeds[is_healthy])
        if len(classes) > 1 and self.conditions is not None:
            # A class that shows no comb is healthy only if it is named so.
            location_of_name = {
                name: FAULT_LOCATIONS[location]
                for name, location in zip(names, locations, strict=True)
                if stated[name] is not None or location != _HEALTHY
            }
            learner = clone(self.conditions).set_params(locations=location_of_name)
            self.conditions_ = learner.fit(
                X, y, rpm=rpm, sample_weight=sample_weight, specimen=specimen
            )
        if len(classes) == 1 and classes.dtype.kind in "UO" and is_healthy.all():
            return [*FAULTS, classes[0]], range(len(FAULT_LOCATIONS))
        return classes, locations

    def _stated_location(self, label):
        """Return the fault location that `locations` or the label states, or None."""
        return (self.locations or {}).get(label, location_of_label(label))

    def _shown_location(self, scores):
        """Return the index of the fault location that the rows of a label show."""
        mean = scores.mean(axis=0)
        return int(mean.argmax()) if mean.max() > self.limit_ else _HEALTHY

    def _calibrate(self, scores, speeds):
        """Learn reference and limit from the scores and speeds of healthy rows."""
        n_rows = len(scores)
        self.reference_: NDArray[Any] = np.zeros(len(FAULTS))
        if n_rows > 0:
            self.reference_ = scores.mean(axis=0)
        best = (scores - self.reference_).max(axis=1, initial=-np.inf)
        # A row is nearer to a mean that it is a part of.
        self.healthy_scores_: NDArray[Any] = np.sort(best * n_rows / max(n_rows - 1, 1))
        self.healthy_speeds_: NDArray[Any] = np.sort(
            np.where(np.isnan(speeds), 1.0, speeds)
        )
        self.limit_: float = limit_of_healthy(
            self.healthy_scores_, self.false_alarm_rate
        )

    def _search(self):
        return CombSearch(
            orders=self.orders_,
            sampling_rate=float(self.sampling_rate),
            gear_ratio=self.gear_ratio,
            speed_tolerance=self.speed_tolerance,
            slip=self.slip,
            speed_range=self.speed_range,
        )

    @uses_fitted
    def match(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute the scores of all faults, and the factors on the speed that fit best.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed; None only with `speed_range`. Rows of less than two
            revolutions, or without a plausible speed, get the score 0, and the speed
            NaN.

        Returns
        -------
        Bunch
            ``scores``, in nepers, ``factors``, true over nominal speed, and
            ``bearings``, the index of the bearing that fits best, all of shape (n_rows,
            3) for ball, inner and outer race; ``contrasts`` of shape (n_rows, 4001), at
            the orders 0, .01, ... 40 of the bearing's shaft; and ``rpm``, the mean
            speed of each row.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        return self._match(X, rpm)

    def _match(self, X, rpm, *, with_contrasts=True):
        train_rpm = ()
        if self.conditions_ is not None:
            train_rpm = training_speeds(self.conditions_)
        elif self.speed_range is None:
            expected = "the speed of each row, or a speed_range"
            expect(rpm is not None, "rpm", rpm, expected)
        return self._search().match(
            X, rpm, train_rpm, with_contrasts=with_contrasts, n_jobs=self.n_jobs
        )

    @uses_fitted
    def diagnose(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute verdict, probability and evidence of each row from one match.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        Bunch
            ``score``, ``probability``, ``verdict`` and ``p_value``: the results of
            `decision_function`, `predict_proba`, `predict` and `p_values`. ``alarm``:
            True for a comb that healthy rows exceed at the stated false-alarm rate
            only; with `conditions`, their alarm, or none without a healthy condition.
            ``named``, without `conditions`: the verdict, or "not identifiable" if a
            comb exceeds the limit, but the second location is too close, see
            `wrong_name_rate`. ``refusal``: without `conditions`, why a row has no
            verdict but equal probabilities: its speed is not plausible, or it has less
            than two revolutions; else an empty text. ``evidence``: a sentence with the
            order and the location of the best comb, its contrast in dB, and the
            difference from the nominal order, which slip and an error of the speed
            cause together. If it exceeds `slip`, the sentence asks to check the speed
            and the bearing.
            ``contrasts`` and ``rpm``: as in `match`. With `conditions`,
            ``log_probability`` are those of the conditions and, in the last column, of
            an unknown one, ``levels`` and ``recorded`` are those of
            `ConditionClassifier.diagnose`, ``comb`` is the probability of a fault by
            combs alone, NaN for rows whose combs are not used, and ``row_evidence`` is
            that of which `join` takes the mean over the rows of a recording.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        matches = self._match(X, rpm)
        if self.conditions_ is None:
            judged = self._judge(matches)
            has_no_combs = np.isnan(matches.rpm)
            judged.refusal = np.where(has_no_combs, _NO_COMBS, "").astype(object)
        else:
            learned = self.conditions_.diagnose(X, rpm=rpm)
            judged = self._judge(matches, learned.log_probability)
            judged.recorded = learned.recorded
            judged.levels = learned.levels
            # No row excludes a condition by its comb alone.
            by_combs = np.maximum(judged.pop("by_combs"), np.log(SMALLEST_PROBABILITY))
            judged.row_evidence = np.hstack([learned.row_evidence, by_combs])
            # The limits of combs do not belong to conditions that were learned.
            del judged["alarm"]
            if "alarm" in learned:
                judged.alarm = learned.alarm
        judged.contrasts = matches.contrasts
        judged.rpm = matches.rpm
        return judged

    @available_if(lambda self: self.conditions is not None)
    @uses_fitted
    def join(self, evidence: ArrayLike, n_rows: ArrayLike = 1.0) -> Bunch:
        """Diagnose recordings by the mean evidence of their rows.

        Spectra are joined as by `ConditionClassifier.join`. The log probabilities of
        locations by combs count as often as the effective number of rows
        (`skarxlag.kernels.evidence.effective_number`).

        Parameters
        ----------
        evidence : array-like of shape (n_recordings, 2 * n_classes + 2)
            Means of ``row_evidence``, which `diagnose` returns with learned conditions.
        n_rows : float or array-like of shape (n_recordings,), default=1.0
            Number of rows, or the sum of their weights, above 0.

        Returns
        -------
        Bunch
            ``log_probability``, ``probability``, ``verdict`` and ``score``, as
            `diagnose` returns them; ``recorded``: the probability of a recorded
            specimen.
        """
        by_spectra, by_combs = np.split(np.asarray(evidence), 2, axis=1)
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
    ) -> Bunch:
        """Diagnose the mean contrast of several rows of a machine.

        The mean has less noise than one contrast, so fainter combs stand out. At the
        speeds of the healthy rows of `fit`, its limit is that of one row divided by the
        root of the effective number of rows
        (`skarxlag.kernels.evidence.effective_number`), otherwise that of one row.
        Scores that join spectra are multiplied by that root at all speeds.

        Parameters
        ----------
        contrast : ndarray of shape (4001,)
            Mean of ``contrasts``, which `diagnose` returns, over rows as long as those
            of `fit`.
        n_rows : float
            Number of rows, or the sum of their weights.
        rpm : float
            Their speed. NaN: combs are not used.
        evidence : ndarray of shape (2 * n_classes + 2,) or None, default=None
            Mean of ``row_evidence``, of which spectra are used. Required with
            `conditions`, and not used without them.
        n_joined : float, default=1.0
            Number of rows of `evidence`, or the sum of their weights, above 0.

        Returns
        -------
        Bunch
            As `diagnose` returns it, for one row, without ``contrasts``.
        """
        matches = self._search().match_gathered(contrast, self.window_shape_[-1], rpm)
        if self.conditions_ is None:
            return self._judge(matches, None, n_rows)
        by_spectra, _ = np.split(np.asarray(evidence), 2)
        learned = self.conditions_.join(by_spectra[np.newaxis], n_joined)
        return self._judge(matches, learned.log_probability, n_rows)

    @available_if(lambda self: self.conditions is not None)
    def adapt(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Adapt the spectra of `conditions` to rows of a new speed.

        Orders are the same at every speed.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows at the new speed.
        y : array-like of shape (n_rows,)
            Their conditions, among `classes_`. Usually all rows are healthy.

        Returns
        -------
        FaultOrderClassifier
            This classifier, for use at the new speed.
        """
        X, y = validate_innovations(self, X, y, reset=False, any_length=True)
        self.conditions_.adapt(X, y)
        return self

    def _judge(self, matches, spectra=None, n_rows=1):
        """Judge matched rows, with the log probabilities by spectra if conditions were learned."""
        distances = np.abs(np.log(matches.rpm[:, np.newaxis] / self.healthy_speeds_))
        # The distance of an unknown speed is NaN.
        is_far = ~(distances.min(axis=1, initial=np.inf) <= _SAME_SPEED)
        elsewhere = limit_elsewhere(self.limit_, self.false_alarm_rate)
        limits = np.where(is_far, elsewhere, self.limit_)
        # Means scatter less about the reference, which is known at the speeds of
        # healthy rows.
        gain = np.sqrt(effective_number(n_rows, COMB_CORRELATION))
        certainty = np.where(is_far, 1.0, gain)
        above = (matches.scores - self.reference_) * certainty[:, np.newaxis]
        ranking = above.argsort(axis=1, kind="stable")[:, :-3:-1]
        best, second = np.take_along_axis(above, ranking, axis=1).T
        alarm = best > limits
        is_close = alarm & (best - second < least_margin(self.wrong_name_rate))
        limits_of_best = self.reference_[ranking[:, 0]] + limits / certainty
        judged = Bunch(
            alarm=alarm,
            p_value=p_values_of_healthy(best, self.healthy_scores_, is_far),
            evidence=self._evidence(matches, ranking, alarm, is_close, limits_of_best),
        )
        if spectra is None:
            beyond = above - limits[:, np.newaxis]
            judged.update(self._judge_by_combs(beyond, is_close, np.isnan(matches.rpm)))
        else:
            judged.update(self._judge_with_spectra(matches, spectra, gain))
        return judged

    def _evidence(self, matches, ranking, alarm, is_close, limits):
        search = self._search()
        bearings = listed(self.bearing)
        sentences = [
            search.describe(
                matches,
                row,
                ranking[row],
                bearings,
                None if alarm[row] else limits[row],
                is_close=is_close[row],
            )
            for row in range(len(ranking))
        ]
        return np.array(sentences, dtype=object)

    def _judge_by_combs(self, beyond, is_close, has_no_combs):
        """Return what combs alone state, from their scores beyond the limits."""
        scores = comb_evidence(beyond, self.class_locations_, visible=VISIBLE_ALONE)
        scores[has_no_combs] = 0.0
        verdict = self.classes_[scores.argmax(axis=1)]
        is_pair = scores.shape[1] == 2
        return {
            "verdict": verdict,
            "named": np.where(is_close, NOT_IDENTIFIABLE, verdict.astype(object)),
            "score": scores[:, 1] - scores[:, 0] if is_pair else scores,
            "probability": np.exp(log_softmax(scores, axis=1)),
        }

    def _judge_with_spectra(self, matches, spectra, gain):
        """Return what combs and spectra state together, and the probability of a comb."""
        has_healthy = len(self.healthy_scores_) > 0
        without_comb = self.reference_ if has_healthy else WITHOUT_COMB
        # An unknown condition need not show a comb.
        locations = np.append(self.class_locations_, _HEALTHY)
        by_combs = comb_evidence(gain * (matches.scores - without_comb), locations)
        is_fault = locations != _HEALTHY
        of_fault = np.exp(by_combs).max(axis=1, where=is_fault, initial=0.0)
        has_combs = ~np.isnan(matches.rpm)
        by_combs[~has_combs] = 0.0
        return {
            "comb": np.where(has_combs, of_fault, np.nan),
            "by_combs": by_combs,
            **self._decided(spectra + by_combs),
        }

    def _decided(self, scores):
        """Return log probabilities, probabilities, verdicts and scores of conditions."""
        logs = log_softmax(scores, axis=1)
        of_classes = decided(logs, self.classes_, *self.conditions_.questions())
        return {"log_probability": logs} | of_classes

    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the probability that a healthy row has a comb as strong.

        Parameters
        ----------
        X, rpm : array-like
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows,)
            In (0, 1]. With healthy rows in `fit`: the share of rows with a larger
            score, and an exponential tail above all of them.
        """
        return self.diagnose(X, rpm).p_value

    def _capabilities(self):
        fields = {"alarm": True, "sampling_rate": self.sampling_rate}
        if self.conditions_ is not None:
            learned = capabilities(self.conditions_)
            # Each condition, and an unknown one, by spectra and by combs.
            fields["n_evidence"] = 2 * (len(self.classes_) + 1)
            return fields | {name: getattr(learned, name) for name in _OF_CONDITIONS}
        healthy = self.classes_[self.class_locations_ == _HEALTHY].tolist()
        return fields | {
            "healthy": healthy[0] if healthy else None,
            "stated_rate": self.false_alarm_rate,
            "needs_rpm": self.speed_range is None,
            "is_stretch": True,
        }

    def _check_fitted(self):
        super()._check_fitted()
        self._check_n_models()
        self._check_classes()
        self._check_array("class_locations_", self.classes_.shape, kind=int)
        locations = self.class_locations_
        are_locations = np.isin(locations, range(len(FAULT_LOCATIONS)))
        expect(are_locations, "class_locations_", locations, "0, 1, 2 or 3")
        self._check_array("orders_", (len(listed(self.bearing)), 4), "above 0")
        self._check_array("reference_", (len(FAULTS),))
        self._check_array("healthy_speeds_", (None,), "above 0")
        self._check_array("healthy_scores_", self.healthy_speeds_.shape)
        are_sorted = np.diff(self.healthy_scores_) >= 0
        expect(are_sorted, "healthy_scores_", self.healthy_scores_, "ascending")
        self._check_number("limit_")
        if self.conditions_ is not None:
            self._check_part("conditions_")

    def _check_parameters(self):
        check_sampling_rate(self.sampling_rate)
        for name in ("gear_ratio", "slip"):
            check_real(getattr(self, name), name, **ABOVE_0)
        check_real(self.false_alarm_rate, "false_alarm_rate", max_val=1, **ABOVE_0)
        check_real(self.wrong_name_rate, "wrong_name_rate", max_val=0.5, **ABOVE_0)
        check_real(self.speed_tolerance, "speed_tolerance", min_val=0, max_val=0.3)
        if self.speed_range is not None:
            is_pair = np.size(self.speed_range) == 2
            expect(is_pair, "speed_range", self.speed_range, "two speeds")
            low, high = self.speed_range
            check_real(high, "speed_range[1]", **ABOVE_0)
            check_real(low, "speed_range[0]", **ABOVE_0 | {"max_val": high})
        for label, location in (self.locations or {}).items():
            is_location = location in FAULT_LOCATIONS
            expected = f"one of {FAULT_LOCATIONS}"
            expect(is_location, f"locations[{label!r}]", location, expected)

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = False
        # Made for signals of bearings: on arbitrary features it need not separate
        # anything.
        tags.classifier_tags.poor_score = True
        return tags
