"""Probabilities for recorded and for other specimens, against plain Python and identities."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from skarxlag.kernels import posterior

NO_GAPS = (0.0, 0.0)


def literal(residuals, places, healthy, gaps, prior, n_rows):
    """Probabilities of one row, written out condition by condition."""

    def answered(values, noise):
        if len(values) < 2:
            return values and [1.0], 0.0
        first, second, *_ = sorted(values)
        noise *= math.sqrt(0.3 + 0.7 / max(n_rows, 1))
        odds = math.log(prior / (1 - prior)) - 2.5
        odds += 6 * (math.log(second / first) - noise) - 4 * max(math.log(first), 0)
        q = 1 / (1 + math.exp(-min(odds, 8)))
        total = sum(value**-8 for value in values)
        ties = values.count(first)
        of_values = [
            q * (value == first) / ties + (1 - q) * value**-8 / total
            for value in values
        ]
        return of_values, q

    nearest = {}
    for residual, place in zip(residuals, places, strict=True):
        nearest[place] = min(nearest.get(place, math.inf), residual)
    faults = [place for place in nearest if place != healthy]
    of_faults = [nearest[place] for place in faults]
    states = [nearest[healthy]] if healthy in nearest else []
    states += [min(of_faults)] if faults else []
    of_states, q_state = answered(states, gaps[0])
    of_places, q_place = answered(of_faults, gaps[1])
    of_place = {healthy: of_states[0]}
    for place, share in zip(faults, of_places, strict=True):
        of_place[place] = of_states[-1] * share
    found = []
    for residual, place in zip(residuals, places, strict=True):
        own = [r for r, p in zip(residuals, places, strict=True) if p == place]
        found.append(of_place[place] * residual**-32 / sum(r**-32 for r in own))
    q = max(q_state, q_place)
    unknown = (1 - q) / 9
    total = sum(found) + unknown
    return [value / total for value in [*found, unknown]], q


@settings(deadline=None, max_examples=200)
@given(
    # Nearly equal residuals have equal logarithms.
    st.lists(st.integers(1, 400).map(lambda n: n / 20), min_size=1, max_size=6),
    st.randoms(use_true_random=False),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
    st.floats(0.05, 0.95),
    st.sampled_from([0.5, 1.0, 40.0]),
)
def test_probabilities_are_those_of_the_equations(
    residuals, random, gaps, prior, n_rows
):
    _, places = np.unique([random.randrange(4) for _ in residuals], return_inverse=True)
    healthy = random.choice([-1, *range(places.max() + 1)])
    found = posterior.condition_log_probabilities(
        np.log([residuals]), places, healthy, gaps, prior, n_rows
    )
    expected, recorded = literal(
        residuals, places.tolist(), healthy, gaps, prior, n_rows
    )
    probability = np.exp(found.log_probability[0])
    assert_allclose(probability, expected, rtol=1e-6, atol=1e-12)
    assert probability.sum() == pytest.approx(1)
    assert found.recorded[0] == pytest.approx(recorded, abs=1e-12)


@settings(deadline=None, max_examples=100)
@given(
    st.lists(st.floats(-3, 3), min_size=2, max_size=6),
    st.randoms(use_true_random=False),
)
def test_the_decided_condition_is_the_nearest_one(logs, random):
    _, places = np.unique([random.randrange(3) for _ in logs], return_inverse=True)
    residuals = np.array([logs])
    for healthy in range(-1, places.max() + 1):
        found = posterior.condition_log_probabilities(
            residuals, places, healthy, NO_GAPS
        )
        probability = np.exp(found.log_probability[:, :-1])
        chosen = posterior.decided_condition(probability, places, healthy)[0]
        assert residuals[0, chosen] == pytest.approx(residuals.min(), abs=1e-9)


def test_gaps_of_noise_count_and_fall_with_the_number_of_rows():
    residuals, places = np.log([[0.5, 0.7]]), np.array([0, 1])

    def recorded(gap, n_rows=1.0):
        return posterior.condition_log_probabilities(
            residuals, places, -1, (0.0, gap), n_rows=n_rows
        ).recorded[0]

    assert recorded(0.1) > recorded(0.3, 100) > recorded(0.3, 4) > recorded(0.3)
    # A part of the gap is common to all rows of a recording.
    assert recorded(0.3, 1e9) < recorded(0.0)


def test_gaps_of_questions_by_hand():
    residuals = np.log([[1.0, 2.0, 4.0, 3.0], [1.0, 1.5, 3.0, 3.0]])
    places = np.array([0, 1, 1, 2])
    found = posterior.noise_gaps(residuals, places, 0)
    assert_allclose(found, np.log([2.0, 2.0]))
    assert_allclose(posterior.noise_gaps(residuals, places, -1), [0, np.log(2)])
    # One place, and a healthy condition alone.
    for healthy in (-1, 0):
        one = posterior.noise_gaps(residuals[:, :1], np.array([0]), healthy)
        assert one.tolist() == [0, 0]


@settings(deadline=None, max_examples=200)
@given(st.lists(st.floats(0.01, 1), min_size=2, max_size=6), st.integers(0, 5))
def test_the_chosen_probability_becomes_the_largest(weights, place):
    probability = np.array([weights]) / np.sum(weights)
    chosen = np.array([place % len(weights)])
    found = posterior.with_largest(probability, chosen)[0]
    assert found.sum() == pytest.approx(1) and found.argmax() == chosen[0]
    larger = probability[0] >= probability[0, chosen[0]]
    assert_allclose(found[larger], found[chosen[0]], rtol=1e-5)
    assert_allclose(found[~larger], probability[0, ~larger], rtol=1e-5)


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_extreme_residuals_give_finite_probabilities(scale):
    residuals = np.log(np.array([[1.0, 2.0, 3.0]]) * scale)
    found = posterior.condition_log_probabilities(residuals, np.arange(3), 0, NO_GAPS)
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
