"""The state of a monitor in a file."""

import io
import json
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from .._files import write_atomically

_FORMAT = "skarxlag monitor 1"


def save_monitor_state(monitor, path):
    """Write the state of a monitor, all or nothing.

    The file is an ``.npz`` archive of one text (JSON) and one array. The diagnoser is not in it.

    Parameters
    ----------
    monitor : ConditionMonitor
        The monitor.
    path : str or path-like
        The file; an existing one is replaced.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import os, tempfile
    >>> from skarxlag import ConditionMonitor, make_detector
    >>> X = np.random.default_rng(0).normal(size=(50, 1200))
    >>> detector = make_detector().fit(X)
    >>> monitor = ConditionMonitor(None, 20e3, detector=detector)
    >>> _ = monitor.update(X[0, :700])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "monitor.npz")
    ...     save_monitor_state(monitor, path)
    ...     again = ConditionMonitor(None, 20e3, detector=detector)
    ...     _ = again.restore(load_monitor_state(path))
    >>> again.counts["samples"]
    700
    """
    state = monitor.state()
    rest = state["stream"]["rest"]
    state["stream"] = state["stream"] | {"rest": rest is not None}
    text = json.dumps({"format": _FORMAT} | state)
    archive = io.BytesIO()
    np.savez(archive, state=np.array(text), rest=np.empty((0, 0)) if rest is None else rest)
    write_atomically(path, archive.getvalue())


def load_monitor_state(path):
    """Read what `save_monitor_state` wrote.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    dict
        For `ConditionMonitor.restore`, which checks that it fits.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file holds no such state. No code comes from it.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with np.load(path, allow_pickle=False) as archive:
            state, rest = json.loads(str(archive["state"])), archive["rest"]
        if state.pop("format") != _FORMAT:
            raise ValueError(f"expected the format {_FORMAT!r}")
        state["stream"]["rest"] = rest if state["stream"]["rest"] else None
    except (
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        EOFError,
        OSError,
        BadZipFile,
    ) as error:
        raise ValueError(f"{path}: no state of a monitor ({error})") from error
    return state
