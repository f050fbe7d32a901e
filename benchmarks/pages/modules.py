"""Modules of this repository that a program imports, found by reading its source.

Every import statement counts, also those within functions, so that the list is a little
too long rather than too short. Names that the package imports when they are first used
lead to the module that defines them.
"""

import ast
from functools import cache
from importlib.util import resolve_name
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("skarxlag", "benchmarks")
#: Package that imports its modules by names which it is given: all of them count.
COMMANDS = "skarxlag.plant.commands"


def imported_modules(names, leave_out=()):
    """Return the names of the given modules and of all that they import, sorted.

    Parameters
    ----------
    names : iterable of str
        Modules in the packages of this repository.
    leave_out : collection of str, default=()
        Modules that do not count, nor what they import.
    """
    followed = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name in followed or name in leave_out or source_path(name) is None:
            continue
        followed.add(name)
        waiting += direct_imports(name)
    return sorted(followed)


def source_path(name):
    """Return the file of a module, None if it is none of this repository."""
    if name.partition(".")[0] not in PACKAGES:
        return None
    base = ROOT.joinpath(*name.split("."))
    candidates = (base.with_suffix(".py"), base / "__init__.py")
    return next((path for path in candidates if path.exists()), None)


def direct_imports(name):
    """Return the names that the import statements of a module may mean."""
    path = source_path(name)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    imported = _imports(path.read_text("utf-8"), package)
    if name == COMMANDS:
        imported = imported + [
            f"{name}.{file.stem}" for file in path.parent.glob("*.py")
        ]
    return imported


@cache
def _imports(source, package):
    names = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            origin = resolve_name("." * node.level + (node.module or ""), package)
            names.append(origin)
            names += [_defining(origin, alias.name) for alias in node.names]
    return names


def _defining(origin, name):
    """Module of a name: a module of this name, or one that the package imports on demand."""
    if origin == "skarxlag" and name in _public_modules():
        return f"skarxlag.{_public_modules()[name]}"
    return f"{origin}.{name}"


@cache
def _public_modules():
    stub = ast.parse((ROOT / "skarxlag" / "__init__.pyi").read_text("utf-8"))
    return {
        alias.name: line.module
        for line in stub.body
        if isinstance(line, ast.ImportFrom)
        for alias in line.names
    }
