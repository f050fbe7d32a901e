"""A speed in Hz, or one that no machine has, gives a verdict in no command and no class."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import (
    FaultOrderClassifier,
    make_alpio,
    make_detector,
    make_diagnoser,
    make_extended_state_pio,
    recording_verdicts,
    save_diagnoser,
    window_verdicts,
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:rpm is not given:UserWarning"),
    pytest.mark.filterwarnings("ignore:The names of the conditions:UserWarning"),
]
RATE, LENGTH = 2000.0, 1000
RNG = np.random.default_rng(0)
GOOD, WORN = (
    RNG.normal(size=(40, LENGTH)),
    lfilter([1], [1, -0.5], RNG.normal(size=(40, LENGTH))),
)
X, Y, RPM = (
    np.concatenate([GOOD, WORN]),
    np.repeat(["good", "worn"], 40),
    np.tile([900, 1200.0], 40),
)
IN_HERTZ, ANYWHERE = [15.0, 20.0], [0.001, 1e9, 0.0, -900.0, np.nan]
ORDERS = "outer=3.5,inner=5.4"


def models():
    """Each model, and whether it learned the training speeds."""
    with_speed = {"rpm": RPM}
    yield make_diagnoser(healthy="good").fit(X, Y, **with_speed), True
    yield make_diagnoser(healthy="good").fit(X, Y), False
    yield (
        make_diagnoser(sampling_rate=RATE, bearing=ORDERS).fit(X, Y, **with_speed),
        True,
    )
    yield make_alpio(healthy="good").fit(X, Y), False
    yield make_extended_state_pio(healthy="good").fit(X, Y, **with_speed), True
    yield make_detector(false_alarm_rate=0.1).fit(GOOD, rpm=RPM[:40]), True
    yield make_detector(false_alarm_rate=0.1).fit(GOOD), False
    # Combs need no training, so only the user can state at what speeds it was.
    yield FaultOrderClassifier(bearing=ORDERS, sampling_rate=RATE).fit(GOOD), False


@pytest.fixture(scope="module")
def fitted():
    return list(models())


def test_no_model_gives_a_verdict(fitted):
    for model, knows_speeds in fitted:
        for rpm in ANYWHERE + IN_HERTZ * knows_speeds:
            speeds = np.array([900.0, rpm, 900.0])
            windows = window_verdicts(model, X[:3], rpm=speeds)["verdict"]
            assert windows[1].startswith("no verdict: speed "), (model, rpm)
            assert not windows[[0, 2]].str.startswith("no verdict").any()
            row = recording_verdicts(model, X[:3], np.zeros(3), rpm=rpm).iloc[0]
            assert row["verdict"].startswith("no verdict: ") and row["alarm"] == "-"


@pytest.mark.parametrize("has_model", [True, False])
def test_no_recording_gets_a_verdict(run, tmp_path, fitted, has_model):
    model, path = tmp_path / "model.skops", tmp_path / "run.npz"
    save_diagnoser(fitted[0][0], model, window_length=LENGTH, sampling_rate=RATE)
    np.savez(path, y=GOOD[:20].ravel(), fs=RATE)
    asked = (model, path) if has_model else (path, "--bearing", ORDERS)
    for rpm in [0.001, 1e9] + IN_HERTZ * has_model:
        found = tmp_path / "found.json"
        arguments = ("diagnose", *asked, "--rpm", rpm, "-o", found)
        assert run(*arguments, "--fail-on", "alarm")[0] == 3
        code, _, err = run(*arguments)
        (row,) = json.loads(found.read_text())["recordings"]
        assert row["verdict"] == f"no verdict: {row['error']}" and row["error"], rpm
        failed = f"1 of 1 recording failed:\n  {row['recording']}: {row['error']}\n"
        assert code == 1 and failed in err, err
