"""The list of mutants that cannot be killed names mutants that exist."""

from .mutants import SOURCES, known_equivalent, mutants


def test_each_equivalent_mutant_exists_and_has_a_reason():
    listed, names = known_equivalent(), []
    for module in sorted({name.partition(".")[0] for name in listed}):
        source = SOURCES[module].read_text()
        names += [f"{module}.{change}" for _, change, _ in mutants(source)]
    assert {name: names.count(name) for name in listed} == {
        name: len(reasons) for name, reasons in listed.items()
    }
    assert all(reason for reasons in listed.values() for reason in reasons)


def test_a_mutant_is_the_program_with_one_error():
    found = {}
    for line, change, program in mutants("def f(x):\n    return x + 2\n"):
        scope = {}
        exec(compile(program, "mutant", "exec"), scope)
        found[line, change] = scope["f"](3)
    assert found == {(2, "f: return x - 2"): 1, (2, "f: return x + 3"): 6}
