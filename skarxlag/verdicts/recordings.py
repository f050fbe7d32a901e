"""One answer for each recording, from its windows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline
from sklearn.utils import Bunch, check_consistent_length

from ..core.capabilities import Capabilities, capabilities
from ..core.fault_locations import NOT_IDENTIFIABLE
from ..core.pipelines import as_diagnosis_pipeline
from ..core.speeds import speed_errors, speeds_of_rows
from ..core.state import expect
from ..kernels import evidence
from ..kernels.speed_references import SAME_LOG_SPEED, UNIT_DISTANCE
from ..measures.quality import quality_of_outputs
from .names import (
    CHANGED,
    NO_SIGNAL,
    NO_VERDICT,
    UNKNOWN,
    Named,
    VerdictNames,
    check_conditions,
    no_verdict,
)

#: Entry of the column ``limits`` if healthy limits hold. Other entries are reasons.
HOLD = "hold"
#: The same for a recording that resembles no recorded specimen closely.
HOLD_FOR_RECORDED = "hold for the recorded bearing, load and mounting only"
#: The same if fewer healthy rows than the second number were learned.
FEW_HEALTHY, LEAST_HEALTHY = "too few healthy rows", 9
#: Probability of a fault by combs above which a condition is named although spectra
#: resemble none.
_CLEAR_COMB = 0.9
_NOTHING = pd.Series(dtype=float)
#: Columns for what some classifiers return.
_COLUMNS = {
    "recorded": "probability of a recorded specimen",
    "comb": "probability of a comb",
    "evidence": "evidence",
}
#: Results of a bearing's combs that a monitor gathers.
_GATHERED = ("contrasts", "rpm", "spectra", "verdict_of_outputs")
#: Without p-values, a recording exceeds the limits if more than this share of its
#: windows does.
_MOST_WINDOWS = 0.5


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

    Attributes
    ----------
    conditions : list
        See above.
    healthy : label or None
        The healthy condition; None if it is not known.
    detects : bool
        Whether there are healthy limits.
    alarm_rate : float or None
        Share of healthy windows that may exceed the limits.
    outputs : list of str
        Names of the outputs; "output 1" and so on, unless they are replaced.

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
        known: Any = None,
        detector: Any = None,
        train_rpm: Sequence[float] = (),
        same_speed: bool = False,
        sampling_rate: float | None = None,
    ) -> None:
        models = {"diagnoser": diagnoser, "detector": detector, "known": known}
        models = {name: model for name, model in models.items() if model is not None}
        some = "a diagnoser, a detector, or both"
        expect(models.keys() - {"known"}, "diagnoser and detector", None, some)
        if diagnoser is not None and capabilities(diagnoser).conditions is None:
            expect(
                detector is None,
                "diagnoser",
                diagnoser,
                "a classifier beside a detector",
            )
            models["detector"] = models.pop("diagnoser")
        self.same_speed: bool = same_speed
        self._can = {name: capabilities(model) for name, model in models.items()}
        self._models = {
            name: as_diagnosis_pipeline(model) for name, model in models.items()
        }
        known, ordered, healthy = None, ["healthy"], "healthy"
        if "diagnoser" in self._can:
            can = self._can["diagnoser"]
            if not can.states_probabilities:
                raise ValueError(
                    "diagnoser states no probabilities, expected predict_proba"
                )
            known, ordered, healthy = can.conditions, can.conditions, can.healthy
        stated = ordered if conditions is None else conditions
        check_conditions(stated, known)
        self.conditions: list[Any] = list(stated)
        # The first of a user's order is the healthy condition.
        self.healthy: Any = healthy if conditions is None else self.conditions[0]
        limits = self._can.get("detector") or self._can["diagnoser"]
        is_detector = limits.alarm and limits.conditions is None
        expect(
            is_detector or detector is None, "detector", detector, "an outlier detector"
        )
        self.detects: bool = limits.alarm
        described = self._can.get("diagnoser", Capabilities())
        self._names = VerdictNames(self.conditions, self.healthy, described)
        n_conditions = len(self.conditions) if "diagnoser" in self._can else 0
        #: Probabilities of a window: those of conditions, and of an unknown one.
        self.states_unknown: bool = described.states_unknown
        self.n_answers: int = n_conditions + described.states_unknown
        self.alarm_rate: float | None = limits.stated_rate
        self._has_few_healthy = (
            limits.n_healthy is not None and limits.n_healthy < LEAST_HEALTHY
        )
        speeds = [train_rpm, *(can.speeds for can in self._can.values())]
        n_outputs = max(can.n_outputs for can in self._can.values())
        self.outputs: list[str] = [f"output {s}" for s in range(1, n_outputs + 1)]
        self.train_rpm: list[float] = list(next(filter(len, speeds), ()))
        rates = [sampling_rate, *(can.sampling_rate for can in self._can.values())]
        self.sampling_rate: float | None = next(filter(None, rates), None)

    def window_results(self, X: NDArray[Any], rpm: ArrayLike | None = None) -> Bunch:
        """Evaluate all models on windows.

        Parameters
        ----------
        X : ndarray of shape (n_windows, ...)
            Windows; NaN is allowed, and is no signal.
        rpm : float, array-like of shape (n_windows,) or (n_windows, n_samples), default=None
            Speed of each window, or at each of its samples.

        Returns
        -------
        Bunch
            ``table``: a dict of the columns of `window_verdicts`, in which ``alarm`` is
            1, 0, or NaN if healthy limits do not hold. ``refusal``: why there can be no
            verdict, else an empty text. ``log_probability``: of shape (n_windows,
            n_conditions + 1), that of each condition and of an unknown one, or
            (n_windows, 0) without a classifier. With a bearing also ``contrasts`` over
            orders, of shape (n_windows, 4001), and ``rpm``, and with learned conditions
            ``spectra``, as `FaultOrderClassifier.diagnose` returns them. Numbers are
            NaN if they are not known.
        """
        status = self._status(X, rpm)
        said = self._classified(X, status)
        verdict = np.array(
            [no_verdict(reason) for reason in status.refusal], dtype=object
        )
        verdict[status.quality != "good"] = NO_SIGNAL
        table = {
            "verdict": verdict,
            "alarm": np.full(len(X), np.nan),
            "quality": status.quality,
        }
        table |= {"quality share": status.share, "limits": status.limits}
        found = Bunch(
            table=table, refusal=status.refusal, log_probability=np.empty((len(X), 0))
        )
        within = status.usable & (status.limits == HOLD)
        if "detector" in self._can:
            self._add_detector(table, X, status, within)
        if "diagnoser" in self._can:
            self._add_classifier(found, said, status.usable, within)
        else:
            is_changed = table["alarm"][status.usable] == 1
            verdict[status.usable] = np.where(is_changed, CHANGED, self.healthy)
        if "known" in self._can:
            self._add_known(found, X, status)
        return found

    def _status(self, X, rpm):
        """Return speed, quality and limits of each window, and whether it can be diagnosed."""
        n = len(X)
        refusal = np.full(n, "", dtype=object)
        if rpm is not None:
            refusal = speed_errors(rpm, n, self.train_rpm)
            rpm = speeds_of_rows(rpm, n)
        mean = rpm if rpm is None or rpm.ndim == 1 else rpm.mean(axis=1)
        options = {"sampling_rate": self.sampling_rate, "rpm": mean}
        quality, share = quality_of_outputs(X, self.outputs, **options)
        limits = self._limits(mean, n)
        if "diagnoser" not in self._can:
            # Without limits, a detector says nothing.
            refusal = np.where((refusal == "") & (limits != HOLD), limits, refusal)
        usable = (quality == "good") & (refusal == "")
        facts = {"quality": quality, "share": share, "limits": limits}
        return Bunch(rpm=rpm, refusal=refusal, usable=usable, **facts)

    def _classified(self, X, status):
        """Return the results of the classifier on usable windows, and refuse those it refuses."""
        if "diagnoser" not in self._can:
            return Bunch()
        said = self._asked("diagnoser", X, status.rpm, status.usable)
        if "refusal" in said:
            reasons = said.pop("refusal")
            status.refusal[status.usable] = reasons
            said = Bunch(**{name: each[reasons == ""] for name, each in said.items()})
            status.usable &= status.refusal == ""
        return said

    def _add_detector(self, table, X, status, within):
        """Fill the columns of the detector."""
        watched = self._asked("detector", X, status.rpm, within)
        table["alarm"][within] = watched.alarm
        # The score is the logarithm of the p-value over the stated rate.
        rate = self.alarm_rate if self._can["detector"].healthy_p_value else np.nan
        table["score"] = _of_all_rows(watched.score, within)
        table["p-value"] = np.exp(table["score"]) * rate

    def _add_known(self, found, X, status):
        """Fill the column of the known conditions, and reject windows that are of none of them."""
        table, rate = found.table, self._can["known"].stated_rate
        scores = self._asked("known", X, status.rpm, status.usable).score
        p_value = np.exp(_of_all_rows(scores, status.usable)) * rate
        table["p-value of nearest"] = p_value
        if not self.states_unknown:
            return
        # A clear comb shows the place of a fault of another bearing, too.
        is_clear = table.get("probability of a comb", np.zeros(len(X))) > _CLEAR_COMB
        rejected = np.flatnonzero((p_value < rate) & ~is_clear)
        share = p_value[rejected, np.newaxis] / rate
        known = np.exp(found.log_probability[rejected, :-1]) * share
        every = np.column_stack([known, 1 - known.sum(axis=1)])
        found.log_probability[rejected] = np.log(
            np.maximum(every, evidence.SMALLEST_PROBABILITY)
        )
        for place, name in enumerate([*self.conditions, UNKNOWN]):
            table[f"probability of {name}"][rejected] = every[:, place]
        for row, probability in zip(rejected, every, strict=True):
            named = self._names.name(probability[:-1], probability[-1])
            table["verdict"][row] = named.verdict
            table["most like"][row] = named.most_like

    def _add_classifier(self, found, said, usable, within):
        """Fill the columns of the classifier."""
        table = found.table
        logs = said.get("log_probability")
        if logs is None:
            with np.errstate(divide="ignore"):
                known = np.log(said.probability)
            logs = np.column_stack([known, np.full(len(known), -np.inf)])
        logs = logs[:, [*self._order(), -1]]
        every = np.exp(logs)
        named = [self._names.name(row[:-1], row[-1]) for row in every]
        verdicts = np.empty(len(named), dtype=object)
        verdicts[:] = [each.verdict for each in named]
        table["verdict"][usable] = said.get("named", verdicts)
        if self.detects and "detector" not in self._can:
            table["alarm"][within] = said.alarm[within[usable]]
            # The p-value of combs does not belong to the alarm of learned conditions.
            if "p_value" in said and "comb" not in said:
                table["p-value"] = _of_all_rows(said.p_value[within[usable]], within)
        found.log_probability = _of_all_rows(logs, usable)
        columns = self.conditions
        if self.states_unknown:
            columns = [*self.conditions, UNKNOWN]
            most_like = np.full(len(usable), None, dtype=object)
            most_like[usable] = [each.most_like for each in named]
            table["most like"] = most_like
        for place, name in enumerate(columns):
            table[f"probability of {name}"] = _of_all_rows(every[:, place], usable)
        found |= {
            name: _of_all_rows(said[name], usable) for name in _GATHERED if name in said
        }
        for name, title in _COLUMNS.items():
            if name in said:
                table[title] = _of_all_rows(said[name], usable)
        of_outputs = found.get("verdict_of_outputs", np.empty((len(usable), 0)))
        for name, own in zip(self.outputs, of_outputs.T, strict=False):
            table[f"verdict of {name}"] = own

    def _asked(self, name, X, rpm, rows):
        """Return what a model says of some rows."""
        if not rows.any():
            none = np.empty(0)
            empty = np.empty((0, len(self.conditions)))
            return Bunch(alarm=none, score=none, probability=empty)
        some = X if rows.all() else np.asarray(X)[rows]
        params = (
            {} if rpm is None or not self._can[name].takes_rpm else {"rpm": rpm[rows]}
        )
        return self._models[name].diagnose(some, **params)

    def _limits(self, rpm, n):
        """Return for each row whether healthy limits hold at its speed, or why not."""
        can, listed = (
            self._can.get("detector"),
            ", ".join(f"{v:g}" for v in self.train_rpm),
        )
        reason = f"healthy limits hold at {listed} rpm only"
        holds = np.zeros(n, dtype=bool)
        if not self.detects:
            reason = "no healthy limits were learned"
        elif rpm is None:
            holds[:] = self.same_speed if can is None else not can.needs_rpm
            reason = f"the speed is not stated{f', and {reason}' if listed else ''}"
        elif can is not None and (can.takes_rpm or not listed):
            # These limits widen with the distance in speed.
            holds[:] = True
        elif not listed:
            reason = "the training speeds are not known"
        else:
            # A detector without speeds has limits for speeds that differ by the factor
            # 1.3.
            tolerance = SAME_LOG_SPEED if can is None else UNIT_DISTANCE
            with np.errstate(invalid="ignore", divide="ignore"):
                ratio = np.log(np.divide.outer(rpm, self.train_rpm))
            holds = np.abs(ratio).min(axis=1) <= tolerance + 1e-9
        return np.where(holds, HOLD, reason).astype(object)

    def windows(self, X: NDArray[Any], rpm: ArrayLike | None = None) -> pd.DataFrame:
        """Return a row for each window, as `window_verdicts` does."""
        table = pd.DataFrame(self.window_results(X, rpm).table)
        return table if table["alarm"].isna().any() else table.astype({"alarm": bool})

    def recording(self, windows: pd.DataFrame) -> dict[str, Any]:
        """Return one answer for the windows of one recording.

        Parameters
        ----------
        windows : DataFrame
            Rows of `windows`, also those of several calls.

        Returns
        -------
        dict
            The columns of `recording_verdicts`.
        """
        is_refused = windows["verdict"].astype(str).str.startswith(NO_VERDICT)
        has_signal = windows["quality"] == "good"
        usable = windows[has_signal & ~is_refused]
        alarm, p_value, limits = self._recording_alarm(usable)
        answer = {
            "verdict": NO_SIGNAL,
            "probability": np.nan,
            "alarm": alarm,
            "p-value": p_value,
        }
        if "known" in self._can:
            of_windows, correlation = (
                usable["p-value of nearest"],
                evidence.NEAREST_CORRELATION,
            )
            answer["p-value of nearest"] = evidence.combined_p_value(
                of_windows, correlation
            )
        for name in (each for each in usable if each.startswith("verdict of ")):
            answer[name] = usable[name].mode().get(0)
        if not usable.empty:
            answer |= self._recording_condition(usable, answer)
        elif is_refused.any():
            answer["verdict"] = windows.loc[is_refused, "verdict"].mode()[0]
        possible = (
            self._names.names if "diagnoser" in self._can else [self.healthy, CHANGED]
        )
        return (
            answer
            | {
                "windows": len(windows),
                "no signal": int((~has_signal).sum()),
                "limits": limits,
            }
            | {
                f"share of {name}": float((usable["verdict"] == name).mean())
                for name in possible
            }
        )

    def _recording_alarm(self, usable):
        """Alarm, p-value, and whether healthy limits hold."""
        within = usable[usable["limits"] == HOLD]
        if within.empty:
            return "-", np.nan, "" if usable.empty else usable["limits"].mode()[0]
        p_value = evidence.combined_p_value(within.get("p-value", _NOTHING))
        exceeds = p_value < self.alarm_rate
        if np.isnan(p_value):
            exceeds = within["alarm"].astype(float).mean() > _MOST_WINDOWS
        recorded = within.get("probability of a recorded specimen", _NOTHING).median()
        limits = HOLD_FOR_RECORDED if recorded < _MOST_WINDOWS else HOLD
        limits = FEW_HEALTHY if self._has_few_healthy else limits
        return "yes" if exceeds else "no", p_value, limits

    def _recording_condition(self, usable, answer):
        """Return the entries of the verdict, its probability and what it resembles."""
        is_clear = usable.get("probability of a comb", _NOTHING).median() > _CLEAR_COMB
        known = self._can.get("known")
        nothing = {"probability": np.nan}
        if known and answer["p-value of nearest"] < known.stated_rate and not is_clear:
            return {"verdict": UNKNOWN} | nothing
        if (usable["verdict"] == NOT_IDENTIFIABLE).mean() > _MOST_WINDOWS:
            return {"verdict": NOT_IDENTIFIABLE} | nothing
        names = self.conditions if "diagnoser" in self._can else []
        names = [*names, UNKNOWN] if "most like" in usable else names
        probability = usable[[f"probability of {name}" for name in names]]
        logs = np.log(probability.clip(lower=evidence.SMALLEST_PROBABILITY))
        found = self.named(
            logs.mean().to_numpy(), len(usable), answer["alarm"] == "yes"
        )
        entries = {"verdict": found.verdict, "probability": found.probability}
        return entries | (
            {"most like": found.most_like} if "most like" in usable else {}
        )

    def named(self, mean: NDArray[Any], n_windows: float, alarm: bool | None) -> Named:
        """Return the verdict by the mean log probabilities of windows, and the alarm.

        Parameters
        ----------
        mean : ndarray of shape (n_conditions,) or (n_conditions + 1,)
            Of the conditions, and of an unknown one if the classifier states it. Empty
            without a classifier.
        n_windows : float
            Number of windows, or the sum of their weights.
        alarm : bool or None
            Whether healthy limits are exceeded.

        Returns
        -------
        Named
            The verdict; "changed" instead of the healthy condition with an alarm.
        """
        found = Named(self.healthy, np.nan, None)
        if "diagnoser" in self._can:
            scores = evidence.effective_number(n_windows) * mean
            every = np.exp(scores - np.logaddexp.reduce(scores))
            n = len(self.conditions)
            found = self._names.name(every[:n], float(every[n:].sum()))
        return self._changed(found, alarm)

    def gathered(self, found: Bunch, alarm: bool | None) -> Named:
        """Return the verdict by the combs of several windows, and the alarm.

        Parameters
        ----------
        found : Bunch
            As `FaultOrderClassifier.diagnose_gathered` returns it.
        alarm : bool or None
            Whether healthy limits are exceeded.

        Returns
        -------
        Named
            As `named` returns it.
        """
        if "named" in found:
            verdict = found.named[0]
            is_condition = verdict in self.conditions
            probability = float(found.probability.max()) if is_condition else np.nan
            return self._changed(Named(verdict, probability, None), alarm)
        every = np.exp(found.log_probability[0, [*self._order(), -1]])
        return self._changed(self._names.name(every[:-1], float(every[-1])), alarm)

    def _changed(self, found, alarm):
        """Return "changed" instead of the healthy condition if healthy limits are exceeded."""
        is_changed = alarm and found.verdict == self.healthy
        return Named(CHANGED, np.nan, None) if is_changed else found

    def _order(self):
        """Return the place of each condition among those of the classifier."""
        return [
            self._can["diagnoser"].conditions.index(name) for name in self.conditions
        ]


def _of_all_rows(values, rows):
    """Return values of some rows for all rows; the others are NaN."""
    every = np.full((len(rows), *values.shape[1:]), np.nan, dtype=values.dtype)
    every[rows] = values
    return every


def window_verdicts(
    diagnoser: Pipeline,
    X: NDArray[Any],
    conditions: list[str] | None = None,
    rpm: ArrayLike | None = None,
    **options: Any,
) -> pd.DataFrame:
    """Return the verdict of a diagnoser on each window.

    Use :func:`recording_verdicts` instead for one answer from all windows of a
    recording. Windows that carry no signal (see :func:`skarxlag.signal_quality`) are
    not diagnosed.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted: a classifier with probabilities, or a detector.
    X : ndarray of shape (n_windows, ...)
        Windows; NaN is allowed, and is no signal.
    conditions : sequence of label, default=None
        Order of the conditions, the healthy one first: a permutation of those of the
        diagnoser. For a detector alone, the name of the healthy condition. None:
        sorted, or ``["healthy"]``.
    rpm : float, array-like of shape (n_windows,) or (n_windows, n_samples), default=None
        Speed of each window, or at each of its samples if it varies. Windows in which
        it varies by more than a factor of 5 get no verdict. None: it is not known.
    **options
        ``known``: what :func:`skarxlag.make_known_conditions` made, fitted on windows
        of the same shape. ``detector``: what :func:`skarxlag.make_detector` made,
        fitted on windows of the same shape; its healthy limits replace the detection
        threshold of the diagnoser. ``train_rpm``: training speeds, by default those
        that the models state; windows whose stated speed lies farther than a factor of
        5 outside them get no verdict. ``sampling_rate`` in Hz, to find mains hum, by
        default that of the models.

    Returns
    -------
    DataFrame
        ``verdict``: as of `recording_verdicts`, of a detector alone the healthy
        condition or ``"changed"``; ``"no signal"``; or ``"no verdict: ..."`` with the
        reason. ``alarm``: whether the healthy limits are exceeded, NaN if this is not
        known; ``quality`` and ``quality share``, as :func:`skarxlag.signal_quality`
        returns them, of several outputs with the name of the first bad one, such as
        ``"constant in output 2"``; ``limits``: ``"hold"``, or why the healthy limits do
        not hold at this speed. With a detector, ``score``, the logarithm of the p-value
        over the false-alarm rate, and ``p-value``, the probability that a healthy
        window deviates as much. Of a classifier, ``probability of`` each condition; if
        it states it, that of ``unknown condition``, too, with which they sum to 1,
        ``probability of a recorded specimen``, and ``most like``. With `known`,
        ``p-value of nearest`` condition. Of a diagnoser that has a bearing,
        ``evidence``: a sentence on the combs, and the verdict can be ``"not
        identifiable"``, see `FaultOrderClassifier.diagnose`; if it learned conditions,
        too, ``probability of a comb``: that of a fault by combs alone, else
        ``p-value``, that of the strongest comb.

    Raises
    ------
    ValueError
        If `conditions` is no permutation, a condition is named like another verdict, or
        `rpm` does not fit the windows.

    Examples
    --------
    >>> import warnings
    >>> from skarxlag import make_detector
    >>> X = np.random.default_rng(0).normal(size=(40, 400))
    >>> with warnings.catch_warnings(action="ignore"):  # the speed is not known
    ...     detector = make_detector(false_alarm_rate=0.1, fixed_gain=True).fit(X)
    >>> new = np.stack([X[0], 9 * X[1], 0 * X[2]])
    >>> window_verdicts(detector, new)["verdict"].tolist()
    ['healthy', 'changed', 'no signal']
    """
    return Judge(diagnoser, conditions=conditions, **options).windows(X, rpm)


def recording_verdicts(
    diagnoser: Pipeline,
    X: NDArray[Any],
    recording: ArrayLike,
    conditions: list[str] | None = None,
    *,
    rpm: ArrayLike | None = None,
    **options: Any,
) -> pd.DataFrame:
    r"""Return one answer for each recording, from its windows.

    The verdict is, in this order,

    - ``"no signal"`` if no window carries a signal, or ``"no verdict: ..."`` with the
      reason, such as an implausible speed;
    - ``"unknown condition"`` if the recording resembles no condition (with `known`),
      and combs of the bearing, if the diagnoser uses them, show no place of a fault;
    - ``"not identifiable"`` if most windows are, see `FaultOrderClassifier.diagnose`;
    - ``"unknown condition"`` if that is more probable than a healthy condition and than
      a fault, for diagnosers that state its probability;
    - the healthy condition, if it is more probable than a fault;
    - ``"faulty, place uncertain"`` if several places of a bearing are probable;
    - the place of the fault, such as ``"inner race"``, or the condition, if it is the
      only one of its place or if `fit` had several specimens of each condition of the
      place;
    - but ``"changed"`` instead of the healthy condition if the healthy limits are
      exceeded.

    Windows of a recording share specimen, mounting and load, so they are no independent
    evidence. With a correlation :math:`\varrho`, n windows count as :math:`n_e = n / (1
    + (n - 1) \varrho)`: the probabilities are the softmax of :math:`n_e` times the mean
    log probability (:math:`\varrho = 0.7`), and p-values are combined by Stouffer's
    method for correlated tests (:math:`\varrho = 0.8` for healthy limits, 0.5 for the
    nearest condition).

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted: a classifier with probabilities, or a detector.
    X : ndarray of shape (n_windows, ...)
        Windows.
    recording : array-like of shape (n_windows,)
        Identifier of the recording of each window.
    conditions, rpm, **options
        As in `window_verdicts`.

    Returns
    -------
    DataFrame
        One row for each recording, in order of appearance. ``verdict``; ``probability``
        of the verdict, NaN if it has none; ``most like``, for diagnosers that state the
        probability of an unknown condition: the most similar condition of the place, or
        the places of an uncertain fault; ``alarm``: ``"yes"`` if the healthy limits are
        exceeded, ``"no"`` if not, ``"-"`` if they do not hold at this speed;
        ``p-value``: probability that a healthy recording deviates as much, NaN if it is
        not known; with `known`, ``p-value of nearest`` condition; ``windows``, how many
        there are; ``no signal``, how many of them carry none; ``limits``: ``"hold"``,
        for which recordings they hold, or why healthy limits do not hold; and ``share
        of`` the windows with a signal that got each verdict.

    Raises
    ------
    ValueError
        If `recording` does not have an identifier for each window, or as in
        `window_verdicts`.

    Examples
    --------
    >>> from skarxlag import make_diagnoser
    >>> rng = np.random.default_rng(0)
    >>> white, coloured = rng.normal(size=(20, 400)), rng.normal(size=(20, 400)).cumsum(axis=1)
    >>> X, y = np.concatenate([white, coloured]), np.repeat(["good", "worn"], 20)
    >>> run = np.repeat(["run 1", "run 2"], 20)
    >>> diagnoser = make_diagnoser(healthy="good").fit(X, y)
    >>> found = recording_verdicts(diagnoser, X, run, rpm=900, train_rpm=[900])
    >>> found[["verdict", "alarm"]]
          verdict alarm
    run 1    good    no
    run 2    worn   yes
    """
    check_consistent_length(X, recording)
    # NumPy would make texts of numbers beside texts, and rows of pairs.
    recording = pd.Series(recording).to_numpy()
    place = pd.isna(recording).argmax()
    expect(
        pd.notna(recording), f"recording[{place}]", recording[place], "an identifier"
    )
    judge = Judge(diagnoser, conditions=conditions, **options)
    groups = judge.windows(X, rpm).groupby(recording, sort=False)
    rows = {name: judge.recording(windows) for name, windows in groups}
    return pd.DataFrame.from_dict(rows, orient="index")
