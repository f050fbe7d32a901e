import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.stats import norm

from skarxlag.kernels import evidence


def test_p_values_beyond_the_accurate_range_count_as_its_ends():
    scores = evidence.p_value_score([0.0, 1e-310, 0.2, 0.9999, 1.0])
    expected = norm.ppf([1e-300, 1e-300, 0.2, 0.999, 0.999])
    assert_allclose(scores, expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("correlation", "n"), [({}, 1 + 9 * 0.7), ([0.2], 1 + 9 * 0.2)]
)
def test_ten_windows_that_depend_on_each_other_are_worth_fewer(correlation, n):
    assert evidence.effective_number(10, *correlation) == pytest.approx(10 / n)
    assert evidence.effective_number(0.5, *correlation) == 0.5


def test_combined_p_value_is_that_of_the_mean_score_of_what_is_not_missing():
    p_values = [0.01, np.nan, 0.2, 0.5]
    mean = norm.ppf([0.01, 0.2, 0.5]).mean()
    expected = norm.cdf(mean * np.sqrt(3 / (1 + 2 * 0.8)))
    assert evidence.combined_p_value(p_values) == pytest.approx(expected)
    assert np.isnan(evidence.combined_p_value([np.nan]))
