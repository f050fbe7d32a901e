import subprocess
import sys

import numpy as np
import pytest

from benchmarks.speed import (
    bearing,
    checks,
    fleet,
    identification,
    monitor,
    peers,
    rows,
    scale,
    stretches,
)
from benchmarks.speed import command as speed
from benchmarks.speed.counts import multiply_adds
from benchmarks.speed.timing import (
    MATRIX_SIDE,
    matrix_product,
    ratio,
    spread,
    take_turns,
)
from skarxlag import ARXLaguerre
from skarxlag.kernels import arx_laguerre
from skarxlag.kernels.scaling import root_mean_square

RNG = np.random.default_rng(0)


class Operand:
    """A number that counts what is done with it: multiplications, and everything else."""

    multiplications = others = 0

    def __init__(self, value):
        self.value = getattr(value, "value", value)

    def _count(kind, function):
        def operate(self, other=0.0):
            setattr(Operand, kind, getattr(Operand, kind) + 1)
            return Operand(function(self.value, getattr(other, "value", other)))

        return operate

    __mul__ = __rmul__ = _count("multiplications", lambda a, b: a * b)
    __add__ = __radd__ = _count("others", lambda a, b: a + b)
    __sub__ = _count("others", lambda a, b: a - b)
    __rsub__ = _count("others", lambda a, b: b - a)
    __abs__ = _count("others", lambda a, b: abs(a))
    least = _count("others", min)
    __gt__ = _count("others", lambda a, b: a > b)


def one_sample(order, n_models):
    """One sample of the method, literally; what it takes in multiplications and all operations."""
    Operand.multiplications = Operand.others = 0
    s, total, squares, mean, scale = (Operand(v) for v in (0.5, 1.0, 2.0, 0.1, 0.9))
    total, squares, y = total + s, squares + s * s, (s - mean) * scale
    pole, entering = Operand(0.3), Operand(0.95)
    old = [Operand(0.1 * n) for n in range(order)]
    new = [pole * old[0] + entering * y]
    for n in range(1, order):
        new.append(old[n - 1] + pole * (old[n] - new[n - 1]))
    for _ in range(n_models):
        innovation = y
        for state in old:
            innovation = innovation - Operand(0.1) * state
        c, delta, p, e_before, gain = (Operand(v) for v in (0.1, 0.2, 0.3, 0.4, 0.5))
        e = innovation - c
        c = (delta + Operand(0.1) * e) + pole * c
        surface = abs(p + Operand(0.025) * e).least(Operand(1.0))
        p = p + Operand(0.025) * e
        delta = (Operand(2.0) + Operand(2.0) * surface) * p
        sliding = Operand(10.0) * e + (e - e_before)
        start, size = Operand(0.0) + sliding * sliding, abs(sliding)
        factor = Operand(size > gain).least(Operand(gain > size))  # up, down or neither
        gain = gain * factor
        logarithm = Operand(0.0) + factor
    assert None not in (total, squares, start, logarithm, delta)
    return Operand.multiplications, Operand.multiplications + Operand.others


@pytest.mark.parametrize(("order", "n_models"), [(1, 1), (16, 8), (5, 2)])
def test_count_is_that_of_the_method_with_additions_fused(order, n_models):
    multiplications, all_operations = one_sample(order, n_models)
    counted = multiply_adds(order, n_models)
    # Fused where the result of a multiplication is added: 1 in the scaling, 1 a state
    # in the cascade and in a prediction, 5 in the observer, 1 in the surface and 1 in
    # the gain.
    fused = 1 + order + n_models * (order + 5 + 1 + 1)
    assert sum(counted.values()) == all_operations - fused
    assert sum(counted.values()) > multiplications


def test_count_of_inputs():
    alone, one_input = multiply_adds(8, 3), multiply_adds(8, 3, n_inputs=1)
    doubled = ("scaling", "cascade", "prediction")
    assert all(one_input[name] == 2 * alone[name] for name in doubled)
    assert all(one_input[name] == alone[name] for name in alone if name not in doubled)


def test_functions_take_turns():
    calls, now = [], iter(np.cumsum(np.arange(100.0)))
    functions = {name: (lambda name=name: calls.append(name)) for name in "ab"}
    seconds = take_turns(functions, 3, clock=lambda: next(now))
    assert calls == list("ab") * 4  # once before the clock runs
    np.testing.assert_array_equal(seconds["a"], [1, 5, 9])
    np.testing.assert_array_equal(seconds["b"], [3, 7, 11])


def test_ratio_within_rounds():
    median, differs = ratio(np.array([2.0, 40.0, 6.0]), np.array([1.0, 10.0, 2.0]))
    assert median == 3 and differs == pytest.approx(1 / 6)
    assert spread(np.ones(4)) == 0


def test_matrix_product_makes_the_multiply_adds_that_are_counted():
    product, count = matrix_product()
    assert product().shape == (MATRIX_SIDE, MATRIX_SIDE) and count == MATRIX_SIDE**3


def test_loops_compute_the_innovations_of_the_model():
    X = RNG.normal(size=(5, 300))
    X = (X - X.mean(axis=1, keepdims=True)) / X.std(axis=1, keepdims=True)
    model = ARXLaguerre(order=8, pole=0.3).fit(X)
    networks = model.orders_, model.poles_, model.coef_
    innovations = arx_laguerre.innovations(
        X[:, np.newaxis], *networks, 0, np.empty((5, 1, 300))
    )
    expected = root_mean_square(innovations[:, 0])
    loops = [peers.window_at_a_time, peers.over_windows]
    if peers.is_installed("filterpy"):
        loops.append(peers.filterpy_loop)
    for loop in loops:
        np.testing.assert_allclose(loop(X, 0.3, model.coef_[0]), expected, rtol=1e-10)


