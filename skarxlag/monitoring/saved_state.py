"""The state of a monitor in a file."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._files import write_atomically

if TYPE_CHECKING:
    from .monitor import ConditionMonitor

_FORMAT = "skarxlag monitor 5"
#: The state of one window of a million samples is smaller.
_MOST_BYTES = 100 * 2**20


def save_monitor_state(
    monitor: ConditionMonitor, path: str | os.PathLike[str], /, **facts: Any
) -> None:
    """Write the state of a monitor and facts about it, all or nothing.

    The file is JSON text. It does not contain the models.

    Parameters
    ----------
    monitor : ConditionMonitor
        The monitor.
    path : str or path-like
        The file; an existing one is replaced.
    **facts : str, int, float, None, or list of these
        Facts that `load_monitor_state` returns with the state, such as the source, its channel and
        the offset in it. Compare them before the monitor continues with a source.

    Raises
    ------
    TypeError
        If a fact cannot be written as JSON.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import os, tempfile, warnings
    >>> import numpy as np
    >>> from skarxlag import ConditionMonitor, make_detector
    >>> X = np.random.default_rng(0).normal(size=(100, 1200))
    >>> with warnings.catch_warnings(action="ignore"):  # the speed is not known
    ...     detector = make_detector().fit(X)
    >>> monitor = ConditionMonitor(None, 20e3, detector=detector)
    >>> _ = monitor.update(X[0, :700])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "monitor.json")
    ...     save_monitor_state(monitor, path, sensor="B 12")
    ...     state, facts = load_monitor_state(path)
    >>> again = ConditionMonitor(None, 20e3, detector=detector).restore(state)
    >>> again.counts["samples"], facts["sensor"]
    (700, 'B 12')
    """
    text = json.dumps({"format": _FORMAT, "facts": facts, "state": monitor.state()})
    write_atomically(path, text.encode())


def load_monitor_state(path: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read a file that `save_monitor_state` wrote.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    state : dict
        For `ConditionMonitor.restore`, which checks that it fits.
    facts : dict
        As given to `save_monitor_state`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is not a state of a monitor. No code comes from it.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise ValueError(f"it is larger than {_MOST_BYTES} bytes")
        content = json.loads(path.read_bytes())
        if content["format"] != _FORMAT:
            raise ValueError(f"expected the format {_FORMAT!r}")
        return dict(content["state"]), dict(content["facts"])
    # Errors of parsers on damaged input are as varied as the damage, such as RecursionError.
    except Exception as error:
        raise ValueError(f"{path}: no state of a monitor ({error})") from error
