import numpy as np
import pytest

from skarxlag.decisions.comb_limits import ODDS
from skarxlag.decisions.comb_probabilities import VISIBLE, comb_evidence


def test_evidence_of_combs_is_that_of_faults_that_may_hide():
    scores = np.array([0.1, 1.2, -3.0])
    # A fault shows its comb with the probability VISIBLE.
    odds = [VISIBLE * np.exp(ODDS * score) + 1 - VISIBLE for score in scores] + [1.0]
    expected = np.log(np.array(odds) / sum(odds))
    locations = np.array([3, 1, 1, 0, 2])
    evidence = comb_evidence(scores[np.newaxis], locations)
    np.testing.assert_allclose(evidence[0], expected[locations])


@pytest.mark.parametrize("locations", [[0, 1, 2, 3], [1, 2]])
def test_without_any_comb_all_locations_of_classes_are_equally_likely(locations):
    evidence = comb_evidence(np.zeros((1, 3)), np.array(locations))
    np.testing.assert_allclose(np.exp(evidence[0]), 1 / len(locations))
