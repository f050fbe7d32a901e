"""The state of a monitor in a file."""

import io
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from .._files import write_atomically

if TYPE_CHECKING:
    from .monitor import ConditionMonitor


_FORMAT = "skarxlag monitor 1"


def save_monitor_state(
    monitor: "ConditionMonitor", path: str | os.PathLike[str], /, **facts: Any
) -> None:
    """Write the state of a monitor and facts about it, all or nothing.

    The file is an ``.npz`` archive of one text (JSON) and one or two arrays of samples. The
    diagnoser is not in it.

    Parameters
    ----------
    monitor : ConditionMonitor
        The monitor.
    path : str or path-like
        The file; an existing one is replaced.
    **facts : str, int, float, None, or list of these
        What `load_monitor_state` shall return beside the state, such as the place in a file that is
        being read.

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
    rests = {"rest": _without_rest(state)}
    if state["own"] is not None:
        rests["own_rest"] = _without_rest(state["own"])
    text = json.dumps({"format": _FORMAT, "facts": facts} | state)
    archive = io.BytesIO()
    np.savez(archive, state=np.array(text), **rests)
    write_atomically(path, archive.getvalue())


def load_monitor_state(path: str | os.PathLike[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read what `save_monitor_state` wrote.

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
        If the file holds no such state. No code comes from it.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with ZipFile(path) as archive:
            # What `save_monitor_state` writes is not compressed.
            if sum(member.file_size for member in archive.infolist()) > path.stat().st_size:
                raise ValueError("it is compressed")
        with np.load(path, allow_pickle=False) as archive:
            state = json.loads(str(archive["state"]))
            if state.pop("format") != _FORMAT:
                raise ValueError(f"expected the format {_FORMAT!r}")
            facts = dict(state.pop("facts"))
            for own, name in ((state, "rest"), (state.get("own"), "own_rest")):
                if own is not None:
                    own["stream"]["rest"] = archive[name] if own["stream"]["rest"] else None
    except (
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        EOFError,
        OSError,
        NotImplementedError,
        BadZipFile,
    ) as error:
        raise ValueError(f"{path}: no state of a monitor ({error})") from error
    return state, facts


def _without_rest(state):
    """The samples that wait, which the state then only says that there are."""
    rest = state["stream"]["rest"]
    state["stream"] = state["stream"] | {"rest": rest is not None}
    return np.empty((0, 0)) if rest is None else rest
