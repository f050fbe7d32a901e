import numpy as np
from scipy.special import softmax

from skarxlag.decisions.fault_locations import (
    ODDS,
    VISIBLE,
    comb_evidence,
    least_margin,
    location_of_label,
)


def test_names_of_labels():
    names = {
        "BPFO 3": "outer",
        "inner_race": "inner",
        "Roller": "ball",
        "baseline": "healthy",
    }
    assert {name: location_of_label(name) for name in names} == names
    for compound in ("outer race and ball", "IR-OR", "OR-IR", "IR7_OR7"):
        assert location_of_label(compound) is None


def test_a_smaller_share_of_wrong_names_needs_a_larger_margin():
    assert least_margin(1e-5) > least_margin(0.02) > least_margin(0.3) >= 0


def test_evidence_of_combs_is_that_of_faults_that_may_hide():
    scores, places = (
        np.array([[0.1, 1.2, -3.0], [0.0, 0.0, 0.0]]),
        np.array([3, 1, 1, 0, 2]),
    )
    # Simulated: a fault shows its comb with the probability VISIBLE.
    odds = [VISIBLE * np.exp(ODDS * s) + 1 - VISIBLE for s in scores[0]] + [1.0]
    expected = np.log(np.array(odds) / sum(odds))[places]
    evidence = comb_evidence(scores, places)
    np.testing.assert_allclose(evidence[0], expected)
    np.testing.assert_allclose(np.exp(evidence[1]), 0.25)
    # Places that no class stands for take no probability.
    np.testing.assert_allclose(
        np.exp(comb_evidence(scores, np.array([1, 2]))).sum(axis=1), 1
    )
    assert softmax(comb_evidence(scores, places)[0]).argmax() == 1
