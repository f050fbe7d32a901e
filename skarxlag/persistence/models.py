"""Diagnosers in files that are safe to load."""

from __future__ import annotations

import copy
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import sklearn
from sklearn.pipeline import Pipeline

from .._version import __version__
from ..core.capabilities import capabilities, offers
from ..core.state import check_model_state, estimators_within, expect
from ..decisions.fault_detector import FaultDetector
from ..decisions.fusion import SensorFusion
from ..decisions.known_conditions import KnownConditions
from .archives import TRUSTED_TYPES, checked_schema, digest, sealed
from .facts import check_facts
from .files import errors_named, read_members, write_atomically

if TYPE_CHECKING:
    from sklearn.calibration import CalibratedClassifierCV

_FORMAT = "skarxlag diagnoser 1"
#: Models that are saved next to the diagnoser, and the field of `Capabilities` that each
#: must have.
_COMPANIONS = {"known_conditions": "none_of_these", "detector": "healthy_p_value"}


def save_diagnoser(
    diagnoser: Pipeline | CalibratedClassifierCV | SensorFusion,
    path: str | os.PathLike[str],
    /,
    *,
    known_conditions: Pipeline | KnownConditions | SensorFusion | None = None,
    detector: Pipeline | FaultDetector | SensorFusion | None = None,
    **facts: Any,
) -> None:
    """Save a fitted diagnoser and facts about it, all or nothing.

    The file is a skops archive. It is written under another name and then moved to its
    place, so no reader sees an incomplete file. Its comment is a SHA-256 of the
    contents, which reveals damage and careless edits; it is no signature.

    Parameters
    ----------
    diagnoser : Pipeline, CalibratedClassifierCV or SensorFusion
        A fitted pipeline of this package's estimators and of the scalers and linear
        models of scikit-learn that are in `TRUSTED_TYPES`; or such pipelines within
        `sklearn.calibration.CalibratedClassifierCV` or :class:`skarxlag.SensorFusion`.
        Its `memory` and its callbacks are not saved.
    path : str or path-like
        The file; an existing one is replaced.
    known_conditions : Pipeline, KnownConditions or None, default=None
        A fitted :func:`skarxlag.make_known_conditions`, which rejects rows that
        resemble none of the conditions.
    detector : Pipeline, FaultDetector or None, default=None
        A fitted :func:`skarxlag.make_detector`, which has the healthy limits.
    **facts : str, int, float, None, or list of these
        Facts that :func:`load_diagnoser` returns with the diagnoser. The commands use
        ``sampling_rate``, ``window_length``, ``n_channels``, ``train_rpm`` (a list of
        speeds) and ``conditions`` (a permutation of those of the diagnoser, the healthy
        one first). The versions of skarxlag and scikit-learn are added.

    Raises
    ------
    TypeError
        If a model is of another type, a model holds an object that is not in
        `TRUSTED_TYPES`, or a fact is of another type.
    ValueError
        If a fact cannot be true, contradicts the diagnoser, or has a character that is
        not printable.
    NotFittedError
        If a model is not fitted.
    OSError
        If the file cannot be written.
    ImportError
        If skops is not installed.

    Examples
    --------
    >>> import os, tempfile
    >>> import numpy as np
    >>> from skarxlag import make_alpio
    >>> X = np.random.default_rng(0).normal(size=(8, 600))
    >>> diagnoser = make_alpio().fit(X, np.repeat(["healthy", "worn"], 4))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "bearing.skops")
    ...     save_diagnoser(diagnoser, path, sampling_rate=20e3)
    ...     loaded, facts = load_diagnoser(path)
    >>> facts["sampling_rate"], bool(np.all(loaded.predict(X) == diagnoser.predict(X)))
    (20000.0, True)
    """
    models = {"known_conditions": known_conditions, "detector": detector}
    write_atomically(path, packed_diagnoser(diagnoser, models, facts))


