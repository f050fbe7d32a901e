import importlib.util
import inspect
import itertools
import json
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SPEC = importlib.util.spec_from_file_location(
    "suite", ROOT / "benchmarks" / "speed" / "asv" / "suite.py"
)
suite = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(suite)


def benchmarks():
    for name, kind in vars(suite).items():
        if inspect.isclass(kind):
            methods = [
                m for m in vars(kind) if m.startswith(("time_", "timeraw_", "peakmem_"))
            ]
            for method, parameter in itertools.product(
                methods, getattr(kind, "params", (None,))
            ):
                yield pytest.param(
                    kind, method, parameter, id=f"{name}-{method}-{parameter}"
                )


@pytest.mark.parametrize(("kind", "method", "parameter"), list(benchmarks()))
def test_every_benchmark_runs(monkeypatch, kind, method, parameter):
    monkeypatch.setattr(suite, "N_WINDOWS", 16)
    arguments = () if parameter is None else (parameter,)
    benchmark = kind()
    if hasattr(benchmark, "setup"):
        benchmark.setup(*arguments)
    code = getattr(benchmark, method)(*arguments)
    if method.startswith("timeraw_"):
        exec(textwrap.dedent(code), {})


def test_configuration_finds_the_suite():
    configuration = json.loads((ROOT / "asv.conf.json").read_text())
    assert (ROOT / configuration["benchmark_dir"] / "suite.py").is_file()
