"""States of monitors, in files that are safe to load."""

import json
import os
from pathlib import Path
from typing import Any

from ..core.state import expect
from ..monitoring import ConditionMonitor
from .files import errors_named, write_atomically

_FORMAT = "skarxlag monitor 11"
#: Largest file of a state in bytes. That of one window of a million samples is smaller.
_LARGEST = 100 * 2**20


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
        Facts that `load_monitor_state` returns with the state, such as the source, its
        channel and the offset in it. Compare them before the monitor continues with a
        source.

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


def load_monitor_state(
    path: str | os.PathLike[str],
) -> tuple[dict[str, Any], dict[str, Any]]:
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
    with errors_named(path, "state of a monitor"):
        n_bytes = Path(path).stat().st_size
        expect(
            n_bytes <= _LARGEST,
            "Number of bytes",
            n_bytes,
            f"at most {_LARGEST}",
        )
        content = json.loads(Path(path).read_bytes())
        expect(
            content["format"] == _FORMAT,
            "format",
            content["format"],
            _FORMAT,
        )
        return dict(content["state"]), dict(content["facts"])
