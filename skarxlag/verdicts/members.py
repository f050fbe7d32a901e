"""Models that give a verdict together: classifier, detector and known conditions.

Each of them fills its own columns of the table of windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import log_softmax
from sklearn.utils import Bunch

from ..core.capabilities import Capabilities, capabilities
from ..core.pipelines import as_diagnosis_pipeline
from ..core.state import expect
from ..kernels.evidence import (
    NEAREST_CORRELATION,
    SMALLEST_PROBABILITY,
    combined_p_value,
    effective_number,
)
from ..kernels.fault_orders import FAULTS, NEPER_IN_DB
from .limits import RECORDED
from .names import UNKNOWN, Named, VerdictNames
from .windows import WindowResults, WindowStatus

#: Column with the probability of a fault by combs, above which a condition is named
#: although spectra resemble none; and that probability.
COMB = "probability of a comb"
_CLEAR_COMB = 0.9
#: Column with the p-value of the nearest known condition.
NEAREST = "p-value of nearest"
#: Column with what an unknown condition, or a condition of several, resembles.
MOST_LIKE = "most like"
#: Columns for results that only some classifiers return.
_COLUMNS = {"recorded": RECORDED, "comb": COMB, "evidence": "evidence"}


def for_all_windows(values: NDArray[Any], rows: NDArray[np.bool_]) -> NDArray[Any]:
    """Return values of some windows for all windows; the others are NaN.

    Parameters
    ----------
    values : ndarray of shape (n_chosen, ...)
        Values of the chosen windows.
    rows : ndarray of bool of shape (n_windows,)
        Which windows are chosen.

    Returns
    -------
    ndarray of shape (n_windows, ...)
        Of the type of `values`, in which integers cannot be.

    Examples
    --------
    >>> for_all_windows(np.array([0.5]), np.array([False, True]))
    array([nan, 0.5])
    """
    everywhere = np.full((len(rows), *values.shape[1:]), np.nan, dtype=values.dtype)
    everywhere[rows] = values
    return everywhere


def has_clear_comb(table: pd.DataFrame) -> bool:
    """Return whether the windows of a recording clearly show the comb of a fault."""
    return COMB in table and table[COMB].median() > _CLEAR_COMB


class Member:
    """Fitted model that fills columns of the table of windows.

    Parameters
    ----------
    model : estimator
        The model.
    bearing : BearingLike, default=None
        Bearing of all rows, if it is not that of the model.

    Attributes
    ----------
    described : Capabilities
        Description of the model.
    """

    def __init__(self, model: Any, bearing: Any = None) -> None:
        self.described: Capabilities = capabilities(model)
        self._pipeline = as_diagnosis_pipeline(model)
        self._metadata = {} if bearing is None else {"bearing": bearing}

    def _diagnose(self, X, rpm, rows):
        """Return the results of the model for some windows."""
        chosen = X if rows.all() else np.asarray(X)[rows]
        metadata = self._metadata
        if rpm is not None and self.described.takes_rpm:
            metadata = metadata | {"rpm": rpm[rows]}
        return self._pipeline.diagnose(chosen, **metadata)


class Detector(Member):
    """Detector with the healthy limits: fills ``alarm``, ``score`` and ``p-value``."""

    def __init__(self, model: Any) -> None:
        super().__init__(model)
        is_detector = self.described.alarm and self.described.conditions is None
        expect(is_detector, "detector", model, "an outlier detector")

    def fill(
        self, results: WindowResults, X: NDArray[Any], status: WindowStatus
    ) -> None:
        """Fill the columns of the detector."""
        within = status.within_limits
        columns = results.columns
        columns["score"] = np.full(len(within), np.nan)
        if within.any():
            diagnosed = self._diagnose(X, status.rpm, within)
            columns["alarm"][within] = diagnosed.alarm
            columns["score"][within] = diagnosed.score
        # The score is the logarithm of the p-value over the stated rate.
        rate = self.described.stated_rate if self.described.healthy_p_value else np.nan
        columns["p-value"] = np.exp(columns["score"]) * rate


class Classifier(Member):
    """Classifier of conditions: fills verdicts, probabilities and evidence.

    Parameters
    ----------
    model : estimator
        Fitted classifier with probabilities.
    conditions : list of label
        Its conditions, in the order of the columns.
    healthy : label or None
        The healthy one.
    bearing : BearingLike, default=None
        As in `Member`.

    Attributes
    ----------
    names : VerdictNames
        Names of its verdicts.
    n_evidence : int
        Values of the evidence of a window.
    """

    def __init__(
        self, model: Any, conditions: list[Any], healthy: Any, bearing: Any = None
    ) -> None:
        super().__init__(model, bearing)
        self.names: VerdictNames = VerdictNames(conditions, healthy, self.described)
        self.possible: list[Any] = list(conditions)
        if self.described.states_unknown:
            self.possible.append(UNKNOWN)
        order = [self.described.conditions.index(name) for name in conditions]
        #: Columns of its log probabilities, of which that of an unknown one is the last.
        self._order = [*order, -1]
        self.n_evidence: int = self.described.n_evidence or len(self.possible)

    def diagnose(self, X: NDArray[Any], status: WindowStatus) -> Bunch | None:
        """Return the results for the usable windows, and refuse those that it refuses.

        None if no window is usable.
        """
        usable = status.usable
        if not usable.any():
            return None
        diagnosed = self._diagnose(X, status.rpm, usable)
        if "refusal" not in diagnosed:
            return diagnosed
        reasons = diagnosed.pop("refusal")
        status.refuse(reasons)
        is_accepted = reasons == ""
        return Bunch(
            **{name: values[is_accepted] for name, values in diagnosed.items()}
        )

    def fill(
        self,
        results: WindowResults,
        diagnosed: Bunch | None,
        status: WindowStatus,
        outputs: Sequence[str],
        *,
        fills_alarm: bool,
    ) -> None:
        """Fill the columns of the classifier.

        Parameters
        ----------
        results : WindowResults
            Results to fill.
        diagnosed : Bunch or None
            As `diagnose` returns it.
        status : WindowStatus
            Status of the windows.
        outputs : sequence of str
            Names of the outputs.
        fills_alarm : bool
            Whether the detection threshold of the classifier is the healthy limit.
        """
        if diagnosed is None:
            n_conditions = len(self.described.conditions)
            diagnosed = Bunch(probability=np.empty((0, n_conditions)))
        usable = status.usable
        columns = results.columns
        logs = self._in_order(diagnosed)
        probability = np.exp(logs)
        named = [self.names.name(row[:-1], row[-1]) for row in probability]
        verdicts = np.empty(len(named), dtype=object)
        verdicts[:] = [name.verdict for name in named]
        columns["verdict"][usable] = diagnosed.get("named", verdicts)
        if fills_alarm and "alarm" in diagnosed:
            self._fill_alarm(results, diagnosed, status)
        if self.described.states_unknown:
            most_like = np.full(len(usable), None, dtype=object)
            most_like[usable] = [name.most_like for name in named]
            columns[MOST_LIKE] = most_like
        everywhere = for_all_windows(probability, usable)
        for condition, column in zip(self.possible, everywhere.T, strict=False):
            columns[f"probability of {condition}"] = column
        for name, title in _COLUMNS.items():
            if name in diagnosed:
                columns[title] = for_all_windows(diagnosed[name], usable)
        if "comb_scores" in diagnosed:
            levels = NEPER_IN_DB * diagnosed.comb_scores
            for fault, column in zip(FAULTS, levels.T, strict=True):
                columns[f"dB of {fault}"] = for_all_windows(column, usable)
        self._fill_evidence(results, diagnosed, logs, usable)
        if "verdict_of_outputs" in diagnosed:
            of_outputs = for_all_windows(diagnosed.verdict_of_outputs, usable)
            for name, verdict in zip(outputs, of_outputs.T, strict=False):
                columns[f"verdict of {name}"] = verdict

    def _fill_evidence(self, results, diagnosed, logs, usable):
        """Fill the evidence for the conditions."""
        floor = np.log(SMALLEST_PROBABILITY)
        evidence = np.maximum(logs[:, : len(self.possible)], floor)
        if self.described.n_evidence:
            evidence = diagnosed.get("row_evidence", np.empty((0, self.n_evidence)))
        results.evidence = for_all_windows(evidence, usable)

    def _in_order(self, diagnosed):
        """Return log probabilities of conditions in their order, and of an unknown one."""
        logs = diagnosed.get("log_probability")
        if logs is None:
            with np.errstate(divide="ignore"):
                of_conditions = np.log(diagnosed.probability)
            of_unknown = np.full(len(of_conditions), -np.inf)
            logs = np.column_stack([of_conditions, of_unknown])
        return logs[:, self._order]

    def _fill_alarm(self, results, diagnosed, status):
        """Fill the alarm, and the p-value if it belongs to the alarm."""
        within = status.within_limits
        of_usable = within[status.usable]
        results.columns["alarm"][within] = diagnosed.alarm[of_usable]
        # The p-value of combs does not belong to the alarm of learned conditions.
        if "p_value" in diagnosed and "comb" not in diagnosed:
            p_value = for_all_windows(diagnosed.p_value[of_usable], within)
            results.columns["p-value"] = p_value

    def named(
        self, evidence: NDArray[Any], n_windows: NDArray[np.float64]
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
            The verdicts.
        """
        if self.described.n_evidence:
            joined = self._pipeline.steps[-1][1].join(evidence, n_windows)
            return self._names_of(joined)
        weights = effective_number(n_windows)[:, np.newaxis]
        logs = log_softmax(weights * evidence, axis=1)
        n_conditions = len(self.names.conditions)
        unknown = np.exp(logs[:, n_conditions:]).sum(axis=1).tolist()
        probability = np.exp(logs[:, :n_conditions])
        return [
            self.names.name(*of_mean)
            for of_mean in zip(probability, unknown, strict=True)
        ]

    def _names_of(self, diagnosed):
        """Return the verdicts of a classifier, as it names them itself if it does."""
        if "named" not in diagnosed:
            probability = np.exp(self._in_order(diagnosed))
            return [self.names.name(row[:-1], float(row[-1])) for row in probability]
        names = self.names.names
        highest = diagnosed.probability.max(axis=1).tolist()
        return [
            Named(verdict, probability if verdict in names else np.nan, None)
            for verdict, probability in zip(diagnosed.named, highest, strict=True)
        ]

    def of_recording(
        self, usable: pd.DataFrame, evidence: NDArray[Any]
    ) -> dict[str, Any]:
        """Return verdict, probability and resemblance of a recording.

        Parameters
        ----------
        usable : DataFrame
            Windows of the recording that were diagnosed; at least one.
        evidence : ndarray of shape (n_windows, n_evidence)
            Their evidence.

        Returns
        -------
        dict
            These columns of `recording_verdicts`.
        """
        mean = evidence.mean(axis=0, keepdims=True)
        [named] = self.named(mean, np.full(1, len(evidence)))
        entries = {"verdict": named.verdict, "probability": named.probability}
        if self.described.states_unknown:
            entries[MOST_LIKE] = named.most_like
        return entries