def packed_diagnoser(
    diagnoser: Any, companions: dict[str, Any], facts: dict[str, Any]
) -> bytes:
    """Return the content of the file that `save_diagnoser` writes."""
    skops_io = _import_skops()
    facts |= {"skarxlag": __version__, "scikit-learn": sklearn.__version__}
    content = {"format": _FORMAT, "diagnoser": diagnoser, "facts": facts}
    content |= companions
    _check_content(content)
    content = {
        name: copy.deepcopy(value)
        for name, value in content.items()
        if value is not None
    }
    _remove_surroundings(content)
    archive = skops_io.dumps(content)
    checked_schema(read_members(archive)[0])
    return sealed(archive)


def _import_skops():
    try:
        import skops.io
    except ImportError as error:
        raise ImportError(
            "A model's file needs skops: pip install 'skarxlag[io]'"
        ) from error
    return skops.io


def load_diagnoser(
    path: str | os.PathLike[str],
) -> tuple[Pipeline | CalibratedClassifierCV | SensorFusion, dict[str, Any]]:
    """Load a diagnoser that :func:`save_diagnoser` wrote.

    No code comes from the file. The sizes that the file states are limited before it is
    unpacked. Its types are compared with `TRUSTED_TYPES`, and its contents with their
    SHA-256, before an object is built. Finally, parameters and fitted attributes of
    every step are checked: shapes, ranges, finite numbers.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    diagnoser : Pipeline, CalibratedClassifierCV or SensorFusion
        Fitted; it predicts what the saved one did, bit for bit.
    facts : dict
        As given to :func:`save_diagnoser`; ``"skarxlag"`` and ``"scikit-learn"`` are
        the versions that saved it. ``"known_conditions"`` and ``"detector"`` are the
        estimators, if they were saved.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is no diagnoser, is damaged or was edited, unpacks to more than 100
        MB and more than ten times its size, holds a type that is not trusted, a
        parameter or attribute out of its range, or a fact that cannot be true. The
        message names the file, and the type, the attribute or the fact.
    MemoryError
        If there is not enough memory to load it.
    ImportError
        If skops is not installed.

    Examples
    --------
    >>> import os, pickle, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "bearing.skops")
    ...     with open(path, "wb") as file:
    ...         pickle.dump("anything", file)
    ...     load_diagnoser(path)
    Traceback (most recent call last):
        ...
    ValueError: ...bearing.skops: no diagnoser saved by skarxlag (File is not a zip file)
    """
    with errors_named(path, "diagnoser saved by skarxlag"):
        archive = Path(path).read_bytes()
        members, comment = read_members(archive)
        checked_schema(members)
        if comment != digest(members):
            raise BadZipFile("it was changed after it was saved")
        content = _import_skops().loads(archive, trusted=TRUSTED_TYPES)
        _remove_surroundings(content)
        _check_content(content)
    companions = {name: content[name] for name in _COMPANIONS.keys() & content.keys()}
    return content["diagnoser"], content["facts"] | companions


def _check_content(content):
    """Raise an error that names the part of a file that is wrong."""
    expect(content["format"] == _FORMAT, "format", content["format"], repr(_FORMAT))
    diagnoser = content["diagnoser"]
    if not (
        isinstance(diagnoser, Pipeline | SensorFusion) or _is_calibrated(diagnoser)
    ):
        raise TypeError(
            f"diagnoser is a {type(diagnoser).__name__}, expected a Pipeline, a "
            "CalibratedClassifierCV or a SensorFusion"
        )
    check_model_state(diagnoser)
    check_facts(content["facts"], capabilities(diagnoser))
    for name, field in _COMPANIONS.items():
        model = content.get(name)
        if model is None:
            continue
        check_model_state(model)
        if not getattr(capabilities(model), field):
            raise TypeError(
                f"{name} is a {type(model).__name__}, expected the result of "
                f"make_{name}"
            )


def _is_calibrated(diagnoser):
    # This import takes longer than loading a model.
    from sklearn.calibration import CalibratedClassifierCV

    return isinstance(diagnoser, CalibratedClassifierCV)


def _remove_surroundings(content):
    """Remove the cache folders and callbacks of all models in a file."""
    for part in estimators_within(list(content.values())):
        if isinstance(part, Pipeline):
            part.memory = None
        # scikit-learn has callbacks from 1.9 on.
        if offers(part, "set_callbacks"):
            part.set_callbacks()
