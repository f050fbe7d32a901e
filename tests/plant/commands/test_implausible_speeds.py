"""A speed in Hz, or one that no machine has, gives no verdict."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

from skarxlag import make_diagnoser, save_diagnoser

pytestmark = [
    pytest.mark.slow,
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
IN_HERTZ = [15.0, 20.0]
ORDERS = "outer=3.5,inner=5.4"


@pytest.mark.parametrize("has_model", [True, False])
def test_no_recording_gets_a_verdict(run, tmp_path, has_model):
    model, path = tmp_path / "model.skops", tmp_path / "run.npz"
    fitted = make_diagnoser(healthy="good").fit(X, Y, rpm=RPM)
    save_diagnoser(fitted, model, window_length=LENGTH, sampling_rate=RATE)
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
