"""Diagnosers in files that are safe to load: skops, a list of trusted types, nothing else."""

import copy
import hashlib
import json
import os
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import sklearn
from sklearn.calibration import CalibratedClassifierCV
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

from ._answers import answers
from ._archive import read_members, write_members
from ._files import write_atomically
from ._validation import check_model_state, estimators_within
from ._version import __version__
from .detection import KnownConditions

#: Classes of scikit-learn that may stand around our steps: what joins and calibrates them, scalers,
#: and linear models. They are made of arrays and plain values, too.
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
#: What a diagnoser's file may hold: the estimators of this package, those of scikit-learn above,
#: arrays and plain values, each read by the one loader of skops that is meant for it. skops itself
#: would also build every estimator of scikit-learn and SciPy, functions and methods.
TRUSTED_TYPES = {
    "ObjectNode": _SCIKIT_LEARN_TYPES
    | {
        "skarxlag.identification.ARXLaguerre",
        "skarxlag.observers.PIObserver",
        "skarxlag.observers.ExtendedStatePIObserver",
        "skarxlag.channels.ChannelRows",
        "skarxlag.comparison.SpectralDistance",
        "skarxlag.orders.OrderResidual",
        "skarxlag.stretches.StretchResidual",
        "skarxlag.bearings.BearingGeometry",
        "skarxlag.fault_places.FaultOrderClassifier",
        "skarxlag.ladder.ThresholdLadder",
        "skarxlag.observer_bank.ExtendedStatePIObserverBank",
        "skarxlag.spectra.LogSpectra",
        "skarxlag.detection.FaultDetector",
        "skarxlag.detection.KnownConditions",
        "skarxlag.pipelines.DiagnosisPipeline",
    },
    "NdArrayNode": {"numpy.ndarray", "numpy.float64", "numpy.int64", "numpy.str_"},
    "DictNode": {"builtins.dict"},
    "ListNode": {"builtins.list"},
    "TupleNode": {"builtins.tuple"},
    "JsonNode": {"builtins.str"},
    "TypeNode": {"builtins.str"},
}
#: Bytes of a schema; that of a model of ten conditions takes 30 kB.
_LONGEST_SCHEMA = 10 * 2**20
_FORMAT = "skarxlag diagnoser 1"
_FACT_TYPES = (str, int, float, type(None))