class KnownConditions(Member):
    """Known conditions: fills ``p-value of nearest``, and rejects windows unlike all."""

    def fill(
        self,
        results: WindowResults,
        X: NDArray[Any],
        status: WindowStatus,
        classifier: Classifier | None,
    ) -> None:
        """Fill the column, and the columns of the classifier for rejected windows."""
        rate = self.described.stated_rate
        usable = status.usable
        p_value = np.full(len(usable), np.nan)
        if usable.any():
            score = self._diagnose(X, status.rpm, usable).score
            p_value[usable] = np.exp(score) * rate
        results.columns[NEAREST] = p_value
        if classifier is None or not classifier.described.states_unknown:
            return
        # A clear comb shows the location of a fault of another bearing, too.
        comb = results.columns.get(COMB, np.zeros(len(p_value)))
        rejected = np.flatnonzero((p_value < rate) & ~(comb > _CLEAR_COMB))
        names = [f"probability of {name}" for name in classifier.possible]
        for row in rejected:
            probability = [results.columns[name][row] for name in names[:-1]]
            probability = np.array(probability) * (p_value[row] / rate)
            unknown = 1 - probability.sum()
            for name, value in zip(names, [*probability, unknown], strict=True):
                results.columns[name][row] = value
            named = classifier.names.name(probability, unknown)
            results.columns["verdict"][row] = named.verdict
            results.columns[MOST_LIKE][row] = named.most_like

    def p_value(self, usable: pd.DataFrame) -> float:
        """Return the p-value of the nearest condition of a recording."""
        return combined_p_value(usable[NEAREST], NEAREST_CORRELATION)

    def rejects(self, p_value: float, usable: pd.DataFrame) -> bool:
        """Return whether a recording is of an unknown condition."""
        return p_value < self.described.stated_rate and not has_clear_comb(usable)