def test_normal_equations_find_the_system():
    y, u = identification.system_with_input(20_000)
    coef = peers.normal_equations(y, u, 3)
    np.testing.assert_allclose(coef, [1.5, -0.7, 0, 0.5, 0.3, 0], atol=0.02)
    ours = ARXLaguerre(order=3, pole=0.0).fit(np.stack([y, u])[np.newaxis])
    np.testing.assert_allclose(ours.coef_[0], coef, atol=1e-3)


SHORT = {"n_windows": 16, "n_samples": 200}
STRETCHES = {"n_stretches": 3, "n_samples": 14_000}
#: Functions with small sizes, and the number of their measurements without peers.
ROWS = {
    "transforms": (rows.transforms, SHORT, 4),
    "alpio": (rows.alpio_predict, SHORT, 1),
    "extended state": (rows.extended_state_predict, SHORT, 1),
    "diagnoser": (rows.diagnoser_predict, SHORT, 1),
    "diagnoser, fit": (rows.diagnoser_fit, SHORT, 0),
    "grid search": (rows.grid_search, SHORT | {"n_gains": 2}, 2),
    "two threads": (rows.two_threads, {"n_windows": 80, "n_samples": 200}, 1),
    "identification": (identification.identification, {"n_samples": 80_000}, 1),
    "pole search": (identification.pole_search, {"lengths": (1, 2)}, 2),
    "checks": (checks.checks, SHORT, 6),
    "monitor": (monitor.monitor, {"n_seconds": 2}, 2),
    "sensors": (monitor.sensors, {"sensors": {2: (0.5, 2)}}, 2),
    "stretches": (stretches.stretches, STRETCHES, 5),
    "bearing": (bearing.bearing, STRETCHES, 3),
}


@pytest.mark.parametrize("name", ROWS)
def test_a_measurement_has_a_positive_value(name):
    measure, sizes, n_lines = ROWS[name]
    lines = measure(n_rounds=2, **sizes)
    assert len(lines) >= n_lines
    assert all(line["reached"] > 0 for line in lines)
    assert len(speed.table(lines)) == len(lines)


def test_a_grid_search_identifies_once_a_fold():
    lines = rows.grid_search(n_rounds=2, n_gains=2, **SHORT)
    assert lines[1]["reached"] == 1


def test_steps_of_a_run_are_measured_for_each_number_of_recordings():
    lines = scale.scale(counts=(2, 4))
    assert len(lines) == len(speed.table(lines)) == 6
    assert {line["peer"] for line in lines} == {"2, 4 recordings"}


def test_features_for_river_hold_all_of_the_power_but_the_mean():
    X = np.random.default_rng(0).normal(size=(3, 1201)) + 5
    energies = [sum(map(np.exp, row.values())) for row in monitor._features(X)]
    np.testing.assert_allclose(energies, X.var(axis=1) * 1201**2 / 2)


def test_costs_of_a_fleet_follow_from_what_was_measured():
    seconds = {
        "one": [2.0, 2],
        "two": [1.0, 1.25],
        "product": [3, 3],
        "products": [1.5, 1.5],
    }
    measured = {
        "seconds": {side: np.array(rounds) for side, rounds in seconds.items()},
        "n_samples": 2_000_000,
        "bytes_out": 400,
        "bytes_back": 60.0,
    }
    values = fleet.costs(measured).set_index("what")["value"]
    assert values.iloc[0] == "1,000,000"
    assert values["matrix products in two processes over one (spread)"] == "2.00 (0%)"
    # 10 000 sensors of 25 600 Hz at a million samples a second.
    assert values["example, no pause: cores"] == "256.0"
    assert values["example, one recording a minute: cores"] == "4.3"
    # 10 000 recordings of 400 bytes, and 213 333 windows of 60 bytes.
    assert values["example, no pause: MB/s over the network"] == "16.80"


@pytest.mark.slow
def test_peak_memory_is_counted_from_after_the_imports(tmp_path):
    # The names of the package are imported when they are used: a fresh process has
    # imported none.
    program = f"""
import sys
from benchmarks.speed import children
before = []
children._peak = lambda: before.append(set(sys.modules)) or 0.0
children.peak_of_predict("make_alpio", 100, 100)
children.peak_of_command({str(tmp_path)!r}, 100, 100)
for start, libraries in ((0, ["scipy.signal", "sklearn", "numba"]), (2, ["pandas", "skops.io"])):
    print("late:", sorted(set(libraries) - before[start]))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("late")]
    assert lines == ["late: []"] * 2


def test_table_and_what_was_missed():
    lines = [
        {"what": "a", "reached": 2.0, "target": 3},
        {"what": "b", "reached": 2.0, "target": 3, "at_most": True, "spread": 0.031},
        {"what": "c", "reached": 4.0, "target": 3, "at_most": True},
        {"what": "d", "reached": 1234.5},
    ]
    table = speed.table(lines)
    assert table["measured"].tolist() == ["2", "2", "4", "1.23e+03"]
    assert speed.missed_targets(lines) == [
        "a: 2, target at least 3",
        "c: 4, target at most 3",
    ]
    assert table["spread"].tolist() == ["", "3%", "", ""]
