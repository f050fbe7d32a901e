import numpy as np
import pytest
from scipy.special import softmax

from benchmarks.fault_orders.joint import (
    IN_USE,
    SETTINGS,
    compare,
    remounted,
    rows_of,
    scored,
    settings_left_out,
    table,
)
from benchmarks.fault_orders.rigs import Recording
from skarxlag import make_diagnoser
from skarxlag.bearings import SKF_6205
from skarxlag.decisions.comb_probabilities import comb_evidence

from ..impacts import ORDERS, RATE, strikes


def recordings(rig, seed):
    return [
        Recording(
            rig,
            f"{location}_{rpm}",
            location,
            rpm,
            float(RATE),
            SKF_6205,
            np.concatenate([strikes(order, rpm, [seed, i]) for i in range(4)]),
            location,
        )
        for location, order in ORDERS.items()
        for rpm in (900.0, 1200.0)
    ]


@pytest.fixture(scope="module")
def rigs():
    names = ("CWRU drive end", "CWRU fan end")
    return {name: recordings(name, seed) for seed, name in enumerate(names)}


def test_protocols_of_a_rig(rigs):
    name = next(iter(rigs))
    parts = [(name, protocol, part) for protocol, part in scored(name, rigs)]
    accuracies = table(parts)
    assert accuracies.index.get_level_values("protocol").tolist() == [
        "other speed",
        "remounted mildly",
        "remounted strongly",
        "other rig",
    ]
    assert accuracies["location, both"].min() == 1
    chosen = settings_left_out(
        [*parts, *(("other", protocol, part) for _, protocol, part in parts)]
    )
    assert chosen["location"].tolist() == [1, 1]


def test_verdict_is_that_of_the_diagnoser(rigs):
    rig = next(iter(rigs.values()))
    rows = rows_of(rig)
    learned = rows[rows.is_first_half & (rows.rpm == 900)]
    tested = rows[~rows.is_first_half]
    tested = tested._replace(X=remounted(tested.X, 1.0, 0.3, 0))
    diagnoser = make_diagnoser(sampling_rate=RATE, bearing=SKF_6205)
    diagnoser.fit(learned.X, learned.y, rpm=learned.rpm)
    expected = diagnoser.predict_proba(tested.X, rpm=tested.rpm)
    part = compare(diagnoser, tested, SKF_6205)
    # An unknown condition shows no comb, as a healthy one.
    locations = np.append(part.class_locations, 3)
    evidence = comb_evidence(part.scores, locations, *SETTINGS[IN_USE])
    joint = softmax(part.log_probability + evidence, axis=1)
    n_classes = len(part.class_locations)
    shared = joint[:, :n_classes] + joint[:, n_classes:] / n_classes
    np.testing.assert_allclose(shared, expected, rtol=1e-5)


def test_remounting_filters_and_adds_noise():
    X = np.random.default_rng(0).normal(size=(2, 4000))
    moved = remounted(X, 1.0, 0.0, 0)
    np.testing.assert_allclose(moved.std(axis=1), 1)
    np.testing.assert_allclose(remounted(3 * X, 1.0, 0.0, 0), moved)
    np.testing.assert_allclose(
        remounted(X, 0.0, 0.0, 0) * X.std(axis=1, keepdims=True), X
    )
    assert np.std(remounted(X, 1.0, 0.5, 0) - moved) == pytest.approx(0.5, rel=0.05)
