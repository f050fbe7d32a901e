"""Objects in a skops archive, built from the parts of its format that a model needs.

To load a model by itself, skops imports every estimator of scikit-learn, because it
trusts them all. That takes as long as the import of scikit-learn. The types of a model
are known before it is loaded, so only their modules are imported here.
"""

import io
import json
from importlib import import_module
from typing import Any

import numpy as np

#: Versions of the format that are read here.
PROTOCOLS = (0, 1, 2)


class SavedObjects:
    """Builder of the objects in an archive.

    It does not compare types with a list of trusted ones, so the schema must have been
    checked. It knows no loader that calls a function.

    Parameters
    ----------
    members : dict of str to bytes
        Members of the archive, by name.

    Examples
    --------
    >>> schema = {"__loader__": "JsonNode", "content": "[1, 2.5, null]"}
    >>> SavedObjects({}).build(schema)
    [1, 2.5, None]
    """

    def __init__(self, members: dict[str, bytes]) -> None:
        self._members = members
        self._built: dict[Any, Any] = {}
        self._builders = {
            "JsonNode": self._plain,
            "DictNode": self._dict,
            "ListNode": self._list,
            "TupleNode": self._tuple,
            "NdArrayNode": self._array,
            "ObjectNode": self._object,
        }

    def build(self, node: dict[str, Any]) -> Any:
        """Return the object that a node of the schema describes.

        Parameters
        ----------
        node : dict
            The schema, or a part of it that has a loader.

        Returns
        -------
        object
            The same one for nodes of the same identifier.
        """
        identifier = node.get("__id__")
        if identifier in self._built:
            return self._built[identifier]
        built = self._builders[node["__loader__"]](node)
        if identifier is not None:
            self._built[identifier] = built
        return built

    def _plain(self, node):
        return json.loads(node["content"])

    def _dict(self, node):
        return {name: self.build(value) for name, value in node["content"].items()}

    def _list(self, node):
        return [self.build(value) for value in node["content"]]

    def _tuple(self, node):
        return tuple(self._list(node))

    def _array(self, node):
        if node["type"] == "json":
            return self._array_of_objects(node)
        array = np.load(io.BytesIO(self._members[node["file"]]), allow_pickle=False)
        return array if node["__class__"] == "ndarray" else _type_of(node)(array)

    def _array_of_objects(self, node):
        values = self._list(node)
        if len(self.build(node["shape"])) != 1:
            return np.array(values, dtype=object)
        # NumPy would make an axis of values that are sequences.
        array = np.empty(len(values), dtype=object)
        for place, value in enumerate(values):
            array[place] = value
        return array

    def _object(self, node):
        kind = _type_of(node)
        built = kind.__new__(kind)
        state = self.build(node["content"]) if "content" in node else None
        if state is None:
            return built
        # Estimators of scikit-learn compare the version that saved them.
        if hasattr(built, "__setstate__"):
            built.__setstate__(state)
        else:
            vars(built).update(state)
        return built


def _type_of(node):
    return getattr(import_module(node["__module__"]), node["__class__"])
