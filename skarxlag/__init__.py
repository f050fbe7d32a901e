"""Model-based fault diagnosis of bearings across shaft speeds, as scikit-learn estimators.

A name is imported from its module when it is first used, so that ``skarxlag --version``
and ``--help`` do not wait for numba. The public names and their modules are listed
once, in the stub ``__init__.pyi``.
"""

import ast
import importlib
from pathlib import Path
from typing import Any

from ._version import __version__ as __version__

_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text("utf-8"))
#: Module of each public name.
_MODULES = {
    name.name: line.module
    for line in _STUB.body
    if isinstance(line, ast.ImportFrom) and line.module != "_version"
    for name in line.names
}
__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
