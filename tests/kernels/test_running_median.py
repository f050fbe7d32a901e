import numpy as np
import pytest
from numpy.testing import assert_array_equal

from skarxlag.kernels.running_median import running_median


@pytest.mark.parametrize("beyond", ["edge", "symmetric"])
@pytest.mark.parametrize("n_values", [1, 2, 7, 40])
def test_running_medians_are_those_of_the_neighbours(n_values, beyond):
    # Some values are equal, and rows must not reach into one another.
    rows = np.random.default_rng(n_values).normal(size=(3, n_values)).round(1)
    rows[1] += 100
    for half in (0, 1, 5, 44, 76):
        places = np.arange(-half, n_values + half)
        found = running_median(rows, 2 * half + 1, beyond)
        for values, medians in zip(rows, found, strict=True):
            if beyond == "edge":
                around = values[places.clip(0, n_values - 1)]
            else:
                around = np.concatenate([values, values[::-1]])[places % (2 * n_values)]
            windows = np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1)
            assert_array_equal(medians, np.median(windows, axis=1))
