"""One answer for each recording, from its windows."""

from __future__ import annotations

from typing import Any

import pandas as pd
from numpy.typing import ArrayLike, NDArray
from sklearn.pipeline import Pipeline
from sklearn.utils import check_consistent_length

from ..core.state import expect
from .judge import Judge


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
        identifiable"`` or ``"no fault pattern found"``, see
        `FaultOrderClassifier.diagnose`; ``dB of`` each fault location, the contrast of
        its comb; if it learned conditions, too, ``probability of
        a comb``: that of a fault by combs alone, else ``p-value``, that of the
        strongest comb.

    Raises
    ------
    ValueError
        If `conditions` is no permutation, a condition is named like another verdict, or
        `rpm` does not fit the windows.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np
    >>> from skarxlag import make_detector
    >>> X = np.random.default_rng(0).normal(size=(40, 400))
    >>> with warnings.catch_warnings(action="ignore"):  # the speed is not known
    ...     detector = make_detector(false_alarm_rate=0.1, fixed_gain=True).fit(X)
    >>> new = np.stack([X[0], 9 * X[1], 0 * X[2]])
    >>> window_verdicts(detector, new)["verdict"].tolist()
    ['healthy', 'changed', 'no signal']
    """
    judge = Judge(diagnoser, conditions=conditions, **options)
    return judge.window_results(X, rpm).table()


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
      and combs of the bearing, if the diagnoser uses them, show no location of a fault;
    - ``"not identifiable"`` if the combs of two fault locations fit nearly as well, see
      `FaultOrderClassifier.diagnose`;
    - ``"unknown condition"`` if that is more probable than a healthy condition and than
      a fault, for diagnosers that state its probability;
    - the healthy condition, if it is more probable than a fault; ``"no fault pattern
      found"`` instead if combs decide alone, and `fit` had no healthy recording;
    - ``"faulty, location uncertain"`` if several locations of a bearing are probable;
    - the location of the fault, such as ``"inner race"``, or the condition, if it is the
      only one of its location or if `fit` had several specimens of each condition of the
      location;
    - but ``"changed"`` instead of the healthy condition if the healthy limits are
      exceeded.

    Windows of a recording share specimen, mounting and load, so they are no independent
    evidence. A diagnoser of `make_diagnoser` is asked once for a recording, about the
    mean logarithms of the residuals of its windows, see
    :func:`skarxlag.kernels.posterior.condition_log_probabilities`, and one by combs
    alone about the mean of their scores. With a correlation
    :math:`\varrho`, n windows count as :math:`n_e = n / (1 + (n - 1) \varrho)`: the
    probabilities of other classifiers are the softmax of :math:`n_e` times the mean log
    probability (:math:`\varrho = 0.7`), and p-values are combined by Stouffer's method
    for correlated tests (:math:`\varrho = 0.8` for healthy limits, 0.5 for the nearest
    condition).

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
        probability of an unknown condition: the most similar condition of the location, or
        the locations of an uncertain fault; ``alarm``: ``"yes"`` if the healthy limits are
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
    >>> import numpy as np
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
    # NumPy would make texts of numbers next to texts, and rows of pairs.
    recording = pd.Series(recording).to_numpy()
    place = pd.isna(recording).argmax()
    expect(
        pd.notna(recording), f"recording[{place}]", recording[place], "an identifier"
    )
    judge = Judge(diagnoser, conditions=conditions, **options)
    results = judge.window_results(X, rpm)
    answers = {
        name: judge.recording(windows, results.evidence[windows.index])
        for name, windows in results.table().groupby(recording, sort=False)
    }
    return pd.DataFrame.from_dict(answers, orient="index")
