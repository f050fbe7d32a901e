"""Classifier that names faults without recordings of them, by the orders of the bearing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils import Bunch

from ._base import SignalEstimator
from ._state import INNOVATIONS, Labels, Values, remember_parameters, uses_fitted
from ._validation import check_rate, check_real, of_one_model, validate_innovations
from .bearings import BearingLike, bearing_orders
from .envelope_spectra import match_faults, turns_of_rows
from .fault_places import (
    CONFIDENCE,
    FAULTS,
    HEALTHY,
    HEALTHY_LOCATION,
    HEALTHY_SCALE,
    LEAST_P,
    NOT_IDENTIFIABLE,
    OTHER_SPEED_LOCATION,
    PLACES,
    gumbel_p_value,
    gumbel_quantile,
    least_margin,
    place_of_label,
)
from .kernels.fault_orders import NEPER_IN_DB

#: Logarithm of speed up to which rows count as rows of the same speed.
_SAME_SPEED = 0.05
#: Rows that `HEALTHY_SCALE` counts for when healthy rows of the machine are at hand.
_PRIOR_ROWS = 10
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
        Share in (0, 0.5) of wrong places among the rows that are named. `diagnose` names a row "not
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

    _state = INNOVATIONS | {
        "classes_": Labels(),
        "class_places_": Values(
            lambda e: (len(e.classes_),),
            (lambda p, e: (p >= 0) & (p < len(PLACES)), "indices from 0 to 3"),
            "i",
        ),
        "orders_": Values(
            lambda e: (len(e._bearings()), 4), (lambda o, e: (o > 0) & (o < 1e6), "in (0, 1e6)")
        ),
        "reference_": Values((len(FAULTS),)),
        "healthy_speeds_": Values((None,), "above 0"),
        "healthy_scores_": Values(
            lambda e: e.healthy_speeds_.shape, (lambda s, e: np.all(np.diff(s) >= 0), "ascending")
        ),
        "limit_": Values(),
        "tail_scale_": Values((), "above 0"),
    }

    #: Metadata routing passes `rpm` without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {"rpm": True}
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__predict_proba: ClassVar = {"rpm": True}
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
        of_one_model(X)
        orders = [bearing_orders(each, self.gear_ratio) for each in self._bearings()]
        self.orders_ = np.array(
            [[of[key] for key in ("cage", "spin", "inner", "outer")] for of in orders]
        )
        self._calibrate(np.empty((0, len(FAULTS))), np.empty(0))
        if y is None:
            self._name_classes(PLACES)
        else:
            self._learn(self._match(X, rpm), y)
        remember_parameters(self)
        return self

    def _name_classes(self, names):
        """Take these classes for the places."""
        self.classes_, self.class_places_ = np.unique(names, return_index=True)

    def _learn(self, found, y):
        """Learn places of labels, and limits of healthy rows."""
        self.classes_, target = np.unique(y, return_inverse=True)
        self.class_places_ = np.array(
            [self._place(label, found.scores[target == c]) for c, label in enumerate(self.classes_)]
        )
        healthy = self.class_places_[target] == PLACES.index(HEALTHY)
        self._calibrate(found.scores[healthy], found.rpm[healthy])
        if self.classes_.dtype.kind in "UO" and healthy.all() and len(self.classes_) == 1:
            self._name_classes([*FAULTS, self.classes_[0]])

    def _bearings(self):
        """All bearings, also if one is given without a sequence around it."""
        if isinstance(self.bearing, str | Mapping) or not isinstance(self.bearing, Sequence):
            return [self.bearing]
        if len(self.bearing) == 0:
            raise ValueError("bearing is an empty sequence, expected at least one bearing.")
        return list(self.bearing)

    def _place(self, label, scores):
        """Index of the place that a label stands for."""
        named = (self.places or {}).get(label, place_of_label(label))
        if named is not None:
            return PLACES.index(named)
        mean = scores.mean(axis=0)
        return int(mean.argmax()) if mean.max() > self.limit_ else PLACES.index(HEALTHY)

    def _calibrate(self, scores, speeds):
        """Reference and limit from the scores and speeds of healthy rows."""
        n_rows = len(scores)
        self.healthy_speeds_ = np.sort(np.where(np.isnan(speeds), 1.0, speeds))
        self.reference_ = scores.mean(axis=0) if n_rows else np.zeros(len(FAULTS))
        # A row is nearer to a mean that it is a part of.
        rest = (scores - self.reference_).max(axis=1, initial=-np.inf) * n_rows / max(n_rows - 1, 1)
        self.healthy_scores_ = np.sort(rest)
        own = 6 * np.var(rest) / np.pi**2 if n_rows else 0.0
        weighted = n_rows * own + _PRIOR_ROWS * HEALTHY_SCALE**2
        self.tail_scale_ = float(np.sqrt(weighted / (n_rows + _PRIOR_ROWS)))
        self.limit_ = float(self._limit_at(self.false_alarm_rate))

    def _limit_at(self, rate):
        """Score whose p-value is the rate, at the speeds of the healthy rows."""
        n_rows = len(self.healthy_scores_)
        if n_rows == 0:
            return gumbel_quantile(rate, HEALTHY_LOCATION)
        n_above = int(rate * (n_rows + 1) + 1e-9)
        if n_above >= 1:
            return self.healthy_scores_[-min(n_above, n_rows)]
        return self.healthy_scores_[-1] - self.tail_scale_ * np.log(rate * (n_rows + 1))

    def _is_far(self, rpm):
        """Whether no healthy row had about the speed of each row."""
        if len(self.healthy_speeds_) == 0:
            return np.zeros(len(rpm), dtype=bool)
        distances = np.abs(np.log(rpm[:, np.newaxis] / self.healthy_speeds_))
        return distances.min(axis=1) > _SAME_SPEED

    def _limits(self, rpm):
        """Limit of each row."""
        elsewhere = gumbel_quantile(self.false_alarm_rate, OTHER_SPEED_LOCATION)
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
        rows, rate = X[:, 0], self.sampling_rate
        turns = turns_of_rows(rows, rate, rpm, self.speed_range)
        return match_faults(
            rows, turns, rate, self.orders_, self.speed_tolerance, self.slip, self.n_jobs
        )

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
            ``score``, ``probability``, ``verdict``, ``alarm`` and ``p_value``: the results of
            `decision_function`, `predict_proba`, `predict`, `detect` and `p_values`. ``named``: the
            verdict, or "not identifiable" if a comb exceeds the limit, but the second place is too
            close, see `wrong_name_rate`. ``evidence``: a sentence with the order and the place of
            the best comb, its contrast in dB, and the difference from the nominal order, which slip
            and an error of the speed cause together.
        """
        return self._judge(self.match(X, rpm))

    def _judge(self, found):
        """Judge matched rows."""
        above, limits = found.scores - self.reference_, self._limits(found.rpm)
        scores = np.column_stack([above, limits])[:, self.class_places_]
        verdict = self.classes_[scores.argmax(axis=1)]
        alarm = above.max(axis=1) > limits
        second, best = np.sort(above, axis=1)[:, -2:].T
        named = verdict.astype(object)
        named[alarm & (best - second < least_margin(self.wrong_name_rate))] = NOT_IDENTIFIABLE
        rows = zip(found.scores, found.factors, found.bearings, limits, named, strict=True)
        return Bunch(
            score=scores[:, 1] - scores[:, 0] if scores.shape[1] == 2 else scores,
            probability=np.exp(log_softmax(CONFIDENCE * scores, axis=1)),
            verdict=verdict,
            alarm=alarm,
            p_value=self._p_values(best, found.rpm),
            named=named,
            evidence=np.array([self._sentence(*row) for row in rows], dtype=object),
        )

    def _p_values(self, best, rpm):
        """Share of healthy rows with a larger best score, with an exponential tail above all."""
        n_rows = len(self.healthy_scores_)
        if n_rows == 0:
            return gumbel_p_value(best, HEALTHY_LOCATION)
        n_above = n_rows - np.searchsorted(self.healthy_scores_, best)
        beyond = np.maximum(best - self.healthy_scores_[-1], 0) / self.tail_scale_
        p_values = np.maximum(np.exp(-beyond) * (1 + n_above) / (1 + n_rows), LEAST_P)
        elsewhere = gumbel_p_value(best, OTHER_SPEED_LOCATION)
        return np.where(self._is_far(rpm), np.maximum(p_values, elsewhere), p_values)

    def _sentence(self, scores, factors, bearings, limit, named):
        above = scores - self.reference_
        second, best = np.argsort(above, kind="stable")[-2:]
        bearing, factor = bearings[best], factors[best]
        where, size = _WORDS[FAULTS[best]], f"{NEPER_IN_DB * scores[best]:.0f} dB"
        given = self._bearings()
        if isinstance(given[bearing], str):
            where += f" of {given[bearing]}"
        elif len(given) > 1:
            where += f" of bearing {bearing + 1}"
        if above[best] <= limit:
            limit = NEPER_IN_DB * (limit + self.reference_[best])
            return (
                f"no comb exceeds its limit; the strongest is that of {where} with {size}, limit "
                f"{limit:.0f} dB"
            )
        if named == NOT_IDENTIFIABLE:
            return f"impacts of {size} fit {where} and {_WORDS[FAULTS[second]]} nearly as well"
        order = (self.orders_[bearing] * [1, 2, 1, 1])[1 + best] * factor
        return (
            f"impacts at {order:.2f} orders, {where}, {size}, {100 * (factor - 1):+.1f} % from the "
            "nominal order"
        )

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
        return self.diagnose(X, rpm).verdict

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
        return self.diagnose(X, rpm).probability

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
        return self.diagnose(X, rpm).score

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
        return self.diagnose(X, rpm).alarm

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
        return self.diagnose(X, rpm).p_value

    def _answers(self):
        healthy = self.classes_[self.class_places_ == PLACES.index(HEALTHY)].tolist()
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
            if place not in PLACES:
                raise ValueError(
                    f"places[{label!r}] is {place!r}, expected one of {', '.join(PLACES)}."
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
