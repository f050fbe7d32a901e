"""Diagnosers, and states of monitors, in files that are safe to load."""

from __future__ import annotations

import copy
import hashlib
import io
import json
import os
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

import sklearn
from sklearn.pipeline import Pipeline

from .._version import __version__
from ..core.capabilities import Capabilities, capabilities, offers
from ..core.files import read_members, write_atomically
from ..core.registry import ESTIMATORS
from ..core.state import check_model_state, check_number, estimators_within, expect
from ..decisions.fault_detector import FaultDetector
from ..decisions.fusion import SensorFusion
from ..decisions.known_conditions import KnownConditions
from ..monitoring import ConditionMonitor
from ..verdicts.names import check_conditions
from .saved_objects import PROTOCOLS, SavedObjects

if TYPE_CHECKING:
    from sklearn.calibration import CalibratedClassifierCV

#: Classes of scikit-learn that a model may contain next to the estimators of this
#: package: pipelines, calibration, scalers and linear models. They hold arrays and
#: plain values only.
_SCIKIT_LEARN_TYPES = {
    "sklearn.pipeline.Pipeline",
    "sklearn.frozen._frozen.FrozenEstimator",
    "sklearn.calibration.CalibratedClassifierCV",
    "sklearn.calibration._CalibratedClassifier",
    "sklearn.calibration._SigmoidCalibration",
    "sklearn.isotonic.IsotonicRegression",
    "sklearn.preprocessing._data.StandardScaler",
    "sklearn.preprocessing._data.RobustScaler",
    "sklearn.preprocessing._data.MinMaxScaler",
    "sklearn.preprocessing._data.MaxAbsScaler",
    "sklearn.preprocessing._data.Normalizer",
    "sklearn.preprocessing._data.PowerTransformer",
    "sklearn.preprocessing._label.LabelBinarizer",
    "sklearn.linear_model._logistic.LogisticRegression",
    "sklearn.linear_model._ridge.RidgeClassifier",
    "sklearn.linear_model._ridge.Ridge",
    "sklearn.linear_model._base.LinearRegression",
    "sklearn.discriminant_analysis.LinearDiscriminantAnalysis",
    "sklearn.svm._classes.LinearSVC",
}
#: Types of this package that a model may contain.
_OWN_TYPES = {f"skarxlag.{module}.{name}" for name, module in ESTIMATORS.items()} | {
    "skarxlag.bearings.geometry.BearingGeometry"
}
#: Types that a model file may contain, by the loader of skops that reads them. By
#: itself, skops would also build every estimator of scikit-learn and SciPy, functions
#: and methods.
TRUSTED_TYPES = {
    "ObjectNode": _SCIKIT_LEARN_TYPES | _OWN_TYPES,
    "NdArrayNode": {"numpy.ndarray", "numpy.float64", "numpy.int64", "numpy.str_"},
    "DictNode": {"builtins.dict"},
    "ListNode": {"builtins.list"},
    "TupleNode": {"builtins.tuple"},
    "JsonNode": {"builtins.str"},
    "TypeNode": {"builtins.str"},
}
#: Largest size of a schema in bytes. A model of ten conditions needs 30 kB.
_LONGEST_SCHEMA = 10 * 2**20
_FORMAT, _STATE_FORMAT = "skarxlag diagnoser 1", "skarxlag monitor 10"
#: Largest file of a state. That of one window of a million samples is smaller.
_LARGEST_STATE = 100 * 2**20
#: Models that are saved next to the diagnoser, and the field of `Capabilities` that each
#: must have.
_COMPANIONS = {"known_conditions": "none_of_these", "detector": "healthy_p_value"}
#: Facts with a meaning to the commands, by their type, or range and type. Any of them but
#: `conditions` may be None.
_KNOWN_FACTS: dict[str, Any] = {
    **dict.fromkeys(("diagnoser", "rows", "saved", "healthy", "bearing", "unit"), str),
    **dict.fromkeys(("window_length", "n_channels"), ("at least 1", int)),
    "sampling_rate": ("above 0", float),
    "false_alarm_rate": ("above 0 and below 1", float),
}
#: The same of facts that are lists. No row was recorded of some locations of faults.
_KNOWN_LISTS: dict[str, Any] = {
    **dict.fromkeys(("n_windows", "n_recordings"), ("at least 0", int)),
    **{"conditions": object, "channels": str | None, "channel_names": str},
    "train_rpm": ("above 0", float),
}


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
    skops_io = _import_skops()
    facts |= {"skarxlag": __version__, "scikit-learn": sklearn.__version__}
    content = {"format": _FORMAT, "diagnoser": diagnoser, "facts": facts}
    content |= {"known_conditions": known_conditions, "detector": detector}
    _check_content(content)
    content = {
        name: copy.deepcopy(value)
        for name, value in content.items()
        if value is not None
    }
    _remove_surroundings(content)
    archive = skops_io.dumps(content)
    _checked_schema(read_members(archive)[0])
    write_atomically(path, sealed(archive))


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
        message names the file, and the type, the attribute or the fact. Also if only a
        later version of skops reads the format of the file.

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
    with _errors_named(path, "diagnoser saved by skarxlag"):
        archive = Path(path).read_bytes()
        members, comment = read_members(archive)
        schema = _checked_schema(members)
        if comment != _digest(members):
            raise BadZipFile("it was changed after it was saved")
        if schema.get("protocol") in PROTOCOLS:
            content = SavedObjects(members).build(schema)
        else:
            trusted = sorted(TRUSTED_TYPES["ObjectNode"])
            content = _import_skops().loads(archive, trusted=trusted)
        _remove_surroundings(content)
        _check_content(content)
    companions = {name: content[name] for name in _COMPANIONS.keys() & content.keys()}
    return content["diagnoser"], content["facts"] | companions


