"""The list of mutants that cannot be killed names mutants that exist."""

from pathlib import Path

import skarxlag.kernels

from .mutants import known_equivalent, mutants

KERNELS = Path(skarxlag.kernels.__file__).parent


def test_each_equivalent_mutant_is_one_mutant_and_has_a_reason():
    listed, names = known_equivalent(), []
    for module in sorted({name.partition(".")[0] for name in listed}):
        source = (KERNELS / f"{module}.py").read_text()
        names += [f"{module}.{change}" for _, change, _ in mutants(source)]
    assert {name: names.count(name) for name in listed} == dict.fromkeys(listed, 1)
    assert all(listed.values())


def test_a_mutant_is_the_program_with_one_error():
    [(line, change, program)] = mutants("def double(x):\n    return x + x\n")
    scope = {}
    exec(compile(program, "mutant", "exec"), scope)
    assert (line, change, scope["double"](3)) == (2, "double: return x - x", 0)
