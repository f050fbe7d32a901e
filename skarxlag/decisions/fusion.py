"""One answer from several sensors on one machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_softmax, softmax
from sklearn.base import BaseEstimator, clone, is_classifier
from sklearn.utils import Bunch, get_tags
from sklearn.utils.metadata_routing import get_routing_for_object
from sklearn.utils.metaestimators import available_if

from ..core.base import SignalEstimator
from ..core.capabilities import capabilities, unfolded_steps
from ..core.pipelines import as_diagnosis_pipeline
from ..core.state import expect, is_fitted, uses_fitted
from ..core.validation import check_count, validate_signals
from ..kernels.evidence import SMALLEST_PROBABILITY
from ..kernels.posterior import decided
from .condition_locations import location_answers, location_numbers
from .signal_classifier import SignalClassifier

#: Parameters of detectors that are shares of rows.
_RATES = ("false_alarm_rate", "false_rejection_rate")


def _of_output(fusion):
    """Return a fitted copy, or the parameter before `fit`.

    A loaded file may hold anything in both.
    """
    models = getattr(fusion, "estimators_", None)
    copies = models if isinstance(models, list) else []
    estimators = (model for model in copies if isinstance(model, BaseEstimator))
    return next(estimators, fusion.estimator)


def _names_conditions(fusion):
    return is_classifier(_of_output(fusion))


def _detects_outliers(fusion):
    return not is_classifier(_of_output(fusion))


@dataclass(kw_only=True, eq=False, repr=False)
class SensorFusion(SignalEstimator, BaseEstimator):
    r"""Classifier or detector of several sensors that measure the same bearing.

    A copy of `estimator` is fitted for each output. Each copy gets its output and all
    inputs, so no sensor is predicted from another one, which would remove what both
    measure of a fault.

    A classifier has the probabilities

    .. math:: P_c \propto \exp\Big(\frac{1}{S} \sum_{s=1}^{S} \ln P_{s,c}\Big)

    of condition c from those of S outputs. It is the mean and not the sum of the
    logarithms, because sensors on one machine are not independent. Probabilities below
    1e-6 count as 1e-6, so that one sensor cannot exclude a condition. Its alarm is
    raised if one of the outputs raises it.

    A detector has the p-value :math:`\min(1, S \min_s p_s)` by Bonferroni's inequality,
    which is valid however the outputs depend on each other. With several known
    conditions, this holds for each of them. Each output is calibrated for the S-th part
    of the rates that `estimator` states, so that all of them together flag no more
    healthy rows than stated.

    Parameters
    ----------
    estimator : estimator
        What :func:`skarxlag.make_diagnoser`, :func:`skarxlag.make_detector` or
        :func:`skarxlag.make_known_conditions` returns; or another classifier of windows
        with probabilities.
    n_outputs : int or None, default=None
        Channels that are outputs, at least 1: the first of a window. The others are
        inputs. None: all channels are outputs.

    Attributes
    ----------
    estimators_ : list of estimator
        Fitted copies, one for each output.
    classes_ : ndarray of shape (n_classes,)
        Conditions; of a classifier.
    offset_ : float
        Logarithm of the stated rate; of a detector.
    n_features_in_ : int
        First length of a window, as of all estimators of windows.
    window_shape_ : ndarray of int
        Shape of a window.
    feature_names_in_ : ndarray of str
        Names of the columns, when fitted on a DataFrame.

    See Also
    --------
    skarxlag.make_diagnoser : Takes one output; further channels are inputs.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from skarxlag import make_diagnoser
    >>> X = np.random.default_rng(0).normal(size=(40, 2, 1200))  # rows, sensors, samples
    >>> X[20:] = lfilter([1], [1, -0.8], X[20:])
    >>> y = np.repeat(["healthy", "worn"], 20)
    >>> fusion = SensorFusion(estimator=make_diagnoser()).fit(X, y)
    >>> fusion.predict(X[[0, 39]])
    array(['healthy', 'worn'], dtype='<U7')
    """

    estimator: Any
    n_outputs: int | None = None

    def fit(self, X: ArrayLike, y: ArrayLike | None = None, **params: Any) -> Self:
        """Fit a copy of the estimator for each output.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_outputs + n_inputs, n_samples) or (n_rows, n_samples)
            Rows. Plain rows have one output.
        y : array-like of shape (n_rows,) or None, default=None
            Condition of each row; None for a detector.
        **params
            Metadata of `estimator`, such as ``rpm`` and ``sample_weight``.

        Returns
        -------
        SensorFusion
            The fitted estimator.

        Raises
        ------
        ValueError
            If `n_outputs` is below 1 or above the number of channels.
        """
        X, y = validate_signals(self, X, y, reset=True, any_length=True)
        self._check_parameters()
        n_channels = self._n_channels
        n_outputs = n_channels if self.n_outputs is None else self.n_outputs
        expected = f"at most {n_channels}, the channels of X"
        expect(n_outputs <= n_channels, "n_outputs", n_outputs, expected)
        stated = self.estimator.get_params().items()
        rates = {
            name: value / n_outputs for name, value in stated if name.endswith(_RATES)
        }
        self.estimators_: list[Any] = [
            clone(self.estimator).set_params(**rates).fit(of_output, y, **params)
            for of_output in _rows_of_outputs(X, n_outputs)
        ]
        return self

    def _results_of_outputs(self, method, X, params):
        """Return the results of a method of all outputs."""
        X, _ = validate_signals(self, X, reset=False, any_length=True)
        rows = _rows_of_outputs(X, len(self.estimators_))
        return [
            getattr(as_diagnosis_pipeline(model), method)(of_output, **params)
            for model, of_output in zip(self.estimators_, rows, strict=True)
        ]

    @available_if(_names_conditions)
    @uses_fitted
    def diagnose(self, X: ArrayLike, **params: Any) -> Bunch:
        """Compute verdict, probability and alarm of each row in one pass.

        Parameters
        ----------
        X : array-like of shape (n_rows, n_outputs + n_inputs, n_samples) or (n_rows, n_samples)
            Rows.
        **params
            Metadata of `estimator`, such as ``rpm``.

        Returns
        -------
        Bunch
            ``verdict`` of shape (n_rows,); ``probability`` of shape (n_rows,
            n_classes); if `estimator` states them, ``log_probability``, with that of an
            unknown condition, and ``recorded``, the mean probability of a recorded
            specimen; ``verdict_of_outputs``, the verdict of each output by itself, of
            shape (n_rows, n_outputs); if `estimator` has a detection threshold,
            ``alarm``, of bool; and ``refusal`` and ``row_evidence``, if `estimator`
            returns them.
        """
        of_outputs = self._results_of_outputs("diagnose", X, params)
        fused = self._fused(of_outputs)
        if all("alarm" in output for output in of_outputs):
            fused.alarm = np.any([output.alarm for output in of_outputs], axis=0)
        if "refusal" in of_outputs[0]:
            fused.refusal = of_outputs[0].refusal
        if "row_evidence" in of_outputs[0]:
            fused.row_evidence = np.hstack(
                [output.row_evidence for output in of_outputs]
            )
        return fused

    @available_if(_names_conditions)
    @uses_fitted
    def join(self, evidence: ArrayLike, n_rows: ArrayLike = 1.0) -> Bunch:
        """Diagnose recordings by the mean evidence of their rows.

        Parameters
        ----------
        evidence : array-like of shape (n_recordings, n_values)
            Means of ``row_evidence``, which `diagnose` returns if that of `estimator`
            does.
        n_rows : float or array-like of shape (n_recordings,), default=1.0
            Number of rows, or the sum of their weights, above 0.

        Returns
        -------
        Bunch
            As `diagnose` returns it, without what only a row has.
        """
        parts = np.split(np.asarray(evidence), len(self.estimators_), axis=1)
        outputs = zip(self.estimators_, parts, strict=True)
        return self._fused(
            [unfolded_steps(model)[-1].join(part, n_rows) for model, part in outputs]
        )

    def _fused(self, of_outputs):
        """Return probabilities and verdicts from those of each output."""
        states_unknown = "log_probability" in of_outputs[0]
        if states_unknown:
            logs = np.array([output.log_probability for output in of_outputs])
        else:
            with np.errstate(divide="ignore"):
                logs = np.log([output.probability for output in of_outputs])
        mean = np.maximum(logs, np.log(SMALLEST_PROBABILITY)).mean(axis=0)
        if states_unknown:
            fused = Bunch(log_probability=log_softmax(mean, axis=1))
            locations = _locations_of(self)
            fused.update(decided(fused.log_probability, self.classes_, *locations))
            fused.recorded = np.mean([output.recorded for output in of_outputs], axis=0)
        else:
            probability = softmax(mean, axis=1)
            verdict = self.classes_[probability.argmax(axis=1)]
            fused = Bunch(probability=probability, verdict=verdict)
        verdicts = [output.verdict for output in of_outputs]
        fused.verdict_of_outputs = np.array(verdicts, dtype=object).T
        return fused

    def predict(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Return the condition of each row; of a detector 1, and -1 for outliers.

        Parameters
        ----------
        X, **params
            As in `fit`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Conditions, or 1 and -1.
        """
        if _names_conditions(self):
            return self.diagnose(X, **params).verdict
        return np.where(self.decision_function(X, **params) < 0, -1, 1)

    @available_if(_names_conditions)
    def predict_proba(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the probability of each condition.

        Parameters
        ----------
        X, **params
            As in `fit`.

        Returns
        -------
        ndarray of shape (n_rows, n_classes)
            Probabilities, in the order of `classes_`.
        """
        return self.diagnose(X, **params).probability

    score: ClassVar[Callable[..., float]] = available_if(_names_conditions)(
        SignalClassifier.score
    )

    @available_if(_detects_outliers)
    @uses_fitted
    def p_values(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the p-value of each row, or of each row and known condition.

        Parameters
        ----------
        X, **params
            As in `fit`.

        Returns
        -------
        ndarray of shape (n_rows,) or (n_rows, n_conditions)
            In (0, 1].
        """
        p_values = self._results_of_outputs("p_values", X, params)
        return np.minimum(len(p_values) * np.min(p_values, axis=0), 1.0)

    @available_if(_detects_outliers)
    def decision_function(self, X: ArrayLike, **params: Any) -> NDArray[Any]:
        """Compute the logarithm of the p-value over the stated rate.

        Of several known conditions, the nearest one counts.

        Parameters
        ----------
        X, **params
            As in `fit`.

        Returns
        -------
        ndarray of shape (n_rows,)
            Natural logarithms, negative for outliers.
        """
        p_values = self.p_values(X, **params)
        nearest = p_values.reshape(len(p_values), -1).max(axis=1)
        return np.log(nearest) - self.offset_

    @property
    def classes_(self) -> NDArray[Any]:
        """Conditions."""
        return self.estimators_[0].classes_

    @property
    def offset_(self) -> float:
        """Logarithm of the stated rate, 0 without one."""
        return float(np.log(capabilities(self).stated_rate or 1.0))

    def get_metadata_routing(self) -> Any:
        """Return what `estimator` requests.

        Returns
        -------
        MetadataRouter or MetadataRequest
            As scikit-learn describes it.
        """
        return get_routing_for_object(self.estimator)

    def _capabilities(self):
        n_outputs = len(self.estimators_)
        of_output = capabilities(self.estimators_[0])
        rate = of_output.stated_rate
        return asdict(of_output) | {
            "n_outputs": n_outputs,
            "limits": of_output.limits and f"{of_output.limits}, for the first output",
            "n_channels": of_output.n_channels + n_outputs - 1,
            "n_evidence": of_output.n_evidence * n_outputs,
            "stated_rate": None if rate is None else n_outputs * rate,
        }

    def _check_parameters(self):
        if self.n_outputs is not None:
            check_count(self.n_outputs, "n_outputs")

    def _check_relations(self):
        models = getattr(self, "estimators_", None)
        fits = (
            isinstance(models, list)
            and 0 < len(models) <= self._n_channels
            and self.n_outputs in (None, len(models))
            and all(isinstance(model, BaseEstimator) for model in models)
            and all(map(is_fitted, models))
        )
        expect(fits, "estimators_", models, "a fitted estimator for each output")
        rows = [
            (described.conditions, described.n_channels, described.window_length)
            for described in map(capabilities, models)
        ]
        n_channels = self._n_channels - len(models) + 1
        length = int(self.window_shape_[-1])
        expected = [(rows[0][0], n_channels, length)] * len(models)
        is_right = rows == expected
        expect(is_right, "Rows of estimators_", rows, f"{expected} by window_shape_")

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        of_output = get_tags(_of_output(self))
        tags.estimator_type = of_output.estimator_type
        tags.target_tags = of_output.target_tags
        tags.classifier_tags = of_output.classifier_tags
        if tags.classifier_tags is not None:
            # Made for signals of bearings: on arbitrary features it need not separate
            # anything.
            tags.classifier_tags.poor_score = True
        return tags


def _locations_of(fusion):
    """Number of the location of each condition, and that of the healthy one."""
    described = capabilities(fusion)
    names = described.locations or [None] * len(described.conditions)
    return location_answers(location_numbers(names))


def _rows_of_outputs(X, n_outputs):
    """Return the rows of each output with all inputs; without inputs, plain rows."""
    if X.ndim == 2:
        return [X]
    if X.shape[1] == n_outputs:
        return list(X.transpose(1, 0, 2))
    inputs = range(n_outputs, X.shape[1])
    return [X[:, [output, *inputs]] for output in range(n_outputs)]
