"""The state of a monitor in a file."""

from __future__ import annotations

import io
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._archive import read_members, write_members
from .._files import write_atomically

if TYPE_CHECKING:
    from .monitor import ConditionMonitor

_FORMAT = "skarxlag monitor 2"


def save_monitor_state(
    monitor: ConditionMonitor, path: str | os.PathLike[str], /, **facts: Any
) -> None:
    """Write the state of a monitor and facts about it, all or nothing.

    The file is an uncompressed zip archive of a JSON text and an array of samples. It does not
    contain the models.

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
    >>> from skarxlag import ConditionMonitor, make_detector
    >>> X = np.random.default_rng(0).normal(size=(100, 1200))
    >>> with warnings.catch_warnings(action="ignore"):  # the speed is not known
    ...     detector = make_detector().fit(X)
    >>> monitor = ConditionMonitor(None, 20e3, detector=detector)
    >>> _ = monitor.update(X[0, :700])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "monitor.npz")
    ...     save_monitor_state(monitor, path, sensor="B 12")
    ...     state, facts = load_monitor_state(path)
    >>> again = ConditionMonitor(None, 20e3, detector=detector).restore(state)
    >>> again.counts["samples"], facts["sensor"]
    (700, 'B 12')
    """
    state = monitor.state()
    rest = state["stream"]["rest"]
    state["stream"] = state["stream"] | {"rest": rest is not None}
    array = io.BytesIO()
    np.lib.format.write_array(array, np.empty((0, 0)) if rest is None else rest)
    text = json.dumps({"format": _FORMAT, "facts": facts} | state)
    members = {"state.json": text.encode(), "rest.npy": array.getvalue()}
    write_atomically(path, write_members(members, b""))


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
        members, _ = read_members(path.read_bytes())
        state = json.loads(members["state.json"])
        if state.pop("format") != _FORMAT:
            raise ValueError(f"expected the format {_FORMAT!r}")
        facts = dict(state.pop("facts"))
        rest = np.lib.format.read_array(io.BytesIO(members["rest.npy"]), allow_pickle=False)
        state["stream"]["rest"] = rest if state["stream"]["rest"] else None
    # What parsers raise on damaged input is as varied as the damage: also MemoryError and
    # RecursionError.
    except Exception as error:
        raise ValueError(f"{path}: no state of a monitor ({error})") from error
    return state, facts
