"""Models that give a verdict together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax
from sklearn.utils import Bunch

from ..core.capabilities import Capabilities, capabilities
from ..core.pipelines import as_diagnosis_pipeline
from ..kernels.evidence import SMALLEST_PROBABILITY, effective_number
from ..kernels.fault_orders import FAULTS, NEPER_IN_DB
from .limits import RECORDED
from .names import UNKNOWN, Named, VerdictNames
from .windows import WindowResults

#: Column with the probability of a fault by combs, above which a condition is named
#: although spectra resemble none; and that probability.
COMB = "probability of a comb"
CLEAR_COMB = 0.9
#: Column with what an unknown condition, or a condition of several, resembles.
MOST_LIKE = "most like"
#: Columns for results that only some classifiers return.
_COLUMNS = {"recorded": RECORDED, "comb": COMB, "evidence": "evidence"}


class Member:
    """Fitted model that diagnoses windows.

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

    def diagnose(
        self, X: NDArray[Any], rpm: NDArray[Any] | None, rows: NDArray[np.bool_]
    ) -> Bunch | None:
        """Return the results of the model for some windows, None if there are none."""
        if not rows.any():
            return None
        metadata = dict(self._metadata)
        if rpm is not None and self.described.takes_rpm:
            metadata["rpm"] = rpm[rows]
        return self._pipeline.diagnose(np.asarray(X)[rows], **metadata)


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
        self._possible = list(conditions)
        if self.described.states_unknown:
            self._possible.append(UNKNOWN)
        order = [self.described.conditions.index(name) for name in conditions]
        #: Columns of its log probabilities, of which that of an unknown one is the last.
        self._order = [*order, -1]
        self.n_evidence: int = self.described.n_evidence or len(self._possible)

    def diagnose_usable(
        self, X: NDArray[Any], rpm: NDArray[Any] | None, results: WindowResults
    ) -> Bunch:
        """Return the results for the usable windows, without those that it refuses."""
        diagnosed = self.diagnose(X, rpm, results.usable)
        if diagnosed is None:
            n_conditions = len(self.described.conditions)
            return Bunch(probability=np.empty((0, n_conditions)))
        reasons = diagnosed.pop("refusal", None)
        if reasons is None:
            return diagnosed
        results.refuse(reasons)
        accepted = {name: values[reasons == ""] for name, values in diagnosed.items()}
        return Bunch(**accepted)

    def fill(
        self,
        results: WindowResults,
        diagnosed: Bunch,
        outputs: Sequence[str],
        known: NDArray[Any] | None,
    ) -> None:
        """Fill the columns of the classifier.

        Parameters
        ----------
        results : WindowResults
            Results to fill.
        diagnosed : Bunch
            As `diagnose_usable` returns it.
        outputs : sequence of str
            Names of the outputs.
        known : ndarray of shape (n_usable,) or None
            P-value of the nearest known condition over the rate at which windows are
            rejected.
        """
        columns = results.columns
        logs = self._in_order(diagnosed)
        probability = np.exp(logs)
        if known is not None and self.described.states_unknown:
            # A clear comb shows the location of a fault of another bearing, too.
            has_comb = diagnosed.get("comb", np.zeros(len(known))) > CLEAR_COMB
            is_rejected = (known < 1) & ~has_comb
            of_conditions = probability[is_rejected, :-1] * known[is_rejected, None]
            probability[is_rejected, :-1] = of_conditions
            probability[is_rejected, -1] = 1 - of_conditions.sum(axis=1)
        named = self._named(probability)
        verdicts = np.empty(len(named), dtype=object)
        verdicts[:] = [name.verdict for name in named]
        columns["verdict"][results.usable] = diagnosed.get("named", verdicts)
        if self.described.states_unknown:
            most_like = [name.most_like for name in named]
            columns[MOST_LIKE] = results.everywhere(np.array(most_like, dtype=object))
        everywhere = results.everywhere(probability)
        for condition, column in zip(self._possible, everywhere.T, strict=False):
            columns[f"probability of {condition}"] = column
        for name, title in _COLUMNS.items():
            if name in diagnosed:
                columns[title] = results.everywhere(diagnosed[name])
        if "comb_scores" in diagnosed:
            levels = results.everywhere(NEPER_IN_DB * diagnosed.comb_scores)
            for fault, column in zip(FAULTS, levels.T, strict=True):
                columns[f"dB of {fault}"] = column
        if "verdict_of_outputs" in diagnosed:
            of_outputs = results.everywhere(diagnosed.verdict_of_outputs)
            for name, verdict in zip(outputs, of_outputs.T, strict=False):
                columns[f"verdict of {name}"] = verdict
        evidence = logs[:, : len(self._possible)]
        evidence = np.maximum(evidence, np.log(SMALLEST_PROBABILITY))
        if self.described.n_evidence:
            evidence = diagnosed.get("row_evidence", np.empty((0, self.n_evidence)))
        results.evidence = results.everywhere(evidence)

    def _in_order(self, diagnosed):
        """Return log probabilities of conditions in their order, and of an unknown one."""
        logs = diagnosed.get("log_probability")
        if logs is None:
            with np.errstate(divide="ignore"):
                of_conditions = np.log(diagnosed.probability)
            of_unknown = np.full(len(of_conditions), -np.inf)
            logs = np.column_stack([of_conditions, of_unknown])
        return logs[:, self._order]

    def _named(self, probability):
        """Return the verdicts by probabilities of conditions, and of an unknown one."""
        n_conditions = len(self.names.conditions)
        return [
            self.names.name(row[:n_conditions], float(row[n_conditions:].sum()))
            for row in probability
        ]

    def named(
        self, evidence: NDArray[Any], n_windows: NDArray[np.float64]
    ) -> list[Named]:
        """Return the verdicts by means of evidence, see `Judge.named`."""
        if not self.described.n_evidence:
            weights = effective_number(n_windows)[:, np.newaxis]
            return self._named(np.exp(log_softmax(weights * evidence, axis=1)))
        joined = self._pipeline.steps[-1][1].join(evidence, n_windows)
        if "named" not in joined:
            return self._named(np.exp(self._in_order(joined)))
        # The classifier names its verdicts itself.
        names = self.names.names
        highest = joined.probability.max(axis=1).tolist()
        return [
            Named(verdict, probability if verdict in names else np.nan, None)
            for verdict, probability in zip(joined.named, highest, strict=True)
        ]
