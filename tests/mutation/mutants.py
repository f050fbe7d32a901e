"""Small changes of a program, one at a time."""

import ast
import builtins
import keyword
import re
from collections import Counter
from pathlib import Path
from typing import NamedTuple

_PACKAGE = Path(__file__).parents[2] / "skarxlag"
#: Compiled loops, not what they compute.
_NOT_NUMERIC = {"__init__", "arrays", "compiled"}
#: Files of the modules that are changed, by name.
SOURCES = {
    path.stem: path
    for path in sorted((_PACKAGE / "kernels").glob("*.py"))
    if path.stem not in _NOT_NUMERIC
} | {
    "row_outliers": _PACKAGE / "decisions/row_outliers.py",
    "fault_detector": _PACKAGE / "decisions/fault_detector.py",
    "known_conditions": _PACKAGE / "decisions/known_conditions.py",
    # The kernel has the name of the file.
    "threshold_ladder": _PACKAGE / "decisions/ladder.py",
    "judge": _PACKAGE / "verdicts/judge.py",
    "members": _PACKAGE / "verdicts/members.py",
    "limits": _PACKAGE / "verdicts/limits.py",
}
_COMPARISONS = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}
_OPERATORS = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
_NAMES = {
    "min": "max",
    "max": "min",
    "maximum": "minimum",
    "minimum": "maximum",
    "sin": "cos",
    "cos": "sin",
    "ceil": "floor",
}


#: Smaller numbers, and larger ones than the inverse, only guard against rounding and
#: overflow: any number near them does.
_NEGLIGIBLE = 1e-8
#: The key of a mutant shows so many expressions around the changed one.
_N_AROUND = 2
_NAME = re.compile(r"(?<!\w)[^\W\d][\w.]*")


class Mutant(NamedTuple):
    """A program that differs from a module by one small error."""

    #: Number of the changed line.
    line: int
    #: Innermost function around the change, "" outside of functions.
    function: str
    #: The changed line.
    text: str
    #: The function and the changed expression without names, such as ``"f: _ + 3"``. A
    #: second change of the same key ends in ``"(2)"``.
    key: str
    #: The error is taken back before the next mutant is yielded.
    program: ast.Module


def known_equivalent():
    """Return the mutants that no test can kill.

    Returns
    -------
    dict of str to str
        Their reasons by ``module.key``, see `Mutant`.
    """
    lines = Path(__file__).with_name("equivalent.txt").read_text().splitlines()
    return dict(line.split("  # ") for line in lines if not line.startswith("#"))


def mutants(source):
    """Yield every program that differs from the source by one small error.

    Comparisons move their boundary and turn round, arithmetic and logic change their
    operator, a number grows by 1 (an integer) or by a tenth, a sign is dropped, min and
    max are exchanged. Some changes are left out, since no result depends on them: the
    -1 of a `reshape`, since any negative number stands for the length that is left,
    numbers that are negligible or nearly infinite, and code for Windows.

    Parameters
    ----------
    source : str
        A module.

    Yields
    ------
    Mutant

    Examples
    --------
    >>> for mutant in mutants("def f(a):\\n  if a < 2: b = -max(a, 0)"):
    ...     print(f"{mutant.text:16}{mutant.key}")
    a <= 2          f: if _ <= 2:
    a >= 2          f: if _ >= 2:
    a < 3           f: if _ < 3:
    b = +max(a, 0)  f: _ = +max(_, 0)
    b = -min(a, 0)  f: -min(_, 0)
    b = -max(a, 1)  f: -max(_, 1)
    """
    tree = ast.parse(source)
    parents = {
        id(child): parent
        for parent in ast.walk(tree)
        for child in ast.iter_child_nodes(parent)
    }
    left_out = {id(node) for part in ast.walk(tree) for node in _without_effect(part)}
    nodes = [node for node in ast.walk(tree) if hasattr(node, "lineno")]
    counts = Counter()
    for node in sorted(nodes, key=lambda node: (node.lineno, node.col_offset)):
        if id(node) in left_out:
            continue
        function = next(_functions(node, parents), "")
        for name, value in _changes(node):
            original = getattr(node, name)
            setattr(node, name, value)
            key = f"{function}: {_without_names(_around(node, parents))}"
            counts[key] += 1
            ordinal = f" ({counts[key]})" if counts[key] > 1 else ""
            text = _changed_line(node, parents)
            yield Mutant(node.lineno, function, text, key + ordinal, tree)
            setattr(node, name, original)


def _changed_line(node, parents):
    """Return the comparison or else the first line of the statement around a node."""
    while not isinstance(node, ast.stmt | ast.Compare):
        node = parents[id(node)]
    return ast.unparse(node).split("\n")[0]


def _around(node, parents):
    """Return the first line of a node with the expressions next to it."""
    for _ in range(_N_AROUND):
        if not isinstance(node, ast.stmt):
            node = parents[id(node)]
    return ast.unparse(node).split("\n")[0]


def _without_names(text):
    """Replace the names in a line, except those of the language and of changes.

    Examples
    --------
    >>> _without_names("for row in range(first.max(), np.sin(n_rows) + 1e-9):")
    'for _ in range(max(), sin(_) + 1e-9):'
    """

    def replaced(match):
        name = match[0].rpartition(".")[2]
        stays = keyword.iskeyword(name) or hasattr(builtins, name) or name in _NAMES
        return name if stays else "_"

    return _NAME.sub(replaced, text)


def compiled_functions(source):
    """Return the names of the compiled functions of a module.

    If there are any, ``""``, which stands for its constants, is among them.

    Examples
    --------
    >>> sorted(compiled_functions("@inlined\\ndef loop(): pass\\ndef call(): pass"))
    ['', 'loop']
    """
    marks = {"compiled", "inlined"}
    functions = [
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
    ]
    loops = {
        f.name for f in functions if marks & set(map(ast.unparse, f.decorator_list))
    }
    return loops | {""} if loops else loops


def _without_effect(node):
    """Return the parts of a node whose changes have no effect."""
    match node:
        case ast.Call(func=ast.Attribute(attr="reshape")):
            return [
                length.operand
                for length in node.args
                if isinstance(length, ast.UnaryOp)
            ]
        case ast.If() if ast.unparse(node.test) == "os.name == 'nt'":
            return [part for line in node.body for part in ast.walk(line)]
    return []


def _functions(node, parents):
    """Yield the names of the functions around a node, the innermost first."""
    while id(node) in parents:
        node = parents[id(node)]
        if isinstance(node, ast.FunctionDef):
            yield node.name


def _changes(node):
    """Return attributes of a node with other values of them, one error each."""
    if isinstance(node, ast.Compare):
        others = _COMPARISONS.get(type(node.ops[0]), ())
        return [("ops", [other(), *node.ops[1:]]) for other in others]
    if (
        isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp)
        and type(node.op) in _OPERATORS
    ):
        return [("op", _OPERATORS[type(node.op)]())]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return [("op", ast.UAdd())]
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return [("value", node.value + 1)]
    if isinstance(node, ast.Constant) and type(node.value) is float:
        size = abs(node.value)
        if size and not _NEGLIGIBLE < size < 1 / _NEGLIGIBLE:
            return []
        return [("value", float(f"{node.value * 1.1:.6g}") or 1.0)]
    if isinstance(node, ast.Name) and node.id in _NAMES:
        return [("id", _NAMES[node.id])]
    if isinstance(node, ast.Attribute) and node.attr in _NAMES:
        return [("attr", _NAMES[node.attr])]
    return []
