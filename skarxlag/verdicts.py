"""From the windows of recordings to one verdict for each recording."""

import numpy as np
import pandas as pd
from scipy.special import softmax
from sklearn.utils import check_consistent_length

FAULTY = "faulty"
#: Below it a single window could veto a condition for the whole recording.
_SMALLEST_PROBABILITY = 1e-6


def window_verdicts(diagnoser, X, conditions=None):
    """What a diagnoser says of each window.

    Parameters
    ----------
    diagnoser : Pipeline
        Fitted; its last step is a ThresholdLadder or a FaultDetector.
    X : ndarray of shape (n_windows, ...)
        Windows.
    conditions : list of str or None, default=None
        Conditions that it was calibrated on, the healthy one first. None: those of the diagnoser,
        sorted; a detector calls what it does not flag "healthy".

    Returns
    -------
    DataFrame
        ``verdict``; ``alarm``, whether the detection threshold is exceeded; then ``probability
        of`` each condition, or ``score`` of a detector: threshold less level.
    """
    levels = diagnoser[:-1].transform(X)
    decide = diagnoser[-1]
    if conditions is None:
        conditions = _conditions(decide)
    if not hasattr(decide, "predict_proba"):
        score = decide.decision_function(levels)
        verdict = np.where(score < 0, FAULTY, conditions[0])
        return pd.DataFrame({"verdict": verdict, "alarm": score < 0, "score": score})
    probability = decide.predict_proba(levels)
    places = [decide.classes_.tolist().index(name) for name in conditions]
    return pd.DataFrame(
        {"verdict": decide.predict(levels), "alarm": decide.detect(levels)}
        | {
            f"probability of {name}": probability[:, place]
            for name, place in zip(conditions, places, strict=True)
        }
    )


def recording_verdict(windows, conditions):
    r"""One verdict from the windows of one recording.

    Evidence adds up: the condition of largest :math:`\sum_w \log p_w(c)` wins; a detector's
    verdict is the sign of the sum of scores. The confidence is the softmax of the *mean* of
    the log probabilities, that is what one typical window states: windows of a recording share its
    specimen and mounting, so as independent evidence they would feign certainty.

    Parameters
    ----------
    windows : DataFrame
        Rows of `window_verdicts`.
    conditions : list of str
        As there.

    Returns
    -------
    dict
        ``verdict``, ``confidence`` (NaN of a detector), ``windows``, ``alarms`` (share of
        windows), and ``share of`` each possible verdict.

    Examples
    --------
    >>> windows = pd.DataFrame({
    ...     "verdict": ["good", "good", "worn"], "alarm": [False, False, True],
    ...     "probability of good": [0.6, 0.6, 0.1], "probability of worn": [0.4, 0.4, 0.9],
    ... })
    >>> recording_verdict(windows, ["good", "worn"])["verdict"]
    'worn'
    """
    if "score" in windows:
        verdict = FAULTY if windows["score"].sum() < 0 else conditions[0]
        confidence, possible = np.nan, [conditions[0], FAULTY]
    else:
        columns = [f"probability of {name}" for name in conditions]
        evidence = np.log(windows[columns].clip(lower=_SMALLEST_PROBABILITY)).mean().to_numpy()
        best = int(evidence.argmax())
        verdict, confidence, possible = conditions[best], softmax(evidence)[best], conditions
    return {
        "verdict": verdict,
        "confidence": float(confidence),
        "windows": len(windows),
        "alarms": float(windows["alarm"].mean()),
    } | {f"share of {name}": float((windows["verdict"] == name).mean()) for name in possible}


def recording_verdicts(diagnoser, X, recording, conditions=None):
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
        conditions = _conditions(diagnoser[-1])
    windows = window_verdicts(diagnoser, X, conditions)
    groups = windows.groupby(np.asarray(recording), sort=False)
    rows = {name: recording_verdict(rows, conditions) for name, rows in groups}
    return pd.DataFrame.from_dict(rows, orient="index")


def _conditions(decide):
    return decide.classes_.tolist() if hasattr(decide, "classes_") else ["healthy"]
