import numpy as np
import pytest

from skarxlag.kernels import cumulative_sum
from skarxlag.kernels.cumulative_sum import alarm_limit, mean_run_length, reference_step


def dense_run_length(limit, step, rate, persistence):
    """Mean run length from the chain of all states, written out as equations."""
    after_quiet = rate * (1 - persistence) / (1 - rate)
    states = [(total, exceeded) for total in range(limit) for exceeded in (False, True)]
    equations = np.eye(len(states))
    for row, (total, exceeded) in enumerate(states):
        chance = persistence if exceeded else after_quiet
        for exceeds, probability in ((True, chance), (False, 1 - chance)):
            after = max(total + (step - 1 if exceeds else -1), 0)
            if after < limit:
                equations[row, states.index((after, exceeds))] -= probability
    return np.linalg.solve(equations, np.ones(len(states)))[states.index((0, False))]


@pytest.mark.parametrize(
    ("limit", "step", "rate", "persistence"),
    [(5, 3, 0.2, 0.2), (9, 4, 0.1, 0.5), (4, 2, 0.3, 0.9), (25, 9, 0.01, 0.7)],
)
def test_mean_run_length_solves_the_equations_of_all_states(
    limit, step, rate, persistence
):
    expected = dense_run_length(limit, step, rate, persistence)
    found = mean_run_length(limit, step, rate, persistence)
    assert found == pytest.approx(expected, rel=1e-8)


def test_two_in_a_row_by_hand():
    # T0 = 1 + p T1 + (1 - p) T0 and T1 = 1 + (1 - p) T0, since a sum of 2 ends it: the
    # classic.
    p = 0.3
    assert mean_run_length(2, 2, p, p) == pytest.approx((1 + p) / p**2)


@pytest.mark.parametrize(("rate", "faulty"), [(0.5, 0.9), (0.2, 0.2), (0.3, 0.1)])
def test_healthy_windows_that_exceed_too_often_are_refused(rate, faulty):
    with pytest.raises(
        ValueError, match=rf"rate of {rate}, expected below faulty_rate={faulty}"
    ):
        reference_step(rate, faulty)


@pytest.mark.parametrize("limit", [1, 8, 13, 20])
def test_a_limit_that_just_holds_is_enough(limit):
    just = mean_run_length(limit, 7, 0.01, 0.05)
    assert alarm_limit(just, 7, 0.01, 0.05) == limit
    assert alarm_limit(np.nextafter(just, np.inf), 7, 0.01, 0.05) > limit


@pytest.mark.parametrize("healthy", [0.01, 0.05, 0.1, 0.2, 0.25, 0.28, 0.3, 0.4, 0.45])
def test_step_from_the_steps_of_the_likelihood_ratio(healthy):
    # Rates next to the healthy one would lead to a step of 1 / healthy, which is out of
    # range.
    below = max(m for m in range(1, 101) if m * healthy < 1)
    for faulty in (*np.linspace(healthy, 1, 50)[1:-1], healthy + 1e-3):
        up = np.log(faulty / healthy)
        down = np.log((1 - healthy) / (1 - faulty))
        expected = min(max(round(1 + up / down), 2), below)
        assert reference_step(healthy, faulty) == expected


def test_the_largest_limit_is_still_tried(monkeypatch):
    monkeypatch.setattr(cumulative_sum, "_LARGEST_LIMIT", 8)
    just = mean_run_length(8, 6, 0.01, 0.05)
    assert alarm_limit(just, 6, 0.01, 0.05) == 8
    with pytest.raises(ValueError, match=r"at a rate of 0.01 .* allow no alarm"):
        alarm_limit(np.nextafter(just, np.inf), 6, 0.01, 0.05)
