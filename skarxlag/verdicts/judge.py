"""Models that together give one answer for windows and for recordings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from ..core.capabilities import capabilities
from ..core.fault_locations import NO_FINDING
from ..core.speeds import speed_errors, speeds_of_rows
from ..core.state import expect
from ..kernels.evidence import NEAREST_CORRELATION, combined_p_value
from ..measures.quality import quality_of_outputs
from .limits import HealthyLimits
from .members import CLEAR_COMB, COMB, MOST_LIKE, Classifier, Member
from .names import CHANGED, NO_SIGNAL, NO_VERDICT, UNKNOWN, Named, check_conditions
from .windows import HOLD, WindowResults

#: Column with the p-value of the nearest known condition.
NEAREST = "p-value of nearest"


class Judge:
    """Models that together give one answer for windows and for recordings.

    Parameters
    ----------
    diagnoser : estimator or None
        Fitted classifier with probabilities, or a detector.
    conditions : sequence of label, default=None
        Order of the conditions, the healthy one first: a permutation of those of the
        diagnoser. For a detector alone, the name of the healthy condition. None:
        sorted, or ``["healthy"]``.
    has_healthy : bool, default=True
        Whether one of the conditions is healthy. False: there are no healthy limits.
    known : estimator or None, default=None
        Fitted known conditions, which reject windows that resemble none of them.
    detector : estimator or None, default=None
        Fitted detector with the healthy limits. None: the detection threshold of the
        diagnoser, if it has one.
    train_rpm : sequence of float, default=()
        Training speeds. Empty: those that the models state. Rows whose stated speed
        lies farther than a factor of 5 outside them get no verdict.
    same_speed : bool, default=False
        Whether windows without a stated speed are taken to be of a training speed.
    sampling_rate : float, default=None
        In Hz, to find mains hum. None: that of the models, if they state it.
    outputs : sequence of str, default=None
        Names of the outputs. None: "output 1" and so on.
    bearing : BearingLike, default=None
        Bearing of the rows, if it is not that of the diagnoser.

    Attributes
    ----------
    conditions : list
        See above.
    healthy : label or None
        The healthy condition; None if it is not known.
    limits : HealthyLimits
        The healthy limits.
    n_evidence : int
        Values of the evidence of a window; 0 without a classifier.
    outputs : list of str
        Names of the outputs.
    train_rpm : list of float
        Training speeds.
    sampling_rate : float or None
        In Hz.

    Raises
    ------
    ValueError
        If there is neither a classifier nor a detector, the classifier has no
        probabilities, `conditions` is no permutation, or a condition is named like
        another verdict.
    """

    def __init__(
        self,
        diagnoser: Any,
        *,
        conditions: Sequence[Any] | None = None,
        has_healthy: bool = True,
        known: Any = None,
        detector: Any = None,
        train_rpm: Sequence[float] = (),
        same_speed: bool = False,
        sampling_rate: float | None = None,
        outputs: Sequence[str] | None = None,
        bearing: Any = None,
    ) -> None:
        expect(
            diagnoser is not None or detector is not None,
            "diagnoser and detector",
            None,
            "a diagnoser, a detector, or both",
        )
        described = None if diagnoser is None else capabilities(diagnoser)
        if described is not None and described.conditions is None:
            expected = "a classifier next to a detector"
            expect(detector is None, "diagnoser", diagnoser, expected)
            diagnoser, detector, described = None, diagnoser, None
        names = None
        healthy = "healthy"
        if described is not None:
            if not described.states_probabilities:
                raise ValueError(
                    "diagnoser states no probabilities, expected predict_proba"
                )
            names = described.conditions
            healthy = described.healthy
        stated = conditions if conditions is not None else names or [healthy]
        check_conditions(stated, names)
        self.conditions: list[Any] = list(stated)
        # The first of a user's order is the healthy condition.
        healthy = healthy if conditions is None else self.conditions[0]
        self.healthy: Any = healthy if has_healthy else None
        self._classifier: Classifier | None = None
        if described is not None:
            self._classifier = Classifier(
                diagnoser, self.conditions, self.healthy, bearing
            )
        self._detector = None if detector is None else Member(detector)
        limiting = (self._detector or self._classifier).described
        is_detector = limiting.alarm and limiting.conditions is None
        expected = "an outlier detector"
        expect(detector is None or is_detector, "detector", detector, expected)
        self._known = None if known is None else Member(known)
        members = (self._classifier, self._detector, self._known)
        models = [member.described for member in members if member is not None]
        speeds = [train_rpm, *(model.speeds for model in models)]
        rates = [sampling_rate, *(model.sampling_rate for model in models)]
        self.train_rpm: list[float] = list(next(filter(len, speeds), ()))
        self.sampling_rate: float | None = next(filter(None, rates), None)
        self.limits: HealthyLimits = HealthyLimits(limiting, self.train_rpm, same_speed)
        self.limits.exist = self.limits.exist and has_healthy
        n_outputs = max(model.n_outputs for model in models)
        numbered = [f"output {number}" for number in range(1, n_outputs + 1)]
        self.outputs: list[str] = list(outputs or numbered)[:n_outputs]
        self.n_evidence: int = self._classifier.n_evidence if self._classifier else 0

    def window_results(
        self, X: NDArray[Any], rpm: ArrayLike | None = None
    ) -> WindowResults:
        """Evaluate all models on windows.

        Parameters
        ----------
        X : ndarray of shape (n_windows, ...)
            Windows; NaN is allowed, and is no signal.
        rpm : float, array-like of shape (n_windows,) or (n_windows, n_samples), default=None
            Speed of each window, or at each of its samples.

        Returns
        -------
        WindowResults
            Columns of the table, and evidence.
        """
        n_windows = len(X)
        refusal = np.full(n_windows, "", dtype=object)
        if rpm is not None:
            refusal = speed_errors(rpm, n_windows, self.train_rpm)
            rpm = speeds_of_rows(rpm, n_windows)
        mean = rpm if rpm is None or rpm.ndim == 1 else rpm.mean(axis=1)
        options = {"sampling_rate": self.sampling_rate, "rpm": mean}
        quality, share = quality_of_outputs(X, self.outputs, **options)
        limits = self.limits.at(mean, n_windows)
        if self._classifier is None:
            # Without limits, a detector has no verdict.
            is_refused = (refusal == "") & (limits != HOLD)
            refusal = np.where(is_refused, limits, refusal)
        results = WindowResults(quality, share, limits, refusal)
        diagnosed = None
        if self._classifier is not None:
            diagnosed = self._classifier.diagnose_usable(X, rpm, results)
        self._fill_alarm(results, X, rpm, diagnosed)
        known = None
        if self._known is not None:
            of_known = self._known.diagnose(X, rpm, results.usable)
            known = np.empty(0) if of_known is None else np.exp(of_known.score)
        if self._classifier is None:
            is_changed = results.columns["alarm"][results.usable] == 1
            verdicts = np.where(is_changed, CHANGED, self.healthy)
            results.columns["verdict"][results.usable] = verdicts
        else:
            self._classifier.fill(results, diagnosed, self.outputs, known)
        if known is not None:
            p_values = known * self._known.described.stated_rate
            results.columns[NEAREST] = results.everywhere(p_values)
        return results

    def _fill_alarm(self, results, X, rpm, diagnosed):
        """Fill the columns of the detector, or the alarm of the classifier."""
        within = results.within_limits
        columns = results.columns
        if self._detector is not None:
            found = self._detector.diagnose(X, rpm, within)
            score = np.empty(0) if found is None else found.score
            columns["score"] = results.everywhere(score, within)
            if found is not None:
                columns["alarm"][within] = found.alarm
            # The score is the logarithm of the p-value over the stated rate.
            described = self._detector.described
            rate = described.stated_rate if described.healthy_p_value else np.nan
            columns["p-value"] = np.exp(columns["score"]) * rate
        elif self.limits.exist and "alarm" in diagnosed:
            of_usable = within[results.usable]
            columns["alarm"][within] = diagnosed.alarm[of_usable]
            # The p-value of combs does not belong to the alarm of learned conditions.
            if "p_value" in diagnosed and "comb" not in diagnosed:
                p_value = diagnosed.p_value[of_usable]
                columns["p-value"] = results.everywhere(p_value, within)

    def recording(
        self, windows: pd.DataFrame, evidence: NDArray[Any]
    ) -> dict[str, Any]:
        """Return one answer for the windows of one recording.

        Parameters
        ----------
        windows : DataFrame
            Table of `WindowResults`, also of several calls.
        evidence : ndarray of shape (n_windows, n_evidence)
            Their evidence.

        Returns
        -------
        dict
            The columns of `recording_verdicts`.
        """
        is_refused = windows["verdict"].astype(str).str.startswith(NO_VERDICT)
        has_signal = windows["quality"] == "good"
        is_usable = (has_signal & ~is_refused).to_numpy()
        usable = windows[is_usable]
        of_limits = self.limits.of_recording(usable)
        answer = {"verdict": NO_SIGNAL, "probability": np.nan}
        answer |= {name: of_limits[name] for name in ("alarm", "p-value")}
        if self._known is not None:
            answer[NEAREST] = combined_p_value(usable[NEAREST], NEAREST_CORRELATION)
        of_outputs = [name for name in usable if name.startswith("verdict of ")]
        answer |= {name: usable[name].mode().get(0) for name in of_outputs}
        if not usable.empty:
            answer |= self._recording_condition(usable, evidence[is_usable], answer)
        elif is_refused.any():
            answer["verdict"] = windows.loc[is_refused, "verdict"].mode()[0]
        answer["windows"] = len(windows)
        answer["no signal"] = int((~has_signal).sum())
        answer["limits"] = of_limits["limits"]
        possible = [self.healthy, CHANGED]
        if self._classifier is not None:
            possible = self._classifier.names.names
        for name in possible:
            answer[f"share of {name}"] = float((usable["verdict"] == name).mean())
        return answer

    def _recording_condition(self, usable, evidence, answer):
        """Return the entries of the verdict, its probability and what it resembles."""
        if self._known is not None:
            has_comb = COMB in usable and usable[COMB].median() > CLEAR_COMB
            is_unknown = answer[NEAREST] < self._known.described.stated_rate
            if is_unknown and not has_comb:
                return {"verdict": UNKNOWN, "probability": np.nan}
        mean = evidence.mean(axis=0, keepdims=True)
        [named] = self.named(mean, np.full(1, len(evidence)))
        entries = {"verdict": named.verdict, "probability": named.probability}
        if MOST_LIKE in usable:
            entries[MOST_LIKE] = named.most_like
        is_calm = entries["verdict"] in (self.healthy, NO_FINDING)
        if answer["alarm"] == "yes" and is_calm:
            entries |= {"verdict": CHANGED, "probability": np.nan}
        return entries

    def named(
        self,
        evidence: NDArray[Any],
        n_windows: NDArray[np.float64],
    ) -> list[Named]:
        """Return the verdicts by means of the evidence of windows.

        Parameters
        ----------
        evidence : ndarray of shape (n_means, n_evidence)
            Means of the evidence of windows.
        n_windows : ndarray of shape (n_means,)
            Number of windows of each mean, or the sum of their weights.

        Returns
        -------
        list of Named
            The verdicts; the healthy condition if there is no classifier.
        """
        if self._classifier is None:
            return [Named(self.healthy, np.nan, None)] * len(evidence)
        return self._classifier.named(evidence, n_windows)
