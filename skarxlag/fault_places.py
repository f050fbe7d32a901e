"""Names of faults that nobody recorded, from the orders of the bearing."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils import Bunch, check_array

from ._base import SignalEstimator
from ._parallel import map_batches
from ._validation import (
    INNOVATIONS,
    NOT_NEGATIVE,
    POSITIVE,
    Labels,
    Values,
    check_rate,
    check_real,
    remember_parameters,
    uses_fitted,
    validate_innovations,
)
from .bearings import BearingLike, bearing_orders
from .kernels.comb import comb_frequency
from .kernels.fault_orders import (
    NEPER_IN_DB,
    PLACES,
    fault_comb,
    order_contrast,
    squared_envelope_spectrum,
)
from .speeds import LEAST_TURNS, samples_a_turn

HEALTHY = "healthy"
#: Verdict on a row with a comb that fits two places nearly as well.
NOT_IDENTIFIABLE = "not identifiable"
_PLACES = (*PLACES, HEALTHY)
#: Gumbel distribution of the best score of healthy recordings, location and scale in nepers: from
#: ten recordings of three rigs, `python -m benchmarks.fault_orders --null`. The second location is
#: that above the mean scores of the same machine at other speeds.
_HEALTHY_LOCATION, _OTHER_SPEED_LOCATION, _HEALTHY_SCALE = 0.94, 0.11, 0.29
#: Logarithm of speed up to which rows count as rows of the same speed.
_SAME_SPEED = 0.05
#: Rows that this scale counts for when healthy rows of the machine are at hand.
_PRIOR_ROWS = 10
#: Log odds of two places for each neper between their scores: of all faulty recordings, and of
#: those that are named, whose scores lie 1.6 nepers apart in the mean.
_CONFIDENCE, _CONFIDENCE_NAMED, _MEAN_MARGIN = 5.0, 10.0, 1.6
#: Names of conditions that say the place; the names of compound faults match two of them.
_NAMES = {
    "healthy": r"healthy|normal|good|baseline|intact|^ok\d*$|^n\d*$|no.?fault|undamaged",
    "inner": r"inner|inside|^ir|^i\d*$|bpfi",
    "outer": r"outer|outside|^or|^o\d*$|bpfo",
    "ball": r"ball|roller|element|^b\d*$|bsf",
}
#: p-values are above 0.
_LEAST_P = np.finfo(float).tiny
_WORDS = {"inner": "the inner race", "outer": "the outer race", "ball": "a rolling element"}


class FaultOrderClassifier(SignalEstimator, ClassifierMixin, BaseEstimator):
    r"""Classifier that names the place of a bearing fault without recordings of faults.

    A fault of the outer race, the inner race or a rolling element is struck at orders of the shaft
    that follow from the bearing's geometry [1]_. The classifier computes the contrast of the
    envelope spectra of a row over orders, see
    :func:`skarxlag.kernels.fault_orders.order_contrast`, and the score of each place, which is the
    mean contrast at the multiples of its order, see
    :func:`skarxlag.kernels.fault_orders.fault_comb`. The place with the largest score is named if
    the score exceeds a limit; otherwise the row is healthy.

    A row of X is a window of at least three turns of the shaft, and better ten turns and a second:
    a raw signal, or the innovations of one model (``ARXLaguerre(bank=False)``). Its speed is given
    as `rpm`.

    Without `y`, `fit` notes the shape of the rows, and the classes are "ball", "healthy", "inner"
    and "outer". The limit then comes from healthy recordings of other machines: the largest score
    of a healthy recording has a Gumbel distribution with location .94 and scale .29 nepers. The
    stated false-alarm rate holds as far as the machine resembles those.

    With `y`, the classes are its labels. Each label stands for a place. If some rows are healthy,
    their scores are the reference: their mean at each place is subtracted, and the limit is the
    conformal quantile of the largest rest. The stated rate then holds for rows like these, at their
    speeds. At other speeds the limit is at least that of a Gumbel distribution with location .11
    and scale .29, which is how far such rows of other machines lay above their reference. If all
    rows are healthy and their label is a text, the places are added to the classes.

    Parameters
    ----------
    bearing : BearingLike or sequence of BearingLike, default=None
        The bearing, or several bearings on one shaft: names such as "6205", dimensions, or orders,
        see :func:`skarxlag.bearings.bearing_orders`. It is required.
    sampling_rate : float, default=None
        In Hz, above 0. It is required.
    places : mapping of label to str or None, default=None
        Place of each label in `y`: "healthy", "inner", "outer" or "ball". A label that is missing
        gets the place that its name says, such as "IR7" or "outer race". If the name says none, the
        rows of the label decide: the place of the largest mean score, or healthy if it is below the
        limit.
    gear_ratio : float, default=1.0
        Turns of the bearing's shaft in a turn of the shaft whose speed is given, above 0.
    false_alarm_rate : float, default=0.02
        Share in (0, 1) of healthy rows that may be named faulty.
    wrong_name_rate : float, default=0.02
        Share in (0, 0.5) of wrong places among the rows that are named. `verdicts` returns "not
        identifiable" if the two best scores are closer than the margin that this share needs.
    speed_tolerance : float, default=0.1
        Largest logarithm of the true speed over the nominal speed, in [0, 0.3]. It covers slip of
        the elements, too.
    slip : float, default=0.03
        Logarithm of the speed at which .15 nepers are subtracted from the score, above 0. The
        subtraction is proportional to the square of the logarithm.
    speed_range : tuple of two floats or None, default=None
        Lowest and highest speed in revolutions per minute. Without `rpm`, the speed of each row is
        searched in this range, as in :func:`skarxlag.estimate_shaft_speed`. None: `rpm` is
        required.
    n_jobs : int or None, default=None
        Threads that work on rows. Results do not depend on it.

    Attributes
    ----------
    classes_ : ndarray of shape (n_classes,)
        Labels, sorted.
    class_places_ : ndarray of int of shape (n_classes,)
        Place of each class: 0 ball, 1 inner race, 2 outer race, 3 healthy.
    orders_ : ndarray of shape (n_bearings, 4)
        Orders of the cage, the spin of an element, the inner and the outer race.
    limit_ : float
        Largest score of a healthy row, in nepers above `reference_`, at the speeds of the healthy
        rows.
    healthy_speeds_ : ndarray of shape (n_healthy,)
        Speed of each healthy row in revolutions per minute, ascending.
    reference_ : ndarray of shape (3,)
        Mean scores of healthy rows at the ball, the inner and the outer race; 0 without such rows.
    n_healthy_ : int
        Healthy rows in `fit`.
    healthy_scores_ : ndarray of shape (n_healthy,)
        Largest scores of the healthy rows above the reference, ascending.
    tail_scale_ : float
        Scale of the exponential tail above the largest of these.
    n_models_ : int
        1 if rows were innovations, 0 for plain rows.
    window_shape_ : ndarray of int
        Shape of one row.
    n_features_in_ : int
        Number of models, or samples in a plain row.
    feature_names_in_ : ndarray of str
        Column names, when fitted on a table.

    See Also
    --------
    skarxlag.make_fault_order_classifier : The classifier behind a model of the signal.

    References
    ----------
    .. [1] R. B. Randall and J. Antoni (2011), "Rolling element bearing diagnostics - a tutorial",
       Mechanical Systems and Signal Processing 25, 485-520.

    Examples
    --------
    A bearing 6205 at 900 rpm with a fault of the inner race, which is struck 5.415 times a turn,
    with a scatter of 1 %:

    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> X = rng.normal(size=(2, 20_000))
    >>> intervals = 20_000 / (15 * 5.415) * rng.normal(1, 0.01, size=80)
    >>> X[1, np.cumsum(intervals).astype(int)] += 10
    >>> classifier = FaultOrderClassifier(bearing="6205", sampling_rate=20_000).fit(X)
    >>> classifier.predict(X, rpm=[900, 900])
    array(['healthy', 'inner'], dtype='<U7')
    """

    classes_: NDArray[Any]
    class_places_: NDArray[Any]
    orders_: NDArray[Any]
    limit_: float
    reference_: NDArray[Any]
    healthy_scores_: NDArray[Any]
    tail_scale_: float
    healthy_speeds_: NDArray[Any]
    n_models_: int
    n_healthy_: int

    _state = INNOVATIONS | {
        "classes_": Labels(),
        "class_places_": Values(
            lambda e: (len(e.classes_),),
            (lambda p, e: (p >= 0) & (p < len(_PLACES)), "indices from 0 to 3"),
            "i",
        ),
        "orders_": Values(
            lambda e: (len(e._bearings()), 4), (lambda o, e: (o > 0) & (o < 1e6), "in (0, 1e6)")
        ),
        "reference_": Values((len(PLACES),)),
        "n_healthy_": Values((), NOT_NEGATIVE, "i"),
        "healthy_scores_": Values(
            lambda e: (e.n_healthy_,), (lambda s, e: np.all(np.diff(s) >= 0), "ascending")
        ),
        "healthy_speeds_": Values(lambda e: (e.n_healthy_,), POSITIVE),
        "limit_": Values(),
        "tail_scale_": Values((), POSITIVE),
    }

    #: Metadata routing passes `rpm` without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"rpm": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__predict_proba: ClassVar = {"rpm": True}
    __metadata_request__predict_log_proba: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}
    __metadata_request__score: ClassVar = {"rpm": True}

    def __init__(
        self,
        *,
        bearing: BearingLike | Sequence[BearingLike] | None = None,
        sampling_rate: float | None = None,
        places: Mapping[Any, str] | None = None,
        gear_ratio: float = 1.0,
        false_alarm_rate: float = 0.02,
        wrong_name_rate: float = 0.02,
        speed_tolerance: float = 0.1,
        slip: float = 0.03,
        speed_range: tuple[float, float] | None = None,
        n_jobs: int | None = None,
    ) -> None:
        self.bearing = bearing
        self.sampling_rate = sampling_rate
        self.places = places
        self.gear_ratio = gear_ratio
        self.false_alarm_rate = false_alarm_rate
        self.wrong_name_rate = wrong_name_rate
        self.speed_tolerance = speed_tolerance
        self.slip = slip
        self.speed_range = speed_range
        self.n_jobs = n_jobs

    def fit(self, X: ArrayLike, y: ArrayLike | None = None, rpm: ArrayLike | None = None) -> Self:
        """Note the shape of rows; calibrate the limit if some of them are healthy.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows, or the innovations of one model.
        y : array-like of shape (n_rows,) or None, default=None
            Condition of each row.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed in revolutions per minute. It is needed with `y`.

        Returns
        -------
        FaultOrderClassifier
            The fitted classifier.

        Raises
        ------
        ValueError
            If a parameter is missing or out of its range, a speed is not above 0, or a row has
            less than three turns.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        if X.shape[1] != 1:
            raise ValueError(
                f"X has the innovations of {X.shape[1]} models, expected 1: ARXLaguerre(bank=False)"
            )
        self.orders_ = self._orders()
        self._calibrate(np.empty((0, len(PLACES))), np.empty(0))
        if y is None:
            self.classes_, self.class_places_ = np.unique(_PLACES, return_index=True)
        else:
            found = self._match(X, rpm)
            scores = found.scores
            self.classes_, target = np.unique(y, return_inverse=True)
            self.class_places_ = np.array(
                [self._place(label, scores[target == c]) for c, label in enumerate(self.classes_)]
            )
            healthy = self.class_places_[target] == _PLACES.index(HEALTHY)
            self._calibrate(scores[healthy], found.rpm[healthy])
            if self.classes_.dtype.kind in "UO" and self.class_places_.tolist() == [3]:
                names = [*PLACES, self.classes_[0]]
                self.classes_, self.class_places_ = np.unique(names, return_index=True)
        remember_parameters(self)
        return self

    def _orders(self):
        found = [bearing_orders(each, self.gear_ratio) for each in self._bearings()]
        return np.array([[o[key] for key in ("cage", "spin", "inner", "outer")] for o in found])

    def _bearings(self):
        """All bearings, also if one is given without a sequence around it."""
        if isinstance(self.bearing, str | Mapping) or not isinstance(self.bearing, Sequence):
            return [self.bearing]
        if len(self.bearing) == 0:
            raise ValueError("bearing is an empty sequence, expected at least one bearing.")
        return list(self.bearing)

    def _place(self, label, scores):
        """Place that stands for a label."""
        if self.places is not None and label in self.places:
            return _PLACES.index(self.places[label])
        named = place_of_label(label)
        if named is not None:
            return _PLACES.index(named)
        mean = scores.mean(axis=0)
        return int(mean.argmax()) if mean.max() > self.limit_ else _PLACES.index(HEALTHY)

    def _calibrate(self, scores, speeds):
        """Reference and limit from the scores and speeds of healthy rows."""
        self.healthy_speeds_ = np.sort(np.where(np.isnan(speeds), 1.0, speeds))
        n_rows = self.n_healthy_ = len(scores)
        self.reference_ = scores.mean(axis=0) if n_rows else np.zeros(len(PLACES))
        # A row is nearer to a mean that it is a part of.
        rest = (scores - self.reference_).max(axis=1, initial=-np.inf) * n_rows / max(n_rows - 1, 1)
        self.healthy_scores_ = np.sort(rest)
        scale = np.sqrt(6 * np.var(rest)) / np.pi if n_rows else 0.0
        weighted = n_rows * scale**2 + _PRIOR_ROWS * _HEALTHY_SCALE**2
        self.tail_scale_ = float(np.sqrt(weighted / (n_rows + _PRIOR_ROWS)))
        self.limit_ = float(self._limit_at(self.false_alarm_rate))

    def _limit_at(self, rate):
        """Score whose p-value is the rate, at the speeds of the healthy rows."""
        n_rows = self.n_healthy_
        if n_rows == 0:
            return _gumbel_quantile(rate, _HEALTHY_LOCATION)
        n_above = int(rate * (n_rows + 1) + 1e-9)
        if n_above >= 1:
            return self.healthy_scores_[-min(n_above, n_rows)]
        return self.healthy_scores_[-1] - self.tail_scale_ * np.log(rate * (n_rows + 1))

    def _is_far(self, rpm):
        """Whether the speed of each row is none of the healthy rows' speeds."""
        distances = np.abs(np.log(rpm[:, np.newaxis] / self.healthy_speeds_))
        return (self.n_healthy_ > 0) & (distances.min(axis=1, initial=np.inf) > _SAME_SPEED)

    def _limits(self, rpm):
        """Limit of each row."""
        elsewhere = _gumbel_quantile(self.false_alarm_rate, _OTHER_SPEED_LOCATION)
        return np.where(self._is_far(rpm), max(self.limit_, elsewhere), self.limit_)

    @uses_fitted
    def match(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute the scores of all places, and the factors on the speed that fit best.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed; None only with `speed_range`.

        Returns
        -------
        Bunch
            ``scores``, in nepers, ``factors``, true over nominal speed, and ``bearings``, the index
            of the bearing that fits best, all of shape (n_rows, 3) for ball, inner and outer race;
            ``contrasts`` of shape (n_rows, 4001), at the orders 0, .01, ... 40; and ``rpm``, the
            mean speed of each row.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        return self._match(X, rpm)

    def _match(self, X, rpm):
        turns = self._turns(X, rpm)

        def of_row(batch):
            samples, turn = X[batch.start, 0], turns[batch.start]
            if np.any(np.isnan(turn)):
                nothing = np.zeros(len(PLACES))
                return nothing, nothing + 1, nothing.astype(int), order_contrast(samples, 1.0, 1.0)
            contrast = order_contrast(samples, turn, self.sampling_rate)
            combs = [
                fault_comb(contrast, orders, self.speed_tolerance, self.slip)
                for orders in self.orders_
            ]
            scores = np.stack([comb.scores for comb in combs])
            best = scores.argmax(axis=0)
            factors = np.stack([comb.factors for comb in combs])
            place = np.arange(len(PLACES))
            return scores[best, place], factors[best, place], best, contrast

        found = map_batches(of_row, len(X), self.n_jobs, batch_size=1)
        names = ("scores", "factors", "bearings", "contrasts")
        parts = dict(zip(names, map(np.stack, zip(*found, strict=True)), strict=True))
        mean = turns if turns.ndim == 1 else turns.mean(axis=1)
        return Bunch(**parts, rpm=60 * self.sampling_rate / mean)

    def _turns(self, X, rpm):
        """Samples in a turn; NaN for rows that are too short for a search of the speed."""
        if rpm is not None:
            return samples_a_turn(rpm, self.sampling_rate, len(X), X.shape[-1])
        if self.speed_range is None:
            raise ValueError(
                "rpm is None, expected the speed of each row, or speed_range, in which the speed "
                "is searched."
            )
        low, high = self.speed_range
        turn = 60 * self.sampling_rate / np.sqrt(low * high)
        if X.shape[-1] < LEAST_TURNS * 60 * self.sampling_rate / low:
            return np.full(len(X), np.nan)
        tolerance = np.log(high / low) / 2
        return 1 / np.array([comb_frequency(row[0], 1 / turn, tolerance, 40) for row in X])

    @uses_fitted
    def decision_function(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the scores of the classes; the highest is the verdict.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes), or (n_rows,) for two classes
            Nepers above the reference; the limit for healthy. For two classes the second's score
            less the first's.
        """
        return _of_two(self._scores(self.match(X, rpm)))

    @uses_fitted
    def diagnose(self, X: ArrayLike, rpm: ArrayLike | None = None) -> Bunch:
        """Compute all that is known of each row from one match.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        Bunch
            ``score``, ``probability``, ``verdict``, ``alarm``, ``p_value``, ``named`` and
            ``evidence``: the results of `decision_function`, `predict_proba`, `predict`, `detect`,
            `p_values`, `verdicts` and `evidence`.
        """
        found = self.match(X, rpm)
        scores = self._scores(found)
        return Bunch(
            score=_of_two(scores),
            probability=np.exp(log_softmax(_CONFIDENCE * scores, axis=1)),
            verdict=self.classes_[scores.argmax(axis=1)],
            alarm=self._exceeds(found),
            p_value=self._p_values(found),
            named=self._verdicts(found),
            evidence=np.array(self._sentences(found), dtype=object),
        )

    def _scores(self, found):
        """Scores of the classes from those of the places."""
        limits = self._limits(found.rpm)[:, np.newaxis]
        return np.hstack([found.scores - self.reference_, limits])[:, self.class_places_]

    @uses_fitted
    def predict(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Return the class of each row.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Classes.
        """
        best = self._scores(self.match(X, rpm)).argmax(axis=1)
        return self.classes_[best]

    @uses_fitted
    def predict_proba(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the probability of each class.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Softmax of five times the scores, a factor that was fitted on recordings of six rigs.
            Rows sum to 1.
        """
        return np.exp(self.predict_log_proba(X, rpm))

    @uses_fitted
    def predict_log_proba(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the logarithm of the probability of each class.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Natural logarithms.
        """
        return log_softmax(_CONFIDENCE * self._scores(self.match(X, rpm)), axis=1)

    @uses_fitted
    def p_values(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Compute the probability that a healthy row has a comb as strong.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of shape (n_rows,)
            In (0, 1]. With healthy rows in `fit`: the share of rows with a larger score, and an
            exponential tail above all of them.
        """
        return self._p_values(self.match(X, rpm))

    def _p_values(self, found):
        best = (found.scores - self.reference_).max(axis=1)
        n_rows = self.n_healthy_
        if n_rows == 0:
            return _gumbel_p_value(best, _HEALTHY_LOCATION)
        n_above = n_rows - np.searchsorted(self.healthy_scores_, best)
        beyond = np.maximum(best - self.healthy_scores_[-1], 0) / self.tail_scale_
        p_values = np.maximum(np.exp(-beyond) * (1 + n_above) / (1 + n_rows), _LEAST_P)
        elsewhere = _gumbel_p_value(best, _OTHER_SPEED_LOCATION)
        return np.where(self._is_far(found.rpm), np.maximum(p_values, elsewhere), p_values)

    @uses_fitted
    def detect(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Return whether the best score of each row exceeds the limit.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of bool of shape (n_rows,)
            True for a comb that healthy rows exceed at the stated false-alarm rate only.
        """
        return self._exceeds(self.match(X, rpm))

    def _exceeds(self, found):
        return (found.scores - self.reference_).max(axis=1) > self._limits(found.rpm)

    @uses_fitted
    def verdicts(self, X: ArrayLike, rpm: ArrayLike | None = None) -> NDArray[Any]:
        """Return the class of each row, or "not identifiable".

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        ndarray of object of shape (n_rows,)
            What `predict` returns; "not identifiable" if a comb exceeds the limit, but the second
            place is too close, see `wrong_name_rate`.
        """
        return self._verdicts(self.match(X, rpm))

    def _verdicts(self, found):
        verdict = self.classes_[self._scores(found).argmax(axis=1)].astype(object)
        ordered = np.sort(found.scores - self.reference_, axis=1)
        close = ordered[:, -1] - ordered[:, -2] < least_margin(self.wrong_name_rate)
        verdict[self._exceeds(found) & close] = NOT_IDENTIFIABLE
        return verdict

    @uses_fitted
    def evidence(self, X: ArrayLike, rpm: ArrayLike | None = None) -> list[str]:
        """Describe the best comb of each row in one sentence.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_samples) or (n_rows, 1, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed, as in `match`.

        Returns
        -------
        list of str
            Order and place of the comb, its contrast in dB, and the difference from the nominal
            order, which slip and an error of the speed cause together.
        """
        return self._sentences(self.match(X, rpm))

    def _sentences(self, found):
        rows = zip(
            self._verdicts(found),
            self._limits(found.rpm),
            found.scores,
            found.factors,
            found.bearings,
            strict=True,
        )
        return [self._sentence(*row) for row in rows]

    def _sentence(self, verdict, limit, scores, factors, bearings):
        above = scores - self.reference_
        second, best = np.argsort(above, kind="stable")[-2:]
        orders = self.orders_[bearings[best]] * [1, 2, 1, 1]
        order = orders[1 + best] * factors[best]
        where = f"{_WORDS[PLACES[best]]}{self._name(bearings[best])}"
        size = f"{NEPER_IN_DB * scores[best]:.0f} dB"
        if above[best] <= limit:
            limit = NEPER_IN_DB * (limit + self.reference_[best])
            return (
                f"no comb exceeds its limit; the strongest is that of {where} with {size}, limit "
                f"{limit:.0f} dB"
            )
        if verdict == NOT_IDENTIFIABLE:
            return f"impacts of {size} fit {where} and {_WORDS[PLACES[second]]} nearly as well"
        return (
            f"impacts at {order:.2f} orders, {where}, {size}, {100 * (factors[best] - 1):+.1f} % "
            "from the nominal order"
        )

    def _name(self, index):
        given = self._bearings()
        if isinstance(given[index], str):
            return f" of {given[index]}"
        return f" of bearing {index + 1}" if len(given) > 1 else ""

    def _answers(self):
        healthy = self.classes_[self.class_places_ == _PLACES.index(HEALTHY)].tolist()
        return {
            "healthy": healthy[0] if healthy else None,
            "alarm": True,
            "stated_rate": self.false_alarm_rate,
            "takes_rpm": True,
            "needs_rpm": self.speed_range is None,
            "is_stretch": True,
            "sampling_rate": self.sampling_rate,
        }

    def _check_parameters(self):
        for name in ("bearing", "sampling_rate"):
            if getattr(self, name) is None:
                raise ValueError(f"{name} is None, expected a value: it has no default.")
        above = {"min_val": 0, "include_boundaries": "neither"}
        check_real(self.sampling_rate, "sampling_rate", **above)
        check_real(self.gear_ratio, "gear_ratio", **above)
        check_rate(self.false_alarm_rate, "false_alarm_rate")
        check_real(self.wrong_name_rate, "wrong_name_rate", max_val=0.5, **above)
        check_real(self.speed_tolerance, "speed_tolerance", min_val=0, max_val=0.3)
        check_real(self.slip, "slip", **above)
        if self.speed_range is not None:
            ends = np.asarray(self.speed_range, dtype=np.float64)
            if ends.shape != (2,) or not 0 < ends[0] < ends[1] < np.inf:
                raise ValueError(
                    f"speed_range={self.speed_range!r}, expected two speeds in revolutions per "
                    "minute, the lower one first."
                )
        for label, place in (self.places or {}).items():
            if place not in _PLACES:
                raise ValueError(
                    f"places[{label!r}] is {place!r}, expected one of {', '.join(_PLACES)}."
                )

    def _check_relations(self):
        if self.n_models_ > 1:
            raise ValueError(f"n_models_ == {self.n_models_}, expected 0 or 1.")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = False
        # Made for signals of bearings: on arbitrary features it need not separate anything.
        tags.classifier_tags.poor_score = True
        return tags


def _gumbel_quantile(rate, location):
    return location - _HEALTHY_SCALE * np.log(-np.log1p(-rate))


def _gumbel_p_value(score, location):
    above = -np.expm1(-np.exp((location - score) / _HEALTHY_SCALE))
    return np.maximum(above, _LEAST_P)


def least_margin(wrong_name_rate: float) -> float:
    r"""Compute the difference of two scores above which the better one may be named.

    Margins m of rows that are named have an exponential distribution with mean :math:`\bar m`. The
    name is wrong with the probability :math:`1 / (1 + e^{k m})`. The share of wrong names with a
    margin of at least :math:`m_0` is then at most
    :math:`\ln(1 + e^{-k m_0}) / (k \bar m)`, which is solved for :math:`m_0`.

    Parameters
    ----------
    wrong_name_rate : float
        Share of wrong names.

    Returns
    -------
    float
        In nepers, at least 0.

    Examples
    --------
    >>> [round(least_margin(rate), 2) for rate in (0.02, 0.002)]
    [0.1, 0.34]
    """
    share = np.expm1(wrong_name_rate * _CONFIDENCE_NAMED * _MEAN_MARGIN)
    return max(float(-np.log(share) / _CONFIDENCE_NAMED), 0.0)


def place_of_label(label: Any) -> str | None:
    """Return the place that the name of a condition says.

    Parameters
    ----------
    label : object
        A label.

    Returns
    -------
    str or None
        "healthy", "inner", "outer" or "ball"; None for a number, a compound fault, or a name that
        says none of them.

    Examples
    --------
    >>> [place_of_label(name) for name in ("OR5", "Inner race", "B", "Normal", "IR-ball", 3)]
    ['outer', 'inner', 'ball', 'healthy', None, None]
    """
    if not isinstance(label, str):
        return None
    found = [place for place, names in _NAMES.items() if re.search(names, label.strip().lower())]
    return found[0] if len(found) == 1 else None


def envelope_spectrum(
    signal: ArrayLike,
    sampling_rate: float,
    *,
    band: tuple[float, float] | None = None,
    prewhiten: bool = True,
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Compute the spectrum of the squared envelope of a signal.

    Parameters
    ----------
    signal : array-like of shape (n_samples,)
        At least 8 samples, in any unit.
    sampling_rate : float
        In Hz, above 0.
    band : tuple of two floats or None, default=None
        Lowest and highest frequency in Hz that the envelope is taken of. None: all frequencies.
    prewhiten : bool, default=True
        Whether all frequencies get the same magnitude first, which is called cepstrum prewhitening.
        It removes the lines of gears and of the shaft, and the loudness of resonances.

    Returns
    -------
    frequencies : ndarray of shape (n_frequencies,)
        From 0 to half the sampling rate in Hz. Divided by the shaft's frequency, they are orders.
    power : ndarray of shape (n_frequencies,)
        Power of the squared envelope less its mean, relative to the mean squared.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(0)
    >>> signal = 0.1 * rng.normal(size=20_000)
    >>> signal[np.cumsum(rng.normal(400, 1, size=49)).astype(int)] += 1  # 50 impacts a second
    >>> frequencies, power = envelope_spectrum(signal, 20_000)
    >>> float(frequencies[power[:100].argmax()])
    50.0
    """
    check_real(sampling_rate, "sampling_rate", min_val=0, include_boundaries="neither")
    signal = check_array(
        signal, dtype=np.float64, ensure_2d=False, ensure_min_samples=8, input_name="signal"
    )
    if signal.ndim != 1:
        raise ValueError(f"signal has shape {signal.shape}, expected one axis.")
    if band is not None and not 0 <= band[0] < band[1] <= sampling_rate / 2:
        raise ValueError(
            f"band={band!r}, expected two frequencies from 0 to {sampling_rate / 2:g} Hz, the "
            "lower one first."
        )
    part = (0.0, 0.5) if band is None else (band[0] / sampling_rate, band[1] / sampling_rate)
    power = squared_envelope_spectrum(signal, part, prewhiten)
    return np.arange(len(power)) * sampling_rate / len(signal), power


def _of_two(scores):
    """Scores of the classes; of two classes the second's less the first's."""
    return scores[:, 1] - scores[:, 0] if scores.shape[1] == 2 else scores
