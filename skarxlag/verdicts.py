"""From the windows of recordings to one verdict for each recording."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.special import softmax
from sklearn.pipeline import Pipeline
from sklearn.utils import check_consistent_length

from ._answers import answers
from .pipelines import in_one_pass
from .quality import signal_quality

FAULTY = "faulty"
#: Verdict on a window, or on a recording, that carries no signal.
NO_SIGNAL = "no signal"
#: Below it a single window could veto a condition for the whole recording.
_SMALLEST_PROBABILITY = 1e-6


def window_verdicts(
    diagnoser: Pipeline,
    X: NDArray[Any],
    conditions: list[str] | None = None,
    rpm: ArrayLike | None = None,
    known: Pipeline | None = None,
) -> pd.DataFrame:
    """What a diagnoser says of each window.

    Windows that carry no signal (see :func:`skarxlag.signal_quality`) are not shown to the
    diagnoser: their verdict is "no signal".

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted; its last step is a ThresholdLadder or a FaultDetector.
    X : ndarray of shape (n_windows, ...)
        Windows; NaN is allowed, and is no signal.
    conditions : list of str or None, default=None
        Conditions that it was calibrated on, the healthy one first. None: those of the diagnoser,
        sorted; a detector calls what it does not flag "healthy".
    rpm : float or array-like of shape (n_windows,), default=None
        Speed of each window, for the steps that request it by metadata routing. A diagnoser
        without such a step ignores it.
    known : estimator or None, default=None
        What :func:`skarxlag.make_known_conditions` made, fitted on windows of the same shape.

    Returns
    -------
    DataFrame
        ``verdict``; ``alarm``, whether the detection threshold is exceeded, NaN of a diagnoser that
        has none; ``quality``, as
        :func:`skarxlag.signal_quality` names it; then ``probability of`` each condition, or
        ``score`` of a detector: the logarithm of the p-value over the false-alarm rate; and, with
        `known`, ``p-value`` of the nearest condition. Without a signal these are NaN, and the alarm
        is False.

    Examples
    --------
    >>> import warnings
    >>> from skarxlag import make_detector
    >>> X = np.random.default_rng(0).normal(size=(40, 400))
    >>> with warnings.catch_warnings(action="ignore"):  # the speed is not known
    ...     detector = make_detector(false_alarm_rate=0.1, fixed_gain=True).fit(X)
    >>> new = np.stack([X[0], 9 * X[1], 0 * X[2]])
    >>> window_verdicts(detector, new)["verdict"].tolist()
    ['healthy', 'faulty', 'no signal']
    """
    quality = signal_quality(X)
    is_good = quality == "good"
    can, diagnoser = answers(diagnoser), in_one_pass(diagnoser)
    if conditions is None:
        conditions = _conditions(can)
    has_score = can.conditions is None
    names = ["score"] if has_score else [f"probability of {name}" for name in conditions]
    verdict = np.full(len(quality), NO_SIGNAL, dtype=object)
    alarm = np.zeros(len(quality), dtype=bool if can.alarm else float)
    values = np.full((len(quality), len(names)), np.nan)
    if is_good.any():
        of_good = _scored if has_score else _classified
        X = X if is_good.all() else np.asarray(X)[is_good]
        params = {}
        if rpm is not None and can.takes_rpm:
            params["rpm"] = np.broadcast_to(rpm, is_good.shape)[is_good]
        found = of_good(diagnoser, X, conditions, params)
        verdict[is_good], alarm[is_good], values[is_good] = found
    if not can.alarm:
        alarm[:] = np.nan
    columns = dict(zip(names, values.T, strict=True))
    if known is not None:
        p_value = np.full(len(quality), np.nan)
        if is_good.any():
            params = {}
            if rpm is not None and answers(known).takes_rpm:
                params["rpm"] = np.broadcast_to(rpm, is_good.shape)[is_good]
            p_value[is_good] = np.exp(known.score_samples(X, **params))
        columns["p-value"] = p_value
    return pd.DataFrame({"verdict": verdict, "alarm": alarm, "quality": quality} | columns)


def _scored(diagnoser, X, conditions, params):
    """Verdicts, alarms and scores of a detector."""
    score = diagnoser.decision_function(X, **params)
    return np.where(score < 0, FAULTY, conditions[0]), score < 0, score[:, np.newaxis]


def _classified(diagnoser, X, conditions, params):
    """Verdicts, alarms and probabilities of a diagnoser."""
    found = diagnoser.diagnose(X, **params)
    places = [diagnoser.classes_.tolist().index(name) for name in conditions]
    return found.verdict, found.get("alarm", np.nan), found.probability[:, places]


def recording_verdict(
    windows: pd.DataFrame, conditions: list[str], false_rejection_rate: float = 0.01
) -> dict[str, Any]:
    r"""One verdict from the windows of one recording.

    Evidence adds up: the condition of largest :math:`\sum_w \log p_w(c)` wins; a detector's
    verdict is the sign of the sum of scores. The confidence is the softmax of the *mean* of
    the log probabilities, that is what one typical window states: windows of a recording share its
    specimen and mounting, so as independent evidence they would feign certainty.

    The p-value of the nearest condition is the median over windows. Below the stated rate the
    recording is "none of these". Windows share their errors, so the median is rejected about as
    often as one of them: never more than twice as often, however they depend on each other.

    Only windows that carry a signal count. Where there is none the verdict is "no signal".

    Parameters
    ----------
    windows : DataFrame
        Rows of `window_verdicts`.
    conditions : list of str
        As there.
    false_rejection_rate : float, default=0.01
        Share in (0, 1) of recordings of a known condition that may be called none of these.

    Returns
    -------
    dict
        ``verdict``; ``confidence`` (NaN of a detector); ``windows``, how many there are;
        ``no signal``, how many of them carry none; then, as shares of the windows that do,
        ``alarms`` and ``share of`` each possible verdict (NaN if there is no such window); and,
        where `windows` has a p-value, ``p-value`` and ``none of these`` (None if there is no such
        window).

    Examples
    --------
    >>> windows = pd.DataFrame({
    ...     "verdict": ["good", "good", "worn", "no signal"],
    ...     "alarm": [False, False, True, False],
    ...     "quality": ["good", "good", "good", "constant"],
    ...     "probability of good": [0.6, 0.6, 0.1, np.nan],
    ...     "probability of worn": [0.4, 0.4, 0.9, np.nan],
    ... })
    >>> verdict = recording_verdict(windows, ["good", "worn"])
    >>> verdict["verdict"], verdict["no signal"], round(verdict["alarms"], 3)
    ('worn', 1, 0.333)
    """
    usable = windows[windows["quality"] == "good"]
    is_scored = "score" in windows
    possible = [conditions[0], FAULTY] if is_scored else conditions
    confidence = np.nan
    if usable.empty:
        verdict = NO_SIGNAL
    elif is_scored:
        verdict = FAULTY if usable["score"].sum() < 0 else conditions[0]
    else:
        columns = [f"probability of {name}" for name in conditions]
        evidence = np.log(usable[columns].clip(lower=_SMALLEST_PROBABILITY)).mean().to_numpy()
        best = int(evidence.argmax())
        verdict, confidence = conditions[best], softmax(evidence)[best]
    known = {}
    if "p-value" in windows:
        p_value = float(usable["p-value"].median())
        is_none = None if usable.empty else p_value < false_rejection_rate
        known = {"p-value": p_value, "none of these": is_none}
    return (
        {
            "verdict": verdict,
            "confidence": float(confidence),
            "windows": len(windows),
            "no signal": len(windows) - len(usable),
            "alarms": float(usable["alarm"].mean()),
        }
        | known
        | {f"share of {name}": float((usable["verdict"] == name).mean()) for name in possible}
    )


def recording_verdicts(
    diagnoser: Pipeline,
    X: NDArray[Any],
    recording: ArrayLike,
    conditions: list[str] | None = None,
    *,
    rpm: ArrayLike | None = None,
    known: Pipeline | None = None,
) -> pd.DataFrame:
    """One verdict for each recording, from windows of several recordings.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted; its last step is a ThresholdLadder or a FaultDetector.
    X : ndarray of shape (n_windows, ...)
        Windows.
    recording : array-like of shape (n_windows,)
        Recording of each window.
    conditions : list of str or None, default=None
        As in `window_verdicts`.
    rpm : float, array-like of shape (n_windows,) or None, default=None
        As in `window_verdicts`.
    known : estimator or None, default=None
        As in `window_verdicts`; its rate says which recordings are none of these.

    Returns
    -------
    DataFrame
        One row for each recording, in order of appearance; the columns are the entries that
        `recording_verdict` returns.

    Raises
    ------
    ValueError
        If `recording` does not have one entry for each window.

    Examples
    --------
    >>> from skarxlag import make_diagnoser
    >>> rng = np.random.default_rng(0)
    >>> white, coloured = rng.normal(size=(20, 400)), rng.normal(size=(20, 400)).cumsum(axis=1)
    >>> X, y = np.concatenate([white, coloured]), np.repeat(["good", "worn"], 20)
    >>> run = np.repeat(["run 1", "run 2"], 20)
    >>> recording_verdicts(make_diagnoser().fit(X, y), X, run)["verdict"].tolist()
    ['good', 'worn']
    """
    check_consistent_length(X, recording)
    if conditions is None:
        conditions = _conditions(answers(diagnoser))
    windows = window_verdicts(diagnoser, X, conditions, rpm=rpm, known=known)
    groups = windows.groupby(np.asarray(recording), sort=False)
    rate = {} if known is None else {"false_rejection_rate": answers(known).stated_rate}
    rows = {name: recording_verdict(rows, conditions, **rate) for name, rows in groups}
    return pd.DataFrame.from_dict(rows, orient="index")


def _conditions(can):
    return ["healthy"] if can.conditions is None else list(can.conditions)
