"""Archives of models: the types that they may contain, and the seal of their contents."""

import hashlib
import io
import json
from typing import Any
from zipfile import BadZipFile, ZipFile

from ..core.registry import ESTIMATORS
from .files import read_members

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
#: Types of objects that a model may contain, for programs that pass a list of trusted
#: types to skops, such as MLflow.
TRUSTED_TYPES: list[str] = sorted(
    {f"skarxlag.{module}.{name}" for name, module in ESTIMATORS.items()}
    | {"skarxlag.bearings.geometry.BearingGeometry"}
    | _SCIKIT_LEARN_TYPES
)
#: Types that a model file may contain, by the loader of skops that reads them. By
#: itself, skops would also build every estimator of scikit-learn and SciPy, functions
#: and methods.
_TYPES_BY_LOADER = {
    "ObjectNode": set(TRUSTED_TYPES),
    "NdArrayNode": {"numpy.ndarray", "numpy.float64", "numpy.int64", "numpy.str_"},
    "DictNode": {"builtins.dict"},
    "ListNode": {"builtins.list"},
    "TupleNode": {"builtins.tuple"},
    "JsonNode": {"builtins.str"},
    "TypeNode": {"builtins.str"},
}
#: Largest size of a schema in bytes. A model of ten conditions needs 30 kB.
_LONGEST_SCHEMA = 10 * 2**20


def checked_schema(members: dict[str, bytes]) -> dict[str, Any]:
    """Return the schema, all types of which are trusted; raise an error if it is another one."""
    content = members["schema.json"]
    if len(content) > _LONGEST_SCHEMA:
        raise BadZipFile(f"its schema.json has {len(content):,} bytes")
    foreign: list[str] = []

    def note_type(node):
        name = f"{node.get('__module__')}.{node.get('__class__')}"
        loader = node.get("__loader__")
        if loader is not None and name not in _TYPES_BY_LOADER.get(loader, ()):
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
        file.comment = digest(read_members(archive)[0])
    return stream.getvalue()


def digest(members: dict[str, bytes]) -> bytes:
    """Return the SHA-256 of the names and contents of all members."""
    whole = hashlib.sha256()
    for name in sorted(members):
        whole.update(hashlib.sha256(name.encode()).digest())
        whole.update(hashlib.sha256(members[name]).digest())
    return whole.hexdigest().encode()
