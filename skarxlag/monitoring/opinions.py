"""What a diagnoser and a detector say of windows, in one pass."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._answers import answers
from ..pipelines import in_one_pass

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
        if diagnoser is not None and not answers(diagnoser).states_probabilities:
            raise ValueError(
                f"diagnoser: {type(diagnoser).__name__} states no probabilities, expected a "
                "classifier with predict_proba; a detector goes to the parameter detector"
            )
        self._diagnoser, self._detector = diagnoser, detector if detects else None
        self.conditions = [] if diagnoser is None else list(answers(diagnoser).conditions)
        flagging = answers(diagnoser if self._detector is None else self._detector)
        self.detects = detects and flagging.alarm
        self.false_alarm_rate = flagging.stated_rate if self.detects else None

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
            said = _diagnosed(self._diagnoser, windows, rpm)
            found.log_probability = np.log(np.maximum(said.probability, _SMALLEST_PROBABILITY))
            found.exceeds = said.get("alarm") if self.detects else None
        if self._detector is not None:
            found.exceeds = _diagnosed(self._detector, windows, rpm).alarm
        return found


def _diagnosed(model, windows, rpm):
    params = {"rpm": rpm} if rpm is not None and answers(model).takes_rpm else {}
    return in_one_pass(model).diagnose(windows, **params)
