"""Verdicts of diagnosers on the conditions of the paper, right by chance."""

import numpy as np
import pandas as pd
import pytest

CONDITIONS = ["Normal", "IR", "OR", "Ball", "IR-Ball", "OR-Ball", "IR-OR", "IR-OR-Ball"]


def _verdicts(seed, speeds):
    rng = np.random.default_rng(seed)
    keys = pd.MultiIndex.from_product(
        [["Diagnoser", "ALPIO", "proposed"], (6.0, 3.0), speeds, CONDITIONS, range(5)],
        names=["diagnoser", "crack_mm", "test_rpm", "true", "start"],
    )
    frame = keys.to_frame(index=False).assign(train_rpm=500.0)
    guessed = rng.choice(CONDITIONS, len(frame))
    is_right = rng.random(len(frame)) < 0.6
    return frame.assign(predicted=np.where(is_right, frame["true"], guessed))


@pytest.fixture(scope="module")
def verdicts():
    return _verdicts(0, (500.0, 300.0, 400.0, 450.0))


@pytest.fixture(scope="module")
def halves():
    return _verdicts(1, (500.0,))
