"""What a diagnoser and a detector say of windows, in one pass."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..pipelines import DiagnosisPipeline

#: Below it a single window could veto a condition for a long time.
_SMALLEST_PROBABILITY = 1e-6


@dataclass
class Opinions:
    """What is said of some windows.

    Parameters
    ----------
    log_probability : ndarray of shape (n_windows, n_conditions) or None, default=None
        None where nobody tells conditions apart.
    exceeds : ndarray of bool of shape (n_windows,) or None, default=None
        None where nobody detects.
    """

    log_probability: np.ndarray | None = None
    exceeds: np.ndarray | None = None

    def window(self, i: int | np.integer | None) -> tuple[NDArray[Any] | None, bool | None]:
        """Both opinions on one window; None for no window."""
        return (
            None if i is None or self.log_probability is None else self.log_probability[i],
            None if i is None or self.exceeds is None else bool(self.exceeds[i]),
        )


class WindowOpinions:
    """What a diagnoser and a detector say of windows.

    Parameters
    ----------
    diagnoser : fitted classifier or None
        States probabilities of conditions.
    detector : fitted Pipeline or None
        Flags windows. None: the diagnoser, where it detects.
    detects : bool, default=True
        Whether windows shall be flagged.

    Attributes
    ----------
    conditions : list
        Of the diagnoser; empty where there is none.
    detects : bool
        Whether windows are flagged.
    false_alarm_rate : float or None
        Share of healthy windows that may be flagged, as the one who flags was fitted for.

    Raises
    ------
    ValueError
        If there is neither, or the diagnoser states no probabilities.
    """

    conditions: list[Any]
    detects: bool
    false_alarm_rate: float | None

    def __init__(self, diagnoser: Any, detector: Any, detects: bool = True) -> None:
        if diagnoser is None and detector is None:
            raise ValueError("diagnoser and detector are None, expected at least one of them")
        if diagnoser is not None and not hasattr(diagnoser, "predict_proba"):
            raise ValueError(
                f"diagnoser: {type(diagnoser).__name__} states no probabilities, expected a "
                "classifier with predict_proba; a detector goes to the parameter detector"
            )
        self._diagnoser = in_one_pass(diagnoser)
        self._detector = in_one_pass(detector) if detects else None
        self.conditions = [] if diagnoser is None else np.asarray(diagnoser.classes_).tolist()
        flagging = self._diagnoser if self._detector is None else self._detector
        last = flagging.steps[-1][1]
        self.detects = detects and (detector is not None or hasattr(last, "detect"))
        self.false_alarm_rate = getattr(last, "false_alarm_rate", None) if self.detects else None

    def of(self, windows: NDArray[Any], rpm: NDArray[Any] | None) -> Opinions:
        """Opinions on windows.

        Parameters
        ----------
        windows : ndarray of shape (n_windows, window_length) or (n_windows, n_channels, ...)
            Windows that carry a signal.
        rpm : ndarray of shape (n_windows,) or None
            Speed of each, for those who ask for it.

        Returns
        -------
        Opinions
            What they say.
        """
        found = Opinions()
        if len(windows) == 0:
            return found
        if self._diagnoser is not None:
            said = self._diagnoser.diagnose(windows, **_metadata(self._diagnoser, rpm))
            found.log_probability = np.log(np.maximum(said.probability, _SMALLEST_PROBABILITY))
            found.exceeds = said.get("alarm") if self.detects else None
        if self._detector is not None:
            said = self._detector.diagnose(windows, **_metadata(self._detector, rpm))
            found.exceeds = said.alarm
        return found


def in_one_pass(estimator: Any) -> DiagnosisPipeline | None:
    """The estimator as a pipeline that gives all it has to say in one pass; None for None."""
    if estimator is None or isinstance(estimator, DiagnosisPipeline):
        return estimator
    return DiagnosisPipeline(getattr(estimator, "steps", [("decide", estimator)]))


def _metadata(pipeline, rpm):
    if rpm is None or not pipeline.get_metadata_routing().consumes("predict", {"rpm"}):
        return {}
    return {"rpm": rpm}
