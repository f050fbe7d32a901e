"""Base of the classifiers of conditions, which learn from signals and their specimens."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils import Bunch
from sklearn.utils.metaestimators import available_if

from ..core.base import SignalEstimator
from ..core.capabilities import offers
from ..core.state import uses_fitted
from ..core.validation import validate_innovations


class SignalClassifier(SignalEstimator, ClassifierMixin, BaseEstimator):
    """Classifier that takes verdicts, probabilities and scores from `diagnose`.

    A subclass sets its fitted attributes in `_learn`. It returns the results of
    `diagnose` from `_diagnosed`, those of `join` from `_joined`, and the estimator
    whose spectra adapt from `_adaptive_part`.
    """

    #: Metadata routing passes these without `set_fit_request` and its siblings.
    __metadata_request__fit: ClassVar = {
        "rpm": True,
        "sample_weight": True,
        "specimen": True,
    }
    __metadata_request__predict: ClassVar = {"rpm": True}
    __metadata_request__predict_proba: ClassVar = {"rpm": True}
    __metadata_request__predict_log_proba: ClassVar = {"rpm": True}
    __metadata_request__decision_function: ClassVar = {"rpm": True}
    __metadata_request__score: ClassVar = {"rpm": True, "sample_weight": True}

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike | None = None,
        rpm: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
        specimen: ArrayLike | None = None,
    ) -> Self:
        """Learn conditions and limits from labelled rows.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Innovations or plain rows. `FaultOrderClassifier` takes those of one model.
        y : array-like of shape (n_rows,) or None, default=None
            Condition of each row. None only for `FaultOrderClassifier`, which then
            names the locations of faults.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Nominal speed of each row in revolutions per minute. None: the speed is not
            known. `FaultOrderClassifier` needs it with `y`, unless it learns
            `conditions` or searches the speed.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            How many rows each one stands for, at least 0; combs count the next integer.
            None: one each.
        specimen : array-like of shape (n_rows,) or None, default=None
            Identifier of the specimen, such as the bearing, of each row. None: each
            condition is one specimen.

        Returns
        -------
        classifier
            The fitted classifier.

        Raises
        ------
        ValueError
            If a parameter is missing or out of its range, a weight is negative, a speed
            is not above 0, a row has less revolutions than its orders need, a stated
            healthy condition is not in `y`, or `specimen` does not have an identifier
            for each row.
        """
        X, y = validate_innovations(self, X, y, reset=True)
        self._check_parameters()
        self._learn(X, y, rpm, sample_weight, specimen)
        return self

    @uses_fitted
    def diagnose(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> Bunch:
        """Compute all that is known of each row from one set of measures.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Rows.
        rpm : float, array-like of shape (n_rows,) or (n_rows, n_samples), default=None
            Their nominal speeds, as in `fit`. None: not known; a `FaultOrderClassifier`
            without `conditions` needs them, or searches the speed.
        **params
            ``bearing``, only for `FaultOrderClassifier`: the bearing of all rows if
            they are of another machine, by name, dimensions or orders. The limits are
            then those of other machines. None: that of `fit`.

        Returns
        -------
        Bunch
            ``verdict``, ``probability`` and ``score``: the results of `predict`,
            `predict_proba` and `decision_function`. ``alarm``, if there is a healthy
            condition, or combs decide alone: whether healthy rows deviate as much at
            the stated false-alarm rate only.

            With learned conditions also ``levels``, the residuals of shape (n_rows,
            n_classes); ``log_probability`` of shape (n_rows, n_classes + 1), that of
            the conditions and, in the last column, of an unknown one; ``recorded``, the
            probability of a recorded specimen; and ``row_evidence``, of which `join`
            takes the mean over the rows of a recording.

            `FaultOrderClassifier` adds ``has_comb``, whether the comb of a fault
            exceeds its limit; ``comb_limit``, that limit in nepers; ``p_value``, the
            probability that a healthy row has a comb as strong; ``rpm``, as its `match`
            returns it; ``comb_scores``, its ``scores``; and ``evidence``, a sentence with the
            order and the location of the best comb, its contrast in dB, and the
            difference from the nominal order. With `conditions`, ``comb`` is the
            probability of a fault by combs alone, NaN for rows whose combs are not
            used. Without, ``named`` is the verdict; or "not identifiable" if a comb
            exceeds the limit, but the second location is closer than .27 nepers; or "no
            fault pattern found" if no comb exceeds its limit and `fit` had no healthy
            rows. And ``refusal`` is empty, or why a row has no verdict but equal
            probabilities: its speed is not plausible, or it has less than two
            revolutions.
        """
        X, _ = validate_innovations(self, X, reset=False, any_length=True)
        return self._diagnosed(X, rpm, **params)

    @uses_fitted
    def join(self, evidence: ArrayLike, n_rows: ArrayLike = 1.0) -> Bunch:
        """Diagnose recordings by the mean evidence of their rows.

        Beside spectra, the log probabilities of locations by combs count as often as
        the effective number of rows (`skarxlag.kernels.evidence.effective_number`). If
        combs decide alone, their mean scores do, which scatter less than those of a row.

        Parameters
        ----------
        evidence : array-like of shape (n_recordings, n_values)
            Means of ``row_evidence``, which `diagnose` returns. With learned
            conditions: natural logarithms of the residuals of each class, followed by
            log probabilities of combs, if there is a bearing. By combs alone: their
            scores, the speed, and the number of revolutions.
        n_rows : float or array-like of shape (n_recordings,), default=1.0
            Number of rows, or the sum of their weights, above 0.

        Returns
        -------
        Bunch
            ``log_probability``, ``probability``, ``verdict``, ``score`` and
            ``recorded``, as `diagnose` returns them.
        """
        return self._joined(np.asarray(evidence), np.asarray(n_rows))

    @available_if(lambda classifier: offers(classifier._adaptive_part(), "adapt"))
    def adapt(self, X: ArrayLike, y: ArrayLike, rpm: ArrayLike | None = None) -> Self:
        """Adapt the spectra of the conditions to rows of a new speed.

        Orders of a bearing are the same at every speed.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_models, n_samples) or (n_rows, n_samples)
            Rows at the new speed.
        y : array-like of shape (n_rows,)
            Their conditions, among `classes_`. Usually all rows are healthy.
        rpm : float, array-like of shape (n_rows,), default=None
            The new speed, as in `fit`.

        Returns
        -------
        classifier
            This classifier, for use at the new speed.
        """
        X, y = validate_innovations(self, X, y, reset=False, any_length=True)
        self._adaptive_part().adapt(X, y, **({} if rpm is None else {"rpm": rpm}))
        return self

    def predict(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Return the condition of each row.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Conditions.
        """
        return self.diagnose(X, rpm, **params).verdict

    def predict_proba(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the probability of each condition.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Rows sum to 1. The probability of an unknown condition is divided equally
            among the conditions. If the verdict is not the most probable condition, the
            probabilities are changed as little as makes it the largest.
        """
        return self.diagnose(X, rpm, **params).probability

    def predict_log_proba(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the logarithm of the probability of each condition.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Natural logarithms.
        """
        return np.log(self.predict_proba(X, rpm, **params))

    def decision_function(
        self, X: ArrayLike, rpm: ArrayLike | None = None, **params: Any
    ) -> NDArray[Any]:
        """Compute the scores of the conditions; the highest is the verdict.

        Parameters
        ----------
        X, rpm, **params
            As in `diagnose`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes), or (n_rows,) for two conditions
            Log probabilities, up to a constant in each row. For two conditions the
            second's score less the first's.
        """
        return self.diagnose(X, rpm, **params).score

    def score(
        self,
        X: ArrayLike,
        y: ArrayLike,
        sample_weight: ArrayLike | None = None,
        **params: Any,
    ) -> float:
        """Compute the share of rows whose condition is right.

        Parameters
        ----------
        X, **params
            As in `diagnose`.
        y : array-like of shape (n_rows,)
            Their conditions.
        sample_weight : array-like of shape (n_rows,) or None, default=None
            Weight of each row.

        Returns
        -------
        float
            From 0 to 1.
        """
        # No other method needs this package, which takes long to import.
        from sklearn.metrics import accuracy_score

        return float(
            accuracy_score(y, self.predict(X, **params), sample_weight=sample_weight)
        )

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        # Made for signals of machines: on arbitrary features it need not separate
        # anything.
        tags.classifier_tags.poor_score = True
        return tags
