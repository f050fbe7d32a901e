"""Digests of the code, the data and the command that the numbers of a part depend on.

Comments, docstrings, line breaks and quotes do not count. A digest that moved is no
proof that a number did: a canary (`benchmarks.pages.canaries`) finds out.
"""

import ast
import hashlib
import json
import shlex
from functools import cache
from importlib import import_module

from benchmarks.pages.modules import ROOT, imported_modules, source_path

#: Modules that list parts, write pages and choose commands. No number depends on them.
_PUBLISHING = {
    "benchmarks.commands",
    "benchmarks.pages.__main__",
    "benchmarks.pages.blocks",
    "benchmarks.pages.canaries",
    "benchmarks.pages.cells",
    "benchmarks.pages.digests",
    "benchmarks.pages.kept",
    "benchmarks.pages.modules",
    "benchmarks.pages.parts",
    "benchmarks.pages.states",
}


def part_digest(part):
    """Compute the digest of what the numbers of a part depend on.

    Parameters
    ----------
    part : Part
        Of `benchmarks.pages.parts`. Its command, the modules that it imports, and the
        content of the files that it names as data count.

    Returns
    -------
    digest : str
        16 hexadecimal digits.
    """
    content = [part.command]
    content += [source_digest(path.read_text("utf-8")) for path in code_files(part)]
    content += [
        hashlib.sha256(path.read_bytes()).hexdigest() for path in data_files(part)
    ]
    return _digest(content)


def code_files(part):
    """Return the files of the modules that the numbers of a part depend on, sorted."""
    names = [entry_module(command) for command in part.command.split(" && ")]
    return sorted(
        source_path(name) for name in imported_modules(names, leave_out=_PUBLISHING)
    )


def data_files(part):
    """Return the files that a part names as data, sorted."""
    return sorted(path for pattern in part.data for path in ROOT.glob(pattern))


def entry_module(command):
    """Return the module of a command line such as "-m benchmarks.recipe ablation".

    Examples
    --------
    >>> entry_module("-m benchmarks.recipe ablation --write docs/cross_speed.md")
    'benchmarks.recipe.ablation'
    >>> entry_module("-m benchmarks.pages.formats")
    'benchmarks.pages.formats'
    """
    words = shlex.split(command)
    name = words[1]
    if source_path(name).name != "__init__.py":
        return name
    main = f"{name}.__main__"
    commands = getattr(import_module(main), "COMMANDS", {})
    return commands.get(words[2], main) if len(words) > 2 else main


@cache
def source_digest(source):
    """Compute the digest of the syntax tree of a module, without its docstrings.

    Examples
    --------
    >>> source_digest("x = 'a'") == source_digest('x = ("a")  # first')
    True
    >>> source_digest("x = 'a'") == source_digest("x = 'b'")
    False
    """
    return _digest(_plain(ast.parse(source)))


def _plain(node):
    """Lists and texts of a syntax tree; the same for every version of Python."""
    if isinstance(node, list):
        return [_plain(each) for each in node]
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = dict(ast.iter_fields(node))
    if _has_docstring(node):
        fields["body"] = fields["body"][1:]
    # Newer versions of Python add fields that are empty lists.
    values = [
        [name, _plain(value)]
        for name, value in fields.items()
        if value not in ([], None)
    ]
    return [type(node).__name__, values]


def _has_docstring(node):
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    return isinstance(node, documented) and ast.get_docstring(node) is not None


def _digest(content):
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]
