import numpy as np

from benchmarks.recipe.calibration import expected_calibration_error


def test_calibration_error_of_calibrated_and_overconfident_verdicts():
    generator = np.random.default_rng(0)
    stated_confidence = generator.uniform(0.5, 1.0, 20_000)
    correct = generator.uniform(size=20_000) < stated_confidence
    assert expected_calibration_error(stated_confidence, correct) < 0.01
    assert expected_calibration_error(np.ones(10), np.arange(10) < 7) == 0.3