@contextmanager
def _errors_named(path, expected):
    """Name the file in the errors of those who read it."""
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        yield
    # What a parser raises on damaged input is as varied as the damage, such as
    # RecursionError.
    except Exception as error:
        raise ValueError(f"{path}: no {expected} ({error})") from error


def _check_content(content):
    """Raise an error that names the part of a file that is wrong."""
    expect(content["format"] == _FORMAT, "format", content["format"], repr(_FORMAT))
    diagnoser, facts = content["diagnoser"], content["facts"]
    if not (
        isinstance(diagnoser, Pipeline | SensorFusion) or _is_calibrated(diagnoser)
    ):
        expected = "a Pipeline, a CalibratedClassifierCV or a SensorFusion"
        raise TypeError(
            f"diagnoser is a {type(diagnoser).__name__}, expected {expected}"
        )
    check_model_state(diagnoser)
    _check_facts(facts, capabilities(diagnoser))
    for name, question in _COMPANIONS.items():
        model = content.get(name)
        if model is not None:
            check_model_state(model)
            if not vars(capabilities(model))[question]:
                found = type(model).__name__
                raise TypeError(
                    f"{name} is a {found}, expected the result of make_{name}"
                )


def _is_calibrated(diagnoser):
    # This import takes longer than loading a model.
    from sklearn.calibration import CalibratedClassifierCV

    return isinstance(diagnoser, CalibratedClassifierCV)


