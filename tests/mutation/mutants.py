"""Small changes of a program, one at a time."""

import ast
from collections import defaultdict
from pathlib import Path

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
    "journal": _PACKAGE / "commands/journal.py",
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


def known_equivalent():
    """Mutants ``module.function: changed line`` that no test can kill.

    Returns
    -------
    dict of str to list of str
        Their reasons, one for each place of a function that the changed line could
        stand in.
    """
    reasons = defaultdict(list)
    for line in Path(__file__).with_name("equivalent.txt").read_text().splitlines():
        if not line.startswith("#"):
            name, reason = line.split("  # ")
            reasons[name].append(reason)
    return dict(reasons)


def mutants(source):
    """Every program that differs from the source by one small error.

    Comparisons move their boundary and turn round, arithmetic and logic change their
    operator, a number grows by 1 (an integer) or by a tenth, a sign is dropped, min and
    max are exchanged. The -1 of a `reshape` stays, since any negative number stands for
    the length that is left.

    Parameters
    ----------
    source : str
        A module.

    Yields
    ------
    line : int
        Where the error is.
    change : str
        The function, a colon and the line as it reads with the error.
    program : ast.Module
        The module with the error, which is taken back before the next one is yielded.

    Examples
    --------
    >>> [change for _, change, _ in mutants("def f(a):\\n  if a < 2: b = -a")]
    ['f: a <= 2', 'f: a >= 2', 'f: a < 3', 'f: b = +a']
    """
    tree = ast.parse(source)
    parents = {id(c): p for p in ast.walk(tree) for c in ast.iter_child_nodes(p)}
    left_out = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    left_out |= {
        id(length.operand) for n in ast.walk(tree) for length in _free_lengths(n)
    }
    places = [node for node in ast.walk(tree) if hasattr(node, "lineno")]
    for place in sorted(places, key=lambda node: (node.lineno, node.col_offset)):
        if id(place) in left_out:
            continue
        for name, value in _changes(place):
            right = getattr(place, name)
            setattr(place, name, value)
            shown = place
            while (
                not isinstance(shown, ast.stmt | ast.Compare) and id(shown) in parents
            ):
                shown = parents[id(shown)]
            line = ast.unparse(shown).split("\n")[0]
            inside = next(_functions(shown, parents), "")
            yield place.lineno, f"{inside}: {line}", tree
            setattr(place, name, right)


def compiled_functions(source):
    """Names of the functions of a module that are loops, and "" for its constants if there are any.

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


def _free_lengths(node):
    """Negative arguments of a `reshape`."""
    match node:
        case ast.Call(func=ast.Attribute(attr="reshape")):
            return [each for each in node.args if isinstance(each, ast.UnaryOp)]
    return []


def _functions(node, parents):
    """Names of the functions about a node, the innermost first."""
    while id(node) in parents:
        node = parents[id(node)]
        if isinstance(node, ast.FunctionDef):
            yield node.name


def _changes(node):
    """Attributes of a node and other values of them, one error each."""
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
        return [("value", node.value * 1.1 or 1.0)]
    if isinstance(node, ast.Name) and node.id in _NAMES:
        return [("id", _NAMES[node.id])]
    if isinstance(node, ast.Attribute) and node.attr in _NAMES:
        return [("attr", _NAMES[node.attr])]
    return []
