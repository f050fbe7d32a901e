"""Probabilities for recorded and for other specimens, against plain Python and identities."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import brentq

from skarxlag.kernels import posterior


def literal(residuals, places, healthy, drift, gaps, prior, exponent, n_rows):
    """Probabilities of one row, written out condition by condition."""

    def softmax(values, power):
        weights = [value**-power for value in values]
        return [weight / sum(weights) for weight in weights]

    def recorded(values, noise):
        first, *rest = sorted(values)
        gap = math.log(rest[0] / first) if rest else 0.0
        beyond = 5 * (gap - noise / math.sqrt(n_rows))
        odds = math.log(prior / (1 - prior)) + min(max(beyond, -6), 8)
        return 1 / (1 + math.exp(-(odds - 8 * max(math.log(first / 1.6), 0))))

    def answered(values, power, q):
        both = zip(softmax(values, 32), softmax(values, power), strict=True)
        return [q * same + (1 - q) * other for same, other in both]

    nearest = {}
    for residual, place in zip(residuals, places, strict=True):
        nearest[place] = min(nearest.get(place, math.inf), residual)
    faults = [p for p in nearest if p != healthy]
    q, of_place = 0.0, {}
    if faults:
        values = [nearest[p] for p in faults]
        q = recorded(values, max(gaps[1], 0.2))
        of_place = dict(zip(faults, answered(values, exponent, q), strict=True))
    if healthy in nearest:
        if faults:
            values = [nearest[healthy], min(nearest[p] for p in faults)]
            of_question = recorded(values, max(gaps[0], 0.4))
            of_healthy, faulty = answered(values, 8, of_question)
            of_place = {p: faulty * share for p, share in of_place.items()}
            q = max(q, of_question)
        else:
            of_healthy = 1.0
        of_place[healthy] = of_healthy
    found = []
    for residual, place in zip(residuals, places, strict=True):
        own = [r for r, p in zip(residuals, places, strict=True) if p == place]
        found.append(of_place[place] * residual**-32 / sum(r**-32 for r in own))
    distance = min(residuals) * math.sqrt(drift / 0.2) / 3.2
    unknown = (1 - q) * 0.25 * max(distance, 1) ** 6
    total = sum(found) + unknown
    return [value / total for value in [*found, unknown]], q


@settings(deadline=None, max_examples=200)
@given(
    st.lists(st.floats(0.05, 20), min_size=1, max_size=6),
    st.randoms(use_true_random=False),
    st.floats(0.2, 3),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.floats(0.05, 0.95),
    st.sampled_from([1.0, 4.0, 12.0]),
    st.sampled_from([0.5, 1.0, 40.0]),
)
def test_probabilities_are_those_of_the_equations(
    residuals, random, drift, gaps, prior, exponent, n_rows
):
    _, places = np.unique([random.randrange(4) for _ in residuals], return_inverse=True)
    healthy = random.choice([-1, *range(places.max() + 1)])
    settings = (gaps, prior, exponent, n_rows)
    found = posterior.condition_log_probabilities(
        np.log([residuals]), places, healthy, np.array([drift]), *settings
    )
    expected, recorded = literal(residuals, places.tolist(), healthy, drift, *settings)
    probability = np.exp(found.log_probability[0])
    assert_allclose(probability, expected, rtol=1e-6, atol=1e-12)
    assert probability.sum() == pytest.approx(1)
    if places.max() > 0 or healthy < 0:
        assert found.recorded[0] == pytest.approx(recorded)


@settings(deadline=None, max_examples=100)
@given(
    st.lists(st.floats(-3, 3), min_size=2, max_size=6),
    st.randoms(use_true_random=False),
)
def test_the_decided_condition_is_the_nearest_one(logs, random):
    _, places = np.unique([random.randrange(3) for _ in logs], return_inverse=True)
    residuals = np.array([logs])
    ones = np.ones(1)
    for healthy in range(-1, places.max() + 1):
        found = posterior.condition_log_probabilities(residuals, places, healthy, ones)
        probability = np.exp(found.log_probability[:, :-1])
        chosen = posterior.decided_condition(probability, places, healthy)[0]
        assert residuals[0, chosen] == pytest.approx(residuals.min(), abs=1e-9)


def test_a_row_of_a_recorded_specimen_is_surer_than_one_of_another():
    places, drift = np.array([0, 1]), np.full(3, 0.2)
    residuals = np.log([[0.5, 1.0], [0.5, 0.6], [2.5, 5.0]])
    found = posterior.condition_log_probabilities(residuals, places, -1, drift)
    sure, doubtful, far = np.exp(found.log_probability)
    assert sure[0] > 0.9 > doubtful[0] > 0.5
    # The same gap, but far from all that was recorded.
    assert far[0] < sure[0] and far[-1] > sure[-1]
    assert (
        found.recorded[0] > found.recorded[1] and found.recorded[0] > found.recorded[2]
    )


def test_noise_raises_the_gap_that_counts():
    residuals, places, drift = np.log([[0.5, 0.9]]), np.array([0, 1]), np.ones(1)
    options = {"locations": places, "healthy": -1, "drift": drift}
    quiet, loud = (
        posterior.condition_log_probabilities(
            residuals, noise_gaps=(0.0, gap), **options
        )
        for gap in (0.1, 0.8)
    )
    assert quiet.recorded[0] > loud.recorded[0]
    assert quiet.log_probability[0, 0] > loud.log_probability[0, 0]


def test_gaps_of_questions_by_hand():
    residuals = np.log([[1.0, 2.0, 4.0, 3.0]])
    places = np.array([0, 1, 1, 2])
    found = posterior.question_gaps(residuals, places, 0)
    assert_allclose(found, np.log([[2.0, 1.5]]))
    assert_allclose(posterior.question_gaps(residuals, places, -1), [[0, np.log(2)]])
    # One place, and a healthy condition alone.
    assert posterior.question_gaps(residuals[:, :1], np.array([0]), -1).tolist() == [
        [0, 0]
    ]
    assert posterior.question_gaps(residuals[:, :1], np.array([0]), 0).tolist() == [
        [0, 0]
    ]


@settings(deadline=None, max_examples=200)
@given(st.lists(st.floats(0.01, 1), min_size=2, max_size=6), st.integers(0, 5))
def test_the_chosen_probability_becomes_the_largest_by_the_smallest_change(
    weights, place
):
    probability = np.array([weights]) / np.sum(weights)
    chosen = np.array([place % len(weights)])
    found = posterior.with_largest(probability, chosen)[0]
    assert found.sum() == pytest.approx(1) and found.argmax() == chosen[0]
    others = np.delete(probability[0], chosen[0])

    def excess(level):
        return np.minimum(others, level).sum() + level - 1

    if probability[0].argmax() == chosen[0]:
        assert_array_equal(found, probability[0])
    else:
        level = brentq(excess, 0, 1)
        assert found[chosen[0]] == pytest.approx(level, abs=1e-4)


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_extreme_residuals_give_finite_probabilities(scale):
    residuals = np.log(np.array([[1.0, 2.0, 3.0]]) * scale)
    found = posterior.condition_log_probabilities(
        residuals, np.arange(3), 0, np.ones(1)
    )
    assert np.exp(found.log_probability).sum() == pytest.approx(1)
    assert np.isfinite(found.recorded).all()


def test_an_unknown_condition_is_shared_among_the_classes():
    log_probability = np.log([[0.5, 0.3, 0.2], [0.1, 0.2, 0.7]])
    result = posterior.decided(
        log_probability, np.array(["good", "worn"]), np.array([0, 1]), 0
    )
    assert_allclose(result["probability"], [[0.6, 0.4], [0.45, 0.55]])
    assert result["verdict"].tolist() == ["good", "worn"]
    assert_allclose(result["score"], np.log([0.4 / 0.6, 0.55 / 0.45]))


def test_logarithms_are_finite_also_of_0():
    smallest = np.log(np.finfo(float).tiny)
    residuals = np.array([1.0, np.e, 0.0], dtype=np.float32)
    logarithms = posterior.logarithms(residuals)
    assert_allclose(logarithms, [0.0, 1.0, smallest], rtol=1e-7)


def test_the_healthy_location_comes_first_only_where_it_is_likelier():
    log_probability = np.log([[0.35, 0.33, 0.32]])
    labels = np.array(["good", "inner", "outer"])
    result = posterior.decided(
        np.column_stack([log_probability, [-np.inf]]), labels, np.arange(3), 0
    )
    # Both faults together are likelier than the healthy condition.
    assert result["verdict"].tolist() == ["inner"]
