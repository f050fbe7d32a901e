"""Diagnosers in files that are safe to load: skops, a list of trusted types, nothing else."""

import hashlib
import io
import json
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import sklearn
from sklearn.pipeline import Pipeline
from sklearn.utils.validation import check_is_fitted

from ._files import write_atomically
from ._state import check_pipeline_state
from ._version import __version__

#: What a diagnoser's file may hold: the estimators of this package, the Pipeline that joins them,
#: arrays and plain values, each read by the one loader of skops that is meant for it. skops itself
#: would also build every estimator of scikit-learn and SciPy, functions and methods.
TRUSTED_TYPES = {
    "ObjectNode": {
        "sklearn.pipeline.Pipeline",
        "skarxlag.identification.ARXLaguerre",
        "skarxlag.cepstral.CepstralResidual",
        "skarxlag.observers.PIObserver",
        "skarxlag.observers.ExtendedStatePIObserver",
        "skarxlag.comparison.SpectralDistance",
        "skarxlag.ladder.ThresholdLadder",
        "skarxlag.observer_bank.ExtendedStatePIObserverBank",
        "skarxlag.observer_bank.PIObserverBank",
        "skarxlag.spectra.LogSpectra",
        "skarxlag.detector.FaultDetector",
        "skarxlag.pipelines.DiagnosisPipeline",
    },
    "NdArrayNode": {"numpy.ndarray", "numpy.float64", "numpy.int64", "numpy.str_"},
    "DictNode": {"builtins.dict"},
    "ListNode": {"builtins.list"},
    "TupleNode": {"builtins.tuple"},
    "JsonNode": {"builtins.str"},
    "TypeNode": {"builtins.str"},
}
_OWN_TYPES = sorted(name for name in TRUSTED_TYPES["ObjectNode"] if name.startswith("skarxlag."))
_FORMAT = "skarxlag diagnoser 1"
_FACT_TYPES = (str, int, float, type(None))


def save_diagnoser(diagnoser, path, /, **facts):
    """Save a fitted diagnoser and facts about it, all or nothing.

    The file is a skops archive, written beside its place and then moved there, so that a reader
    never sees half of it. Its comment is a SHA-256 of the contents, which reveals damage and
    careless edits; it is no signature.

    Parameters
    ----------
    diagnoser : Pipeline
        A fitted pipeline of this package's estimators.
    path : str or path-like
        The file; an existing one is replaced.
    **facts : str, int, float, None, or list of these
        What :func:`load_diagnoser` shall return beside the diagnoser, such as the sampling rate.
        The versions of skarxlag and scikit-learn are added.

    Raises
    ------
    TypeError
        If `diagnoser` is no Pipeline, holds an object that is not in `TRUSTED_TYPES`, or a fact
        is not plain.
    NotFittedError
        If it is not fitted.
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
    if not isinstance(diagnoser, Pipeline):
        raise TypeError(f"diagnoser is a {type(diagnoser).__name__}, expected a Pipeline")
    check_is_fitted(diagnoser)
    for name, value in facts.items():
        values = value if isinstance(value, list) else [value]
        wrong = [each for each in values if not isinstance(each, _FACT_TYPES)]
        if wrong:
            raise TypeError(
                f"{name}={value!r} holds a {type(wrong[0]).__name__}, expected a text, a number, "
                "None or a list of these"
            )
    content = {
        "format": _FORMAT,
        "diagnoser": diagnoser,
        "facts": facts | {"skarxlag": __version__, "scikit-learn": sklearn.__version__},
    }
    archive = io.BytesIO(skops_io.dumps(content))
    foreign = _foreign_type(_read_schema(archive))
    if foreign is not None:
        raise TypeError(f"diagnoser holds a {foreign}, which load_diagnoser would refuse")
    with ZipFile(archive, "a") as file:
        file.comment = _digest(file)
    write_atomically(path, archive.getvalue())


def load_diagnoser(path):
    """Load a diagnoser that :func:`save_diagnoser` wrote, and nothing else.

    Before anything is built, the types in the file are compared with `TRUSTED_TYPES` and the
    contents with their SHA-256. No code comes from the file.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    diagnoser : Pipeline
        Fitted; it predicts what the saved one did, bit for bit.
    facts : dict
        As given to :func:`save_diagnoser`; ``"skarxlag"`` and ``"scikit-learn"`` are the versions
        that saved it.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is no diagnoser, is damaged or was edited, or holds a type that is not
        trusted. The message names the file, and the type.
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
    skops_io = _import_skops()
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    archive = io.BytesIO(path.read_bytes())
    try:
        schema = _read_schema(archive)
        with ZipFile(archive) as file:
            is_intact = file.comment == _digest(file)
        foreign = _foreign_type(schema)
    # What a parser raises on damaged input is as varied as the damage, and does not name the file.
    except Exception as error:
        raise ValueError(f"{path}: no diagnoser saved by skarxlag ({error})") from error
    if foreign is not None:
        raise ValueError(f"{path}: refused, it holds a {foreign}, which no diagnoser needs")
    if not is_intact:
        raise ValueError(f"{path}: refused, it was not saved by skarxlag or changed afterwards")
    try:
        content = skops_io.loads(archive.getvalue(), trusted=_OWN_TYPES)
        if content["format"] != _FORMAT:
            raise ValueError(f"format {content['format']!r}, expected {_FORMAT!r}")
        diagnoser, facts = content["diagnoser"], content["facts"]
        check_is_fitted(diagnoser)
        check_pipeline_state(diagnoser)
    except Exception as error:
        raise ValueError(f"{path}: no diagnoser saved by skarxlag ({error})") from error
    return diagnoser, facts


def _import_skops():
    try:
        import skops.io
    except ImportError as error:
        raise ImportError(
            "Saving and loading diagnosers needs skops: pip install 'skarxlag[io]'"
        ) from error
    return skops.io


def _read_schema(archive):
    with ZipFile(archive) as file:
        schema = json.loads(file.read("schema.json"))
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


def _digest(file):
    """SHA-256 of the names and contents of all members."""
    parts = [
        hashlib.sha256(part).digest()
        for name in sorted(file.namelist())
        for part in (name.encode(), file.read(name))
    ]
    return hashlib.sha256(b"".join(parts)).hexdigest().encode()