def save_diagnoser(
    diagnoser: Pipeline | CalibratedClassifierCV,
    path: str | os.PathLike[str],
    /,
    *,
    known_conditions: Pipeline | KnownConditions | None = None,
    **facts: Any,
) -> None:
    """Save a fitted diagnoser and facts about it, all or nothing.

    The file is a skops archive, written beside its place and then moved there, so that a reader
    never sees half of it. Its comment is a SHA-256 of the contents, which reveals damage and
    careless edits; it is no signature.

    Parameters
    ----------
    diagnoser : Pipeline or CalibratedClassifierCV
        A fitted pipeline of this package's estimators and of the scalers and linear models of
        scikit-learn that are in `TRUSTED_TYPES`; or such pipelines within
        `sklearn.calibration.CalibratedClassifierCV`. Its `memory` and its callbacks are not saved:
        they are a folder of this machine and objects of this process.
    path : str or path-like
        The file; an existing one is replaced.
    known_conditions : Pipeline, KnownConditions or None, default=None
        What :func:`skarxlag.make_known_conditions` made, fitted, to be kept beside the diagnoser.
    **facts : str, int, float, None, or list of these
        What :func:`load_diagnoser` shall return beside the diagnoser, such as the sampling rate.
        The versions of skarxlag and scikit-learn are added.

    Raises
    ------
    TypeError
        If `diagnoser` or `known_conditions` is of another type, holds an object that is not in
        `TRUSTED_TYPES`, or a fact is not plain.
    NotFittedError
        If one of them is not fitted.
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
    check_saving_is_possible()
    import skops.io

    if not isinstance(diagnoser, Pipeline | CalibratedClassifierCV):
        raise TypeError(
            f"diagnoser is a {type(diagnoser).__name__}, expected a Pipeline or a "
            "CalibratedClassifierCV"
        )
    check_is_fitted(diagnoser)
    _check_facts(facts)
    content = {
        "format": _FORMAT,
        "diagnoser": _without_surroundings(copy.deepcopy(diagnoser)),
        "facts": facts | {"skarxlag": __version__, "scikit-learn": sklearn.__version__},
    }
    if known_conditions is not None:
        check_is_fitted(known_conditions)
        _check_known_conditions(known_conditions)
        content["known_conditions"] = _without_surroundings(copy.deepcopy(known_conditions))
    members, _ = read_members(skops.io.dumps(content))
    foreign = _foreign_type(_read_schema(members))
    if foreign is not None:
        raise TypeError(f"diagnoser holds a {foreign}, which load_diagnoser would refuse")
    write_atomically(path, write_members(members, _digest(members)))


def check_saving_is_possible() -> None:
    """Ask before a long fit whether :func:`save_diagnoser` will work after it.

    Raises
    ------
    ImportError
        If skops is not installed. The message says how to install it.
    """
    try:
        import skops.io  # noqa: F401
    except ImportError as error:
        raise ImportError(
            "Saving and loading diagnosers needs skops: pip install 'skarxlag[io]'"
        ) from error


def load_diagnoser(
    path: str | os.PathLike[str],
) -> tuple[Pipeline | CalibratedClassifierCV, dict[str, Any]]:
    """Load a diagnoser that :func:`save_diagnoser` wrote, and nothing else.

    Before anything is unpacked, the sizes that the file states are bounded. Before anything is
    built, the types in the file are compared with `TRUSTED_TYPES` and the contents with their
    SHA-256. Before anything is handed over, every step checks that what it learnt is consistent:
    shapes, ranges, finite numbers. No code comes from the file.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    diagnoser : Pipeline or CalibratedClassifierCV
        Fitted; it predicts what the saved one did, bit for bit.
    facts : dict
        As given to :func:`save_diagnoser`; ``"skarxlag"`` and ``"scikit-learn"`` are the versions
        that saved it, and ``"known_conditions"`` the estimator, where one was given.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is no diagnoser, is damaged or was edited, unpacks to more than 100 MB and more
        than ten times its size, holds a type that is not trusted, or a step whose attributes
        contradict each other. The message names the file, and the type or the attribute.
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
    check_saving_is_possible()
    import skops.io

    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        members, comment = read_members(path.read_bytes())
        foreign = _foreign_type(_read_schema(members))
    # What a parser raises on damaged input is as varied as the damage, and does not name the file.
    except Exception as error:
        raise ValueError(f"{path}: no diagnoser saved by skarxlag ({error})") from error
    if foreign is not None:
        raise ValueError(f"{path}: refused, it holds a {foreign}, which no diagnoser needs")
    if comment != _digest(members):
        raise ValueError(f"{path}: refused, it was not saved by skarxlag or changed afterwards")
    try:
        content = skops.io.loads(
            write_members(members, comment), trusted=sorted(TRUSTED_TYPES["ObjectNode"])
        )
        if content["format"] != _FORMAT:
            raise ValueError(f"format {content['format']!r}, expected {_FORMAT!r}")
        diagnoser, facts = content["diagnoser"], content["facts"]
        if not isinstance(diagnoser, Pipeline | CalibratedClassifierCV):
            raise TypeError(f"it holds a {type(diagnoser).__name__}, expected a Pipeline")
        check_is_fitted(diagnoser)
        check_model_state(diagnoser)
        _check_facts(facts)
        if "known_conditions" in content:
            facts["known_conditions"] = known = content["known_conditions"]
            check_is_fitted(known)
            _check_known_conditions(known)
            check_model_state(_without_surroundings(known))
    except Exception as error:
        raise ValueError(f"{path}: no diagnoser saved by skarxlag ({error})") from error
    return _without_surroundings(diagnoser), facts


def _check_known_conditions(known):
    if not answers(known).none_of_these:
        raise TypeError(
            f"known_conditions is a {type(known).__name__}, expected KnownConditions, or a "
            "Pipeline that ends with it"
        )


def _check_facts(facts):
    for name, value in facts.items():
        values = value if isinstance(value, list) else [value]
        wrong = [each for each in values if not isinstance(each, _FACT_TYPES)]
        if wrong:
            raise TypeError(
                f"{name}={value!r} holds a {type(wrong[0]).__name__}, expected a text, a number, "
                "None or a list of these"
            )


def _without_surroundings(model):
    """The model without the folders that its pipelines cache into, and without callbacks."""
    for part in list(estimators_within(model)):
        if isinstance(part, Pipeline):
            part.memory = None
        # scikit-learn has callbacks from 1.9 on.
        if hasattr(part, "set_callbacks"):
            part.set_callbacks()
    return model


def _read_schema(members):
    content = members["schema.json"]
    if len(content) > _LONGEST_SCHEMA:
        raise BadZipFile(f"its schema.json has {len(content):,} bytes")
    schema = json.loads(content)
    if not isinstance(schema, dict) or "__loader__" not in schema:
        raise BadZipFile("its schema.json is not that of skops")
    return schema


def _foreign_type(node):
    """First type in a schema that is not trusted, or None."""
    if isinstance(node, list):
        return next(filter(None, map(_foreign_type, node)), None)
    if not isinstance(node, dict):
        return None
    if "__loader__" in node:
        name = f"{node.get('__module__')}.{node.get('__class__')}"
        if name not in TRUSTED_TYPES.get(node["__loader__"], ()):
            return f"{name} ({node['__loader__']})"
    return _foreign_type(list(node.values()))


def _digest(members):
    """SHA-256 of the names and contents of all members."""
    parts = [
        hashlib.sha256(part).digest()
        for name in sorted(members)
        for part in (name.encode(), members[name])
    ]
    return hashlib.sha256(b"".join(parts)).hexdigest().encode()
