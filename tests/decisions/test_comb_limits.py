"""Limits of combs beyond the scores of healthy rows."""

import numpy as np
import pytest
from scipy.stats import gumbel_r

from skarxlag.decisions.comb_limits import limit_of_healthy


@pytest.mark.parametrize(
    ("healthy", "scale"),
    [
        # So many rows that other machines do not count.
        (gumbel_r.ppf((np.arange(50_000) + 0.5) / 50_000, scale=0.5), 0.5),
        # Rows without a spread, beside ten of other machines.
        (np.ones(2), 0.28 * np.sqrt(10 / 12)),
    ],
)
def test_beyond_the_largest_score_the_tail_falls_by_the_spread(healthy, scale):
    largest = limit_of_healthy(healthy, 1 / (len(healthy) + 1))
    assert largest == healthy[-1]
    rarer = limit_of_healthy(healthy, np.exp(-3) / (len(healthy) + 1))
    assert rarer - largest == pytest.approx(3 * scale, rel=0.01)