def _check_facts(facts: dict[str, Any], can: Capabilities) -> None:
    """Check that facts are plain, can be true, and agree with the model."""
    for name, value in facts.items():
        entries = value if isinstance(value, list) else [value]
        for each in entries:
            if not isinstance(each, str | int | float | None):
                kind = f"holds a {type(each).__name__}, expected a text, number, None or a list"
                raise TypeError(f"{name}={value!r} {kind} of these")
        # Escape sequences could rewrite what a terminal shows.
        is_printable = all(str(text).isprintable() for text in (name, *entries))
        expect(is_printable, name, value, "printable characters")
        known = _KNOWN_LISTS if isinstance(value, list) else _KNOWN_FACTS
        if value is None or name not in _KNOWN_LISTS | _KNOWN_FACTS:
            continue
        expect(
            name in known,
            name,
            value,
            "a list" if name in _KNOWN_LISTS else "one value",
        )
        for each in entries:
            if isinstance(known[name], tuple):
                check_number(name, each, *known[name])
            else:
                expect(isinstance(each, known[name]), name, each, "a text")
    for name, own in {
        "window_length": can.window_length,
        "n_channels": can.n_channels,
    }.items():
        stated = facts.get(name)
        expect(own is None or stated in (None, own), name, stated, f"{own} as in fit")
    lengths = dict.fromkeys(
        ("n_windows", "n_recordings"), len(can.conditions or ["healthy"])
    )
    for name, n in (lengths | {"channels": can.n_channels}).items():
        expect(
            len(facts.get(name) or ()) in (0, n), name, facts.get(name), f"{n} entries"
        )
    if "conditions" in facts:
        check_conditions(facts["conditions"] or [], can.conditions)
    healthy, (first, *_) = facts.get("healthy"), facts.get("conditions", [can.healthy])
    expect(
        healthy in (None, first),
        "healthy",
        healthy,
        f"{first!r}, the first of conditions",
    )
    is_printable = all(str(name).isprintable() for name in can.conditions or ())
    expect(is_printable, "conditions", can.conditions, "printable characters")


def _remove_surroundings(content):
    """Remove the cache folders and callbacks of all models in a file."""
    for part in estimators_within(list(content.values())):
        if isinstance(part, Pipeline):
            part.memory = None
        # scikit-learn has callbacks from 1.9 on.
        if offers(part, "set_callbacks"):
            part.set_callbacks()


def _checked_schema(members):
    """Return the schema, all types of which are trusted; raise an error if it is another one."""
    content = members["schema.json"]
    if len(content) > _LONGEST_SCHEMA:
        raise BadZipFile(f"its schema.json has {len(content):,} bytes")
    foreign = []

    def note_type(node):
        name = f"{node.get('__module__')}.{node.get('__class__')}"
        loader = node.get("__loader__")
        if loader is not None and name not in TRUSTED_TYPES.get(loader, ()):
            foreign.append(f"{name} ({loader})")
        return node

    schema = json.loads(content, object_hook=note_type)
    if not isinstance(schema, dict) or "__loader__" not in schema:
        raise BadZipFile("its schema.json is not that of skops")
    if foreign:
        # A type is noted after the types inside it.
        raise TypeError(f"it holds a {foreign[-1]}, which no diagnoser needs")
    return schema


def sealed(archive: bytes) -> bytes:
    """Return an archive with the SHA-256 of its members as its comment."""
    stream = io.BytesIO(archive)
    with ZipFile(stream, "a") as file:
        file.comment = _digest(read_members(archive)[0])
    return stream.getvalue()


def _digest(members):
    """Return the SHA-256 of the names and contents of all members."""
    whole = hashlib.sha256()
    for name in sorted(members):
        whole.update(hashlib.sha256(name.encode()).digest())
        whole.update(hashlib.sha256(members[name]).digest())
    return whole.hexdigest().encode()


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
    text = json.dumps(
        {"format": _STATE_FORMAT, "facts": facts, "state": monitor.state()}
    )
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
    with _errors_named(path, "state of a monitor"):
        n_bytes = Path(path).stat().st_size
        expect(
            n_bytes <= _LARGEST_STATE,
            "Number of bytes",
            n_bytes,
            f"at most {_LARGEST_STATE}",
        )
        content = json.loads(Path(path).read_bytes())
        expect(
            content["format"] == _STATE_FORMAT,
            "format",
            content["format"],
            _STATE_FORMAT,
        )
        return dict(content["state"]), dict(content["facts"])
