"""Mutants are programs with one error, and those listed as equivalent exist."""

from textwrap import dedent

from .mutants import SOURCES, known_equivalent, mutants


def keys(source):
    return [mutant.key for mutant in mutants(dedent(source))]


def without_mutant(entries):
    """Return the entries of the list of equivalent mutants that match no mutant."""
    existing = {
        f"{module}.{mutant.key}"
        for module, path in SOURCES.items()
        for mutant in mutants(path.read_text())
    }
    return set(entries) - existing


def test_each_equivalent_mutant_exists_and_has_a_reason():
    equivalent = known_equivalent()
    assert without_mutant(equivalent) == set()
    assert all(equivalent.values())


def test_an_entry_that_matches_no_mutant_is_reported():
    entry = "ladder.rows_that_hold: ceil(round(1 / _ - 1, 9))"
    assert without_mutant([*known_equivalent(), entry]) == {entry}


def test_a_mutant_is_the_program_with_one_error():
    results = {}
    for mutant in mutants("def f(x):\n    return x + 2\n"):
        scope = {}
        exec(compile(mutant.program, "mutant", "exec"), scope)
        results[mutant.line, mutant.text] = scope["f"](3)
    assert results == {(2, "return x - 2"): 1, (2, "return x + 3"): 6}


def test_keys_survive_other_names_and_layout():
    source = "def f(rows, n):\n    return rows.reshape(n, -1)[min(n + 1, 9):]\n"
    renamed = """
    import x

    def f(windows, n_windows):
        # A comment.
        return windows.reshape(
            n_windows, -1
        )[min(n_windows + 1, 9) :]
    """
    assert keys(source) == keys(renamed)


def test_a_change_of_an_equivalent_line_has_another_key():
    source = "def f(a, b):\n    c = a * b\n    return a * c + {}\n"
    assert keys(source.format(1)) != keys(source.format(2))


def test_equal_changes_of_a_function_are_numbered():
    source = "def f(a):\n    b = a > 0\n    c = a > 0\n"
    assert keys(source)[3:] == [
        "f: _ = _ >= 0 (2)",
        "f: _ = _ <= 0 (2)",
        "f: _ = _ > 1 (2)",
    ]


def test_nothing_changes_that_has_no_effect():
    source = """
    import os
    TINY, HUGE = 1e-9, 1e140
    if os.name == "nt":
        SIZE = 2**30
    """
    assert keys(source) == [": if _ != '_':"]
